// SPDX-License-Identifier: MIT
#include "base/atomic_file.h"

#include "temp_folder.h"

#include <gtest/gtest.h>

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>

#include <csignal>
#include <filesystem>
#include <fstream>

namespace fs = std::filesystem;
using kiln::AtomicFile;
using kiln::bytes_of;
using kiln::TempFolder;

namespace {

class AtomicFiles : public testing::Test {
protected:
    std::string path(const char* name) const { return (folder / name).string(); }
    size_t files() const { return size_t(std::distance(fs::directory_iterator(folder.path()), {})); }

    const TempFolder folder;
};

TEST_F(AtomicFiles, TheOldFileStaysUntilCommit) {
    std::ofstream(path("a.txt")) << "old";
    auto file = AtomicFile::create(path("a.txt"));
    ASSERT_TRUE(file) << file.error().message;
    ASSERT_TRUE(file->write("new and longer"));
    std::fflush(file->stream());
    EXPECT_EQ(bytes_of(path("a.txt")), "old");
    ASSERT_TRUE(file->commit());
    EXPECT_EQ(bytes_of(path("a.txt")), "new and longer");
    EXPECT_EQ(files(), 1u) << "a temporary was left behind";
}

TEST_F(AtomicFiles, WithoutCommitNothingIsLeftBehind) {
    {
        auto file = AtomicFile::create(path("a.png"));
        ASSERT_TRUE(file);
        ASSERT_TRUE(file->write("half"));
        EXPECT_EQ(fs::path(file->temporary_path()).extension(), ".png");
        EXPECT_EQ(fs::path(file->temporary_path()).parent_path(), folder.path());
        AtomicFile moved = std::move(*file);
        EXPECT_EQ(files(), 1u);
    }
    EXPECT_EQ(files(), 0u);
}

TEST_F(AtomicFiles, AMissingFolderIsAnErrorAndIsNotMade) {
    auto file = AtomicFile::create(path("none/a.txt"));
    ASSERT_FALSE(file);
    EXPECT_EQ(file.error().message, "cannot write " + path("none/a.txt") + ": No such file or directory");
    EXPECT_EQ(file.error().kind, kiln::ErrorKind::Failed);
    EXPECT_FALSE(fs::exists(folder / "none"));
    EXPECT_FALSE(AtomicFile::create(folder.string()));
    EXPECT_FALSE(AtomicFile::create(""));
}

// A limit on the size of files stands in for a full disk. (Never /dev/full: with a bug here, root would replace it.)
TEST_F(AtomicFiles, AFullDiskIsReportedAndTheOldFileStays) {
    std::ofstream(path("a.txt")) << "old";
    const pid_t child = fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
        std::signal(SIGXFSZ, SIG_IGN);
        const rlimit small{10, 10};
        setrlimit(RLIMIT_FSIZE, &small);
        auto file = AtomicFile::create(path("a.txt"));
        (void)file->write("more than ten bytes");
        const auto done = file->commit();
        const bool right = !done && done.error().message == "cannot write " + path("a.txt") + ": File too large";
        _exit(right ? 0 : 1);
    }
    int status = 0;
    ASSERT_EQ(waitpid(child, &status, 0), child);
    EXPECT_EQ(WEXITSTATUS(status), 0);
    EXPECT_EQ(bytes_of(path("a.txt")), "old");
    EXPECT_EQ(files(), 1u);
}

TEST_F(AtomicFiles, APipeIsWrittenToAndNotReplaced) {
    ASSERT_EQ(mkfifo(path("pipe").c_str(), 0600), 0);
    const int reader = open(path("pipe").c_str(), O_RDWR | O_NONBLOCK);
    ASSERT_GE(reader, 0);
    auto file = AtomicFile::create(path("pipe"));
    ASSERT_TRUE(file);
    ASSERT_TRUE(file->write("through"));
    ASSERT_TRUE(file->commit());
    char seen[16] = {};
    EXPECT_EQ(::read(reader, seen, sizeof seen), 7);
    EXPECT_STREQ(seen, "through");
    close(reader);
    EXPECT_TRUE(fs::is_fifo(path("pipe")));
    EXPECT_EQ(files(), 1u);
}

TEST_F(AtomicFiles, ALinkStaysALinkAndItsTargetChanges) {
    std::ofstream(path("real.txt")) << "old";
    fs::create_symlink("real.txt", path("link.txt"));
    fs::create_symlink("later.txt", path("dangling.txt"));
    for (const char* name : {"link.txt", "dangling.txt"}) {
        auto file = AtomicFile::create(path(name));
        ASSERT_TRUE(file);
        ASSERT_TRUE(file->write("new"));
        ASSERT_TRUE(file->commit());
        EXPECT_TRUE(fs::is_symlink(path(name))) << name;
    }
    EXPECT_EQ(bytes_of(path("real.txt")), "new");
    EXPECT_EQ(bytes_of(path("later.txt")), "new");
}

TEST_F(AtomicFiles, KeepsTheModeOfTheFileItReplaces) {
    std::ofstream(path("a.sh")) << "old";
    ASSERT_EQ(chmod(path("a.sh").c_str(), 0750), 0);
    auto file = AtomicFile::create(path("a.sh"));
    ASSERT_TRUE(file && file->write("new") && file->commit());
    struct stat now;
    ASSERT_EQ(stat(path("a.sh").c_str(), &now), 0);
    EXPECT_EQ(now.st_mode & 07777, 0750u);
}

TEST_F(AtomicFiles, ASignalHandlerRemovesTemporaries) {
    const pid_t child = fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
        std::signal(SIGINT, [](int) {
            AtomicFile::remove_temporaries_from_signal();
            _exit(130);
        });
        for (int i = 0; i < 100; ++i)
            (void)AtomicFile::create(path("b.png"))->commit();  // must not fill the handler's table
        auto file = AtomicFile::create(path("a.png"));
        std::raise(SIGINT);
        _exit(1);
    }
    int status = 0;
    ASSERT_EQ(waitpid(child, &status, 0), child);
    EXPECT_EQ(WEXITSTATUS(status), 130);
    EXPECT_FALSE(fs::exists(path("a.png")));
    EXPECT_TRUE(fs::exists(path("b.png"))) << "a committed file was removed";
    EXPECT_EQ(files(), 1u);
}

}  // namespace
