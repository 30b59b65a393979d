// SPDX-License-Identifier: MIT
// A program that is killed while it plays and digs (SIGKILL, at any moment): what it had done is in the journal.
#include "player/session.h"
#include "temp_folder.h"

#include <kiln/world.h>

#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <fstream>
#include <random>
#include <string>
#include <thread>

#include <fcntl.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

namespace kiln::player {
namespace {

// A row of posts with caps on them; a bite takes a cap off its post.
std::string scene() {
    std::string out = R"({"format": 1, "field": {"voxel_size": 0.1}, "edits": [{"id": "ground", "shape": "plane"})";
    for (int i = 0; i < 8; ++i)
        for (const char* part :
             {R"("half_extents": [0.1, 0.5, 0.1], "position": [)", R"("half_extents": [0.3, 0.2, 0.3], "position": [)"})
            out += R"(, {"shape": "box", )" + std::string(part) + std::to_string(2 * i) +
                   (part[18] == '1' ? ", 0.5, 0]}" : ", 1.1, 0]}");
    return out + "]}";
}
vec3 post(int i) { return {2 * float(i % 8), 0.5f, 0}; }

struct Told {
    std::atomic<uint32_t> digs{0}, steps{0};
};
Told* shared(const std::string& folder) {
    const int fd = ::open((folder + "/told").c_str(), O_RDWR);
    void* const at = ::mmap(nullptr, sizeof(Told), PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0);
    ::close(fd);
    return static_cast<Told*>(at);
}
std::string command(int i) {
    return R"({"add": {"id": "dig)" + std::to_string(i + 1) +
           R"(", "shape": "sphere", "radius": 0.25, "op": "subtract", "position": [)" + std::to_string(2 * (i % 8)) +
           ", 0.5, 0]}}";
}

// What is killed: digs until it is.
TEST(PlayChild, DISABLED_Plays) {
    const char* const folder = std::getenv("KILN_PLAY_CHILD");
    ASSERT_NE(folder, nullptr);
    const bool window = std::string(std::getenv("KILN_PLAY_HOW")) == "window";
    const std::string file = std::string(folder) + "/s.kiln.json";
    Told& told = *shared(folder);
    if (window) {
        // As the window does it.
        auto session = Session::open(file, "");
        ASSERT_TRUE(session) << session.error().message;
        for (int i = 0;; ++i) {
            (*session)->begin_stroke("dig");
            ASSERT_TRUE((*session)->dig(post(i), 0.25f, false));
            told.digs = uint32_t(i + 1);
            if (i % 3 != 0) continue;
            ASSERT_TRUE((*session)->end_stroke());
            for (int k = 0; k < 4; ++k, ++told.steps) ASSERT_TRUE((*session)->step());
        }
    }
    auto world = World::open(file);
    ASSERT_TRUE(world) << world.error().message;
    auto play = Play::begin(*world);
    ASSERT_TRUE(play) << play.error().message;
    for (int i = 0;; ++i) {
        ASSERT_TRUE(play->apply(command(i)));
        told.digs = uint32_t(i + 1);
        for (int k = 0; k < 4; ++k, ++told.steps) ASSERT_TRUE(play->step());
    }
}

void kill_again_and_again(const char* how, uint32_t rounds) {
    std::mt19937 random{rounds};
    for (uint32_t round = 0; round < rounds; ++round) {
        const TempFolder folder;
        const std::string file = (folder / "s.kiln.json").string();
        std::ofstream(file) << scene();
        std::ofstream(folder / "told", std::ios::binary) << std::string(sizeof(Told), '\0');
        Told* const told = shared(folder.string());
        const uint32_t most = 1 + uint32_t(random()) % 12;
        ::setenv("KILN_PLAY_CHILD", folder.string().c_str(), 1);
        ::setenv("KILN_PLAY_HOW", how, 1);
        const pid_t child = ::fork();
        if (child == 0) {
            ::execl("/proc/self/exe", "child", "--gtest_also_run_disabled_tests", "--gtest_filter=PlayChild.*",
                    "--gtest_brief=1", nullptr);
            ::_exit(99);
        }
        ASSERT_GT(child, 0);
        int status = 0;
        while (told->digs < most) {
            ASSERT_EQ(::waitpid(child, &status, WNOHANG), 0) << "it ended by itself: " << status;
            std::this_thread::yield();
        }
        ::kill(child, SIGKILL);
        ASSERT_EQ(::waitpid(child, &status, 0), child);
        ASSERT_TRUE(WIFSIGNALED(status)) << status;
        const uint32_t digs = told->digs;
        ::munmap(told, sizeof(Told));

        auto left = World::open(file);
        ASSERT_TRUE(left) << left.error().message;
        for (uint32_t i = 1; i <= digs; ++i)
            EXPECT_TRUE(left->find_edit("dig" + std::to_string(i))) << how << " " << i << " of " << digs;
        EXPECT_FALSE(left->find_edit("dig" + std::to_string(digs + 2))) << "one at most was on its way";
        const auto report = left->journal_report();
        ASSERT_TRUE(report);
        EXPECT_FALSE(report->foreign);
        EXPECT_GE(report->commands, digs);
        // It is played on from there, and undo reaches the beginning.
        auto play = Play::start(*left);
        ASSERT_TRUE(play) << play.error().message;
        ASSERT_TRUE(play->step());
        ASSERT_TRUE(left->history().go_to(0));
        EXPECT_EQ(left->edits().size(), 17u);
    }
}

TEST(KilledInPlay, ASessionOfTheWindowLosesNoDig) { kill_again_and_again("window", 4); }
TEST(KilledInPlay, APlayOfAWorldThatIsEditedLosesNoCommand) { kill_again_and_again("begin", 4); }

}  // namespace
}  // namespace kiln::player
