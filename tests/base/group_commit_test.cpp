// SPDX-License-Identifier: MIT
// Starts threads.
// What a power cut leaves of a RecordFile, in a time that only the test moves: a millisecond is a step, and a sync takes as many as the test says.

#include "base/record_file.h"
#include "temp_folder.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cerrno>
#include <optional>
#include <random>
#include <thread>

namespace kiln {
namespace {

using std::chrono::milliseconds;

class TestClock : public CommitClock {
public:
    explicit TestClock(std::string path) : path_(std::move(path)) {}

    Time now() override { return Time(milliseconds(now_ms_.load())); }
    int64_t now_ms() const { return now_ms_; }

    void wait(std::condition_variable& wake, std::unique_lock<std::mutex>& lock, Time) override {
        {
            const std::lock_guard own(mutex_);
            file_mutex_ = lock.mutex();
            file_wake_ = &wake;
            ++waits_;
            rests_ = true;
        }
        changed_.notify_all();
        wake.wait(lock);
        const std::lock_guard own(mutex_);
        rests_ = false;
    }

    // Holds up whoever calls it until the test has moved the time far enough. What is on the disk then is what was written when it began.
    int sync(int) override {
        std::unique_lock own(mutex_);
        ++syncs_;
        if (error_) return error_;
        const std::string written = bytes_of(path_);
        sync_ends_ms_ = now_ms_ + sync_takes_ms_;
        syncing_ = sync_takes_ms_ > 0;
        changed_.notify_all();
        changed_.wait(own, [&] { return !syncing_; });
        on_disk_ = written;
        ++waits_;
        return 0;
    }

    // One more millisecond; returns when the thread that syncs has done all it does at that time.
    void step() {
        ++now_ms_;
        settle();
    }
    void settle() {
        std::unique_lock own(mutex_);
        if (syncing_) {
            if (now_ms_ < sync_ends_ms_) return;
            syncing_ = false;
            changed_.notify_all();
        }
        if (!file_mutex_) changed_.wait(own, [&] { return rests_ || syncing_; });
        if (syncing_) return;
        // Once around its loop: it has seen what the test did before.
        const uint64_t before = waits_;
        while (!syncing_ && !(rests_ && waits_ > before)) {
            std::mutex* const file_mutex = rests_ ? file_mutex_ : nullptr;
            std::condition_variable* const file_wake = file_wake_;
            own.unlock();
            if (file_mutex) {
                { const std::lock_guard file(*file_mutex); }
                file_wake->notify_all();
            }
            // Not wait_for(): the thread sanitizer of GCC 12 does not see that it lets the mutex go.
            std::this_thread::sleep_for(std::chrono::microseconds(100));
            own.lock();
        }
    }
    void let_go() {
        const std::lock_guard own(mutex_);
        sync_takes_ms_ = 0;
        syncing_ = false;
        changed_.notify_all();
    }

    void set_sync_takes(int64_t ms) {
        const std::lock_guard own(mutex_);
        sync_takes_ms_ = ms;
    }
    void set_error(int error) {
        const std::lock_guard own(mutex_);
        error_ = error;
    }
    uint64_t syncs() {
        const std::lock_guard own(mutex_);
        return syncs_;
    }
    size_t records_on_disk() {
        const std::lock_guard own(mutex_);
        return read_records(on_disk_).payloads.size();
    }

private:
    const std::string path_;
    std::atomic<int64_t> now_ms_ = 0;
    std::mutex mutex_;
    std::condition_variable changed_;
    std::mutex* file_mutex_ = nullptr;
    std::condition_variable* file_wake_ = nullptr;
    uint64_t waits_ = 0, syncs_ = 0;
    bool rests_ = false, syncing_ = false;
    int64_t sync_takes_ms_ = 0, sync_ends_ms_ = 0;
    int error_ = 0;
    std::string on_disk_;
};

class GroupCommit : public testing::Test {
protected:
    ~GroupCommit() override { clock_.let_go(); }
    void SetUp() override {
        std::string before;
        auto file = RecordFile::open(path_, before, &clock_);
        ASSERT_TRUE(file) << file.error().message;
        file_.emplace(std::move(*file));
        ASSERT_TRUE(file_->restart({1, 2}));
        clock_.settle();
    }
    void TearDown() override { clock_.let_go(); }
    void append() {
        ASSERT_TRUE(file_->append("a command"));
        acknowledged_ms_.push_back(clock_.now_ms());
    }
    // Of the records that a power cut now would lose, how old the oldest is.
    int64_t oldest_unsynced_ms() {
        const size_t n = clock_.records_on_disk();
        return n < acknowledged_ms_.size() ? clock_.now_ms() - acknowledged_ms_[n] : 0;
    }

    const TempFolder folder_;
    const std::string path_ = (folder_ / "a.journal").string();
    TestClock clock_{path_};
    std::optional<RecordFile> file_;
    std::vector<int64_t> acknowledged_ms_;
};

TEST_F(GroupCommit, APowerCutAtAnyMillisecondLosesNothingOlderThanATenthOfASecond) {
    for (const int64_t takes : {0, 1, 10, 49, 50}) {
        clock_.set_sync_takes(takes);
        std::mt19937 random(uint32_t(takes) + 1);
        for (int ms = 0; ms < 1600; ++ms) {
            const bool crowded = ms / 400 % 2 == 0;  // else: alone, often in the middle of a sync
            if (random() % (crowded ? 2 : 60) == 0) append();
            clock_.step();
            ASSERT_LE(oldest_unsynced_ms(), 100) << "at " << ms << " ms, a sync takes " << takes;
        }
    }
}

TEST_F(GroupCommit, WhatComesTogetherSharesOneSync) {
    for (int ms = 0; ms < 60; ++ms) clock_.step();  // the header
    const uint64_t before = clock_.syncs();
    for (int i = 0; i < 5000; ++i) append();
    EXPECT_EQ(clock_.syncs(), before);
    for (int ms = 0; ms < 200; ++ms) clock_.step();
    EXPECT_EQ(clock_.syncs(), before + 1);
    EXPECT_EQ(clock_.records_on_disk(), 5000u);

    for (int ms = 0; ms < 1000; ++ms) {  // without a pause
        append();
        clock_.step();
    }
    EXPECT_LE(clock_.syncs(), before + 1 + 1000 / kGroupCommit.count());
}

TEST_F(GroupCommit, FlushSyncsAtOnceAndNoSyncFollows) {
    for (int ms = 0; ms < 60; ++ms) clock_.step();
    append();
    const uint64_t before = clock_.syncs();
    ASSERT_TRUE(file_->flush());
    EXPECT_EQ(clock_.records_on_disk(), 1u);
    for (int ms = 0; ms < 200; ++ms) clock_.step();
    EXPECT_EQ(clock_.syncs(), before + 1);
}

TEST_F(GroupCommit, ClosingSyncsWhatIsLeft) {
    for (int ms = 0; ms < 60; ++ms) clock_.step();
    append();
    EXPECT_EQ(clock_.records_on_disk(), 0u);
    file_.reset();
    EXPECT_EQ(clock_.records_on_disk(), 1u);
}

TEST_F(GroupCommit, AfterASyncThatFailedNothingIsAcknowledged) {
    append();
    clock_.set_error(EIO);
    for (int ms = 0; ms < 60; ++ms) clock_.step();
    EXPECT_FALSE(file_->append("never acknowledged"));
    EXPECT_FALSE(file_->flush());
}

}  // namespace
}  // namespace kiln
