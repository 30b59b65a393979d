// SPDX-License-Identifier: MIT
// Starts threads.
#include "scene/journal.h"

#include "field/clipmaps.h"
#include "field/host_bricks.h"
#include "kept_scene.h"
#include "random_changes.h"
#include "scene_text.h"
#include "temp_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <new>
#include <fcntl.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <thread>
#include <unistd.h>

namespace kiln {
namespace {

namespace fs = std::filesystem;
using scene::RandomChanges;
using testing::HasSubstr;

class Journals : public testing::Test {
protected:
    void SetUp() override { write_bytes(scene_, kScene); }

    World open() {
        auto world = World::open(scene_);
        EXPECT_TRUE(world) << world.error().message;
        return world ? std::move(*world) : World();
    }
    std::string loaded() {
        const auto world = World::load(scene_);
        return world ? world->to_json() : world.error().message;
    }
    void be(const std::string& scene, const std::string& journal) {
        write_bytes(scene_, scene);
        write_bytes(journal_, journal);
    }

    const TempFolder folder_;
    const fs::path scene_ = folder_ / "s.kiln.json", journal_ = folder_ / "s.kiln.json.journal";
};

TEST_F(Journals, EveryChangeIsThereBeforeItsCallReturns) {
    World world = open();
    RandomChanges random(3);
    History history = world.history();
    for (int i = 0; i < 200; ++i) {
        if (i % 7 == 0) history.begin_group("stroke \"" + std::to_string(i) + "\"\n\xff");
        (void)random.one(world);
        if (i % 7 == 4) {
            ASSERT_TRUE(i % 2 ? history.end_group() : history.cancel_group());
        }
        if (i % 7 > 4 && i % 3 == 0) {
            ASSERT_TRUE(i % 2 ? history.undo() : history.redo());
            random.look(world);
        }
        // As if the process had ended here.
        ASSERT_EQ(loaded(), world.to_json()) << i;
    }
    EXPECT_EQ(bytes_of(scene_), kScene);
}

// As it was baked while the log was made, edit by edit, and as it is baked from the log that 1, 2 or 8 threads read and bake.
TEST_F(Journals, TheFieldOfALogIsTheSameForAnyNumberOfThreads) {
    const FieldSettings one_level{.voxel_size = 0.06f, .bounds = Box3{{-1.2f, -1.2f, -1.2f}, {1.2f, 1.2f, 1.2f}}};
    const FieldSettings levels{.voxel_size = 0.06f, .cells = 32, .levels = 3, .bounds = {}};
    const Camera camera{.position = {0.2f, 0.1f, 0.3f}};
    const auto seen = [&](World& world, const FieldSettings& settings) {
        world.field_settings = settings;
        auto frame = world.frame(camera);
        EXPECT_TRUE(frame) << frame.error().message;
        return std::move(*frame);
    };
    uint64_t field_hash = 0, levels_hash = 0, before = 0;
    {
        World world = open();
        RandomChanges random(13);
        for (int i = 0; i < 60; ++i) {
            (void)random.one(world);
            if (i % 5 == 0) (void)world.history().undo(), random.look(world);
            if (i % 6 == 5) before = field::hash_of_bricks(*seen(world, levels).levels);
        }
        const auto any = field::worlds::edit(Sphere{.radius = 0.5f}, {0.2f, 0.1f, -0.3f});
        ASSERT_TRUE(world.add(any));
        levels_hash = field::hash_of_bricks(*seen(world, levels).levels);
        field_hash = field::HostBricks::bake(seen(world, one_level).field).hash();
        ASSERT_NE(levels_hash, before);
    }
    for (const int workers : {1, 2, 8}) {
        auto world = World::load(scene_, workers);
        ASSERT_TRUE(world) << world.error().message;
        const Frame whole = seen(*world, one_level), around = seen(*world, levels);
        field::FieldOptions of_field = whole.field->options();
        of_field.workers = workers;
        const auto field = field::Field::build(whole.field->shared_program(), of_field);
        ASSERT_TRUE(field) << field.error().message;
        EXPECT_EQ(field::HostBricks::bake(*field, workers).hash(), field_hash) << workers;
        field::ClipmapOptions of_levels = around.levels->options();
        of_levels.workers = workers;
        field::Clipmap map = field::made(around.levels->program(), around.levels->focus(), of_levels);
        ASSERT_TRUE(map.work());
        EXPECT_EQ(field::hash_of_bricks(map), levels_hash) << workers;
    }
}

TEST_F(Journals, WhatIsReadIsTheSameForAnyNumberOfThreads) {
    std::string text;
    {
        World world = open();
        RandomChanges random(11);
        for (int i = 0; i < 3000; ++i) {
            (void)random.one(world);
            if (i % 5 == 0) (void)world.history().undo(), random.look(world);
        }
        text = world.to_json();
    }
    for (const int workers : {1, 2, 8}) {
        const auto world = World::load(scene_, workers);
        ASSERT_TRUE(world) << world.error().message;
        EXPECT_EQ(world->to_json(), text) << workers;
    }
}

TEST_F(Journals, ARayNamesTheRightEditOfAWorldThatWasReadFromAJournal) {
    {
        World world = open();
        for (int i = 0; i < 5; ++i) {
            Edit e = ball("e" + std::to_string(i), 0.25f);
            e.node.transform.position = {float(10 + i), 0, 0};
            ASSERT_TRUE(world.add(e));
        }
        ASSERT_TRUE(world.remove(*world.find_edit("e0")));
        ASSERT_TRUE(world.reorder(*world.find_edit("e4"), *world.find_edit("a")));
    }
    const auto world = World::load(scene_);
    ASSERT_TRUE(world);
    for (int i = 1; i < 5; ++i) {
        const RayHit hit = world->cast({.origin = {float(10 + i), 5, 0}, .direction = {0, -1, 0}});
        ASSERT_TRUE(hit.hit);
        EXPECT_EQ(hit.edit, *world->find_edit("e" + std::to_string(i)));
    }
}

TEST_F(Journals, HistoryGoesOnWhereTheProcessEnded) {
    std::vector<std::string> states;
    {
        World world = open();
        states.push_back(world.to_json());
        RandomChanges random(4);
        while (world.history().steps().size() < 30) {
            const size_t before = world.history().steps().size();
            (void)random.one(world);
            if (world.history().steps().size() == before + 1)
                states.resize(before + 1), states.push_back(world.to_json());
        }
        ASSERT_TRUE(world.history().go_to(7));
    }
    World world = open();
    History history = world.history();
    EXPECT_EQ(history.now(), 7u);
    ASSERT_EQ(history.steps().size(), 30u);
    for (const uint32_t to : {29u, 3u, 0u, 17u, 30u, 8u}) {
        ASSERT_TRUE(history.go_to(to));
        if (to < states.size() && !states[to].empty()) {
            EXPECT_EQ(world.to_json(), states[to]) << to;
        }
        EXPECT_EQ(loaded(), world.to_json());
    }
}

TEST_F(Journals, SavingEmptiesTheJournalAndUndoGoesBackBeyondIt) {
    World world = open();
    History history = world.history();
    const std::string first = world.to_json();
    const EditId a = *world.find_edit("a"), b = *world.find_edit("b");
    ASSERT_TRUE(world.remove(a));
    Edit moved = *world.find(b);
    moved.node.transform.position = {1, 0, 0};
    ASSERT_TRUE(world.change(b, moved));
    const std::string second = world.to_json();
    ASSERT_TRUE(world.save(scene_));
    EXPECT_EQ(bytes_of(scene_), second);
    EXPECT_EQ(bytes_of(journal_).size(), 32u);
    EXPECT_THAT(second, HasSubstr("\"wind\": [1, 0, 0]"));
    ASSERT_TRUE(*history.undo());
    ASSERT_TRUE(*history.undo());
    EXPECT_EQ(world.edits(), (std::vector<EditId>{a, b}));
    EXPECT_EQ(world.find(a)->outline->width_px, 5);
    EXPECT_EQ(loaded(), world.to_json());
    ASSERT_TRUE(*history.redo());
    ASSERT_TRUE(*history.redo());
    EXPECT_EQ(loaded(), second);
    ASSERT_TRUE(*history.undo());
    ASSERT_TRUE(world.add(ball("c", 1)));
    EXPECT_EQ(loaded(), world.to_json());
    ASSERT_TRUE(world.save(scene_));
    EXPECT_EQ(loaded(), world.to_json());
    ASSERT_TRUE(world.save(folder_ / "copy.kiln.json")) << "elsewhere it is only written";
    EXPECT_EQ(bytes_of(folder_ / "copy.kiln.json"), bytes_of(scene_));
    history.begin_group("open");
    EXPECT_FALSE(world.save(scene_));
}

TEST_F(Journals, AKillAtAnyPointOfSavingLosesNothing) {
    World world = open();
    ASSERT_TRUE(world.add(ball("c", 1)));
    ASSERT_TRUE(world.add(ball("d", 1)));
    ASSERT_TRUE(*world.history().undo());
    const std::string text = world.to_json();
    const std::string journal_before = bytes_of(journal_);
    ASSERT_TRUE(world.save(scene_));
    const std::string scene_after = bytes_of(scene_), journal_after = bytes_of(journal_);
    ASSERT_EQ(scene_after, text);
    ASSERT_TRUE(world.add(ball("e", 1)));
    const std::string later = world.to_json(), journal_later = bytes_of(journal_);
    world = World();
    // The journal with the mark, as save() wrote it, and as it would go on were it not emptied.
    const auto hash = hash128(std::as_bytes(std::span(scene_after.data(), scene_after.size())));
    std::string journal_marked, journal_on;
    {
        std::string bytes;
        write_bytes(journal_, journal_before);
        auto file = RecordFile::open(journal_, bytes);
        ASSERT_TRUE(file && file->resume(read_records(bytes)) && file->append(scene::saved_record(hash)));
        journal_marked = bytes_of(journal_);
        ASSERT_TRUE(file->append("{\"add\":{\"id\":\"e\",\"shape\":\"sphere\",\"radius\":1}}"));
        journal_on = bytes_of(journal_);
    }
    const auto check = [&](const std::string& scene, const std::string& journal, const std::string& expected) {
        be(scene, journal);
        const auto loaded_world = World::load(scene_);
        ASSERT_TRUE(loaded_world) << loaded_world.error().message;
        EXPECT_TRUE(compare_scenes(*loaded_world, *World::parse(expected, "s.json")).equal)
            << compare_scenes(*loaded_world, *World::parse(expected, "s.json")).lines;
        if (const auto report = loaded_world->journal_report()) {
            EXPECT_EQ(report->dropped_bytes, 0u) << report->sentence();
        }
        // And going on from there keeps going.
        World again = open();
        ASSERT_TRUE(again.add(ball("z", 2)));
        EXPECT_EQ(loaded(), again.to_json());
        ASSERT_TRUE(again.save(scene_));
        EXPECT_EQ(loaded(), again.to_json());
    };
    check(kScene, journal_before, text);
    check(kScene, journal_marked, text);       // marked, not renamed
    check(scene_after, journal_marked, text);  // renamed, not emptied
    check(scene_after, "", text);              // emptied, without a header yet
    check(scene_after, journal_after, text);   // done
    check(scene_after, journal_later, later);
    check(kScene, journal_on, later);       // the rename failed, and the program went on
    check(scene_after, journal_on, later);  // the emptying failed, and the program went on
}

TEST_F(Journals, ABrokenJournalOpensToItsLastGoodCommandAndKeepsTheRest) {
    std::vector<std::string> states;
    std::vector<size_t> ends;
    {
        World world = open();
        states.push_back(world.to_json());
        ends.push_back(bytes_of(journal_).size());
        const auto made = [&] {
            states.push_back(world.to_json());
            ends.push_back(bytes_of(journal_).size());
        };
        ASSERT_TRUE(world.add(ball("c", 1)));
        made();
        ASSERT_TRUE(world.remove(*world.find_edit("a")));
        made();
        ASSERT_TRUE(*world.history().undo());
        made();
    }
    const std::string whole = bytes_of(journal_);
    ASSERT_EQ(ends.back(), whole.size());
    const auto check = [&](const std::string& journal, size_t good, const std::string& what) {
        write_bytes(journal_, journal);
        size_t state = 0;
        while (state + 1 < ends.size() && ends[state + 1] <= good) ++state;
        const auto world = World::load(scene_);
        ASSERT_TRUE(world) << what;
        ASSERT_EQ(world->to_json(), states[state]) << what;
        const size_t kept = good < 32 ? 0 : ends[state];
        const auto report = world->journal_report();
        ASSERT_EQ(report ? report->dropped_bytes : 0, journal.size() - kept) << what;
        if (report && report->dropped_bytes > 0) {
            EXPECT_THAT(report->sentence(), HasSubstr("left out")) << what;
        }
    };
    for (size_t n = 0; n < whole.size(); ++n) check(whole.substr(0, n), n, "cut at " + std::to_string(n));
    for (size_t at = 0; at < whole.size(); ++at) {
        std::string broken = whole;
        broken[at] = char(uint8_t(broken[at]) ^ uint8_t(1u << (at % 8)));
        check(broken, at, "flipped at " + std::to_string(at));
    }
    // Opened for editing: what is left out is put aside, twice under two names.
    for (const char* name : {"s.kiln.json.journal.dropped", "s.kiln.json.journal.dropped-2"}) {
        std::string broken = whole;
        broken[ends[1] + 20] ^= 1;
        write_bytes(journal_, broken);
        World world = open();
        EXPECT_EQ(world.to_json(), states[1]);
        EXPECT_EQ(bytes_of(folder_ / name), broken.substr(ends[1]));
        EXPECT_THAT(world.journal_report()->sentence(), HasSubstr(name));
        ASSERT_TRUE(world.add(ball("d", 1)));
        EXPECT_EQ(loaded(), world.to_json());
    }
}

TEST_F(Journals, AForeignJournalIsPutAside) {
    {
        World world = open();
        ASSERT_TRUE(world.add(ball("c", 1)));
    }
    const std::string other = "{\"format\": 1, \"edits\": [{\"id\": \"only\", \"shape\": \"sphere\"}]}";
    write_bytes(scene_, other);
    const std::string journal = bytes_of(journal_);
    const auto read = World::load(scene_);
    ASSERT_TRUE(read);
    EXPECT_EQ(read->edits().size(), 1u);
    ASSERT_TRUE(read->journal_report());
    EXPECT_TRUE(read->journal_report()->foreign);
    EXPECT_THAT(read->journal_report()->sentence(), HasSubstr("continues another scene"));
    EXPECT_EQ(bytes_of(journal_), journal) << "reading changes nothing";
    World world = open();
    EXPECT_EQ(bytes_of(folder_ / "s.kiln.json.journal.dropped"), journal);
    ASSERT_TRUE(world.add(ball("d", 1)));
    EXPECT_EQ(loaded(), world.to_json());
    // One without records is nobody's loss.
    ASSERT_TRUE(world.save(scene_));
    const std::string empty = bytes_of(journal_);
    world = World();
    be(other, empty);
    EXPECT_FALSE(World::load(scene_)->journal_report());
    world = open();
    EXPECT_FALSE(fs::exists(folder_ / "s.kiln.json.journal.dropped-2"));
}

TEST_F(Journals, OneProgramEditsASceneWhileOthersRead) {
    World world = open();
    ASSERT_TRUE(world.add(ball("c", 1)));
    const auto second = World::open(scene_);
    ASSERT_FALSE(second);
    EXPECT_THAT(second.error().message, HasSubstr("close it there first"));
    EXPECT_EQ(second.error().kind, ErrorKind::Failed);
    const auto read = World::load(scene_);
    ASSERT_TRUE(read);
    EXPECT_EQ(read->to_json(), world.to_json());
    EXPECT_FALSE(read->save(scene_)) << "it would pull the scene from under the editor";
    // A link is the same scene.
    fs::create_symlink(scene_, folder_ / "link.kiln.json");
    EXPECT_FALSE(World::open(folder_ / "link.kiln.json"));
    EXPECT_EQ(World::load(folder_ / "link.kiln.json")->edits().size(), 3u);
    world = World();
    EXPECT_TRUE(World::open(scene_));
    EXPECT_FALSE(World::open(folder_ / "none.kiln.json"));
    EXPECT_FALSE(fs::exists(folder_ / "none.kiln.json.journal"));
}

TEST_F(Journals, ReadersSeeOneStateOrTheNextWhileSomeoneEditsAndSaves) {
    World world = open();
    std::atomic<bool> stop = false;
    std::atomic<int> wrong = 0, reads = 0;
    std::thread reader([&] {
        while (!stop) {
            const auto read = World::load(scene_);
            // Edits are added one at a time: what is seen is a beginning of the list.
            if (!read) {
                ++wrong;
                continue;
            }
            const size_t n = read->edits().size() - 2;
            if (n > 0 && !read->find_edit("e" + std::to_string(n - 1))) ++wrong;
            if (read->journal_report() && read->journal_report()->dropped_bytes > 0) ++wrong;
            ++reads;
        }
    });
    for (int i = 0; i < 150 || reads < 20; ++i) {
        ASSERT_TRUE(world.add(ball("e" + std::to_string(i), 1)));
        if (i % 10 == 9) {
            ASSERT_TRUE(world.save(scene_));
        }
    }
    stop = true;
    reader.join();
    EXPECT_EQ(wrong, 0);
}

TEST_F(Journals, AFullDiskRefusesTheChangeAndLeavesTheWorld) {
    World world = open();
    World* const w = &world;
    History history = world.history();
    ASSERT_TRUE(world.add(ball("c", 1)));
    ASSERT_TRUE(world.add(ball("d", 1)));
    ASSERT_TRUE(*history.undo());
    const std::string text = world.to_json(), journal = bytes_of(journal_);
    const EditId a = *world.find_edit("a"), b = *world.find_edit("b");
    const auto with_full_disk = [&](auto&& change) {
        struct rlimit old {};
        ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &old), 0);
        const auto handler = std::signal(SIGXFSZ, SIG_IGN);
        const struct rlimit low { journal.size() + 5, old.rlim_max };
        ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &low), 0);
        const bool done = bool(change());
        ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &old), 0);
        std::signal(SIGXFSZ, handler);
        EXPECT_FALSE(done);
        EXPECT_EQ(w->to_json(), text);
        EXPECT_EQ(bytes_of(journal_), journal);
        EXPECT_EQ(bytes_of(scene_), kScene);
        EXPECT_EQ(loaded(), text);
    };
    with_full_disk([&] { return world.add(ball("e", 1)); });
    with_full_disk([&] { return world.change(a, ball("a", 3)); });
    with_full_disk([&] { return world.remove(b); });
    with_full_disk([&] { return world.reorder(a, {}); });
    with_full_disk([&] { return history.redo(); });
    with_full_disk([&] { return history.go_to(0); });
    with_full_disk([&] { return world.add_material("m", {}); });
    with_full_disk([&] { return world.save(scene_); });
    EXPECT_EQ(history.now(), 1u);
    ASSERT_TRUE(world.add(ball("e", 1)));
    EXPECT_EQ(loaded(), world.to_json());
    ASSERT_TRUE(history.go_to(2));
    EXPECT_EQ(loaded(), world.to_json());
}

TEST_F(Journals, SettingsThatNoSceneCouldHoldAreRefused) {
    World world = open();
    world.lights.push_back({.illuminance = std::numeric_limits<float>::quiet_NaN()});
    const auto refused = world.add(ball("c", 1));
    ASSERT_FALSE(refused);
    EXPECT_THAT(refused.error().message, HasSubstr("lights"));
    world.lights.clear();
    ASSERT_TRUE(world.add(ball("c", 1)));
    EXPECT_EQ(loaded(), world.to_json());
}

TEST_F(Journals, WhatARecordCannotDoEndsTheReading) {
    World world = open();
    ASSERT_TRUE(world.add(ball("c", 1)));
    world = World();
    for (const char* bad : {"{\"remove\":\"nobody\"}", "[]", "{}", "nonsense", "{\"go\":77}", "{\"go\":-1}",
                            "{\"end\":true}", "{\"add\":{\"id\":\"c\",\"shape\":\"sphere\"}}", "{\"step\":\"x\"}",
                            "{\"step\":\"x\",\"commands\":[{\"remove\":\"c\"},{\"remove\":\"c\"}]}"}) {
        const std::string good = bytes_of(journal_);
        {
            std::string bytes;
            auto file = RecordFile::open(journal_, bytes);
            ASSERT_TRUE(file && file->resume(read_records(bytes)) && file->append(bad) &&
                        file->append("{\"remove\":\"b\"}"));
        }
        const auto read = World::load(scene_);
        ASSERT_TRUE(read) << bad;
        EXPECT_EQ(read->edits().size(), 3u) << bad;
        EXPECT_TRUE(read->find_edit("c")) << bad;
        EXPECT_THAT(read->journal_report()->sentence(), HasSubstr("record 2 cannot be applied")) << bad;
        write_bytes(journal_, good);
    }
}

// ---- killing

// What the child tells while it lives, in a file that it shares with its parent.
struct Told {
    std::atomic<uint32_t> done;
};

// One call of the world's: every one is acknowledged by itself.
bool act(World& world, RandomChanges& random, const std::string& scene) {
    History history = world.history();
    const int what = random.below(20);
    if (what < 14) return random.one(world);
    if (what == 14) return history.begin_group("stroke"), true;
    if (what == 15) return bool(history.end_group());
    if (what == 16) return bool(history.undo());
    if (what == 17) return bool(history.redo());
    if (what == 18) return bool(history.cancel_group());
    return bool(world.save(scene));
}

// Runs in a process of its own, which is killed.
TEST(JournalChild, DISABLED_EditsUntilItIsKilled) {
    const char* const folder = std::getenv("KILN_JOURNAL_CHILD");
    if (!folder) GTEST_SKIP() << "only for the tests below";
    const std::string scene = std::string(folder) + "/s.kiln.json";
    const int fd = ::open((std::string(folder) + "/told").c_str(), O_RDWR);
    auto* const told = static_cast<Told*>(::mmap(nullptr, sizeof(Told), PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0));
    ASSERT_NE(told, MAP_FAILED);
    auto world = World::open(scene, 1);
    if (!world) std::fprintf(stderr, "%s\n", world.error().message.c_str());
    ASSERT_TRUE(world);
    RandomChanges random(uint32_t(std::atoi(std::getenv("KILN_JOURNAL_SEED"))));
    random.look(*world);
    while (true) {
        (void)act(*world, random, scene);
        told->done.fetch_add(1);
    }
}

void kill_rounds(const fs::path& folder, int rounds, int most_us) {
    const fs::path scene = folder / "s.kiln.json", journal = folder / "s.kiln.json.journal";
    const fs::path twin_folder = folder / "twin", twin = twin_folder / "s.kiln.json";
    fs::create_directory(twin_folder);
    write_bytes(folder / "told", std::string(sizeof(Told), '\0'));
    const int fd = ::open((folder / "told").c_str(), O_RDWR);
    auto* const told = new (::mmap(nullptr, sizeof(Told), PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0)) Told;
    std::mt19937 random{uint32_t(rounds)};
    uint64_t acts = 0;
    for (int round = 0; round < rounds; ++round) {
        // The same from the same files, for the expected answer.
        fs::copy_file(scene, twin, fs::copy_options::overwrite_existing);
        for (const char* side : {"s.kiln.json.journal", "s.kiln.json.history"}) {
            fs::remove(twin_folder / side);
            if (fs::exists(folder / side)) fs::copy_file(folder / side, twin_folder / side);
        }
        told->done = 0;
        const auto seed = uint32_t(random());
        ::setenv("KILN_JOURNAL_CHILD", folder.c_str(), 1);
        ::setenv("KILN_JOURNAL_SEED", std::to_string(int(seed & 0x7fffffff)).c_str(), 1);
        const pid_t child = ::fork();
        if (child == 0) {
            ::execl("/proc/self/exe", "child", "--gtest_also_run_disabled_tests", "--gtest_filter=JournalChild.*",
                    "--gtest_brief=1", nullptr);
            ::_exit(99);
        }
        ASSERT_GT(child, 0);
        // Sometimes while it opens, mostly later.
        if (round % 8 != 0)
            for (int i = 0; told->done == 0 && i < 20000; ++i)
                std::this_thread::sleep_for(std::chrono::milliseconds(1));
        std::this_thread::sleep_for(std::chrono::microseconds(random() % uint32_t(most_us)));
        ::kill(child, SIGKILL);
        int status = 0;
        ASSERT_EQ(::waitpid(child, &status, 0), child);
        ASSERT_TRUE(WIFSIGNALED(status)) << "it ended by itself: " << status;
        const uint32_t done = told->done;
        acts += done;

        const auto left = World::load(scene);
        ASSERT_TRUE(left) << left.error().message;
        auto expected = World::open(twin, 1);
        ASSERT_TRUE(expected) << expected.error().message;
        RandomChanges again(seed & 0x7fffffff);
        again.look(*expected);
        for (uint32_t i = 0; i < done; ++i) (void)act(*expected, again, twin);
        // The call that was cut short is in it or not.
        bool same = compare_scenes(*left, *expected).equal;
        const std::string lines = compare_scenes(*left, *expected).lines;
        if (!same) {
            (void)act(*expected, again, twin);
            same = compare_scenes(*left, *expected).equal;
        }
        ASSERT_TRUE(same) << "round " << round << ", after " << done << " calls\n" << lines;
        // And all that was ever done can be undone, saves or not.
        auto undone = World::load(scene, 1, true);
        ASSERT_TRUE(undone) << undone.error().message;
        ASSERT_TRUE(compare_scenes(*undone, *left).equal);
        ASSERT_TRUE(undone->history().go_to(0));
        ASSERT_TRUE(compare_scenes(*undone, *World::parse(kScene, "s.json")).equal)
            << "round " << round << "\n"
            << compare_scenes(*undone, *World::parse(kScene, "s.json")).lines;
        for (const auto& entry : fs::directory_iterator(folder))
            ASSERT_THAT(entry.path().filename().string(), testing::Not(HasSubstr("dropped")))
                << left->journal_report()->sentence();
        // Large worlds make slow rounds.
        if (left->edits().size() > 300) {
            fs::remove(journal);
            fs::remove(folder / "s.kiln.json.history");
            write_bytes(scene, kScene);
        }
        // A temporary that a kill left while saving is nobody's.
        for (const auto& entry : fs::directory_iterator(folder))
            if (entry.path().filename().string().starts_with(".s.")) fs::remove(entry.path());
    }
    ::munmap(told, sizeof(Told));
    ::close(fd);
    testing::Test::RecordProperty("calls", std::to_string(acts));
}

TEST_F(Journals, KilledAtAnyMomentNoAcknowledgedChangeIsLost) { kill_rounds(folder_.path(), 25, 20000); }

class JournalsSlow : public Journals {};
TEST_F(JournalsSlow, AThousandKillsLoseNothing) { kill_rounds(folder_.path(), 1000, 30000); }

}  // namespace
}  // namespace kiln
