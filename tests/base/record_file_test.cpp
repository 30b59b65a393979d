// SPDX-License-Identifier: MIT
// Starts threads.
#include "base/record_file.h"
#include "temp_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>
#include <filesystem>
#include <sys/resource.h>

namespace kiln {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::HasSubstr;

class RecordFiles : public testing::Test {
protected:
    // The bytes of a file of these records.
    std::string made(const std::vector<std::string>& payloads) {
        std::string before;
        auto file = RecordFile::open(path_, before);
        EXPECT_TRUE(file) << file.error().message;
        EXPECT_TRUE(file->restart({1, 2}));
        for (const std::string& payload : payloads) EXPECT_TRUE(file->append(payload));
        return bytes_of(path_);
    }

    const TempFolder folder_;
    const std::string path_ = (folder_ / "a.journal").string();
};

const std::vector<std::string> kThree{"one", "", "three, the longest"};

TEST_F(RecordFiles, WhatWasAppendedIsThereAtOnce) {
    const std::string bytes = made(kThree);
    const Records records = read_records(bytes);
    EXPECT_TRUE(records.has_header);
    EXPECT_EQ(records.base, (Hash128{1, 2}));
    EXPECT_THAT(records.payloads, ElementsAre("one", "", "three, the longest"));
    EXPECT_EQ(records.fault, "");
    EXPECT_EQ(records.good_bytes, bytes.size());
    EXPECT_FALSE(read_records("").has_header);
    EXPECT_EQ(read_records("").fault, "");
}

TEST_F(RecordFiles, EveryTruncationReadsToTheLastWholeRecord) {
    const std::string bytes = made(kThree);
    const size_t ends[] = {32, 32 + 16 + 3, 32 + 32 + 3, bytes.size()};
    for (size_t n = 1; n < bytes.size(); ++n) {
        const Records records = read_records(std::string_view(bytes).substr(0, n));
        size_t whole = 0;
        while (whole < 3 && ends[whole + 1] <= n) ++whole;
        ASSERT_EQ(records.payloads.size(), n < 32 ? 0 : whole) << n;
        ASSERT_EQ(records.good_bytes, n < 32 ? 0 : ends[whole]) << n;
        ASSERT_EQ(records.fault.empty(), n == ends[whole]) << n << records.fault;
    }
}

TEST_F(RecordFiles, EveryFlippedBitEndsTheReadingBeforeIt) {
    const std::string bytes = made(kThree);
    const size_t ends[] = {32, 32 + 16 + 3, 32 + 32 + 3, bytes.size()};
    for (size_t at = 0; at < bytes.size(); ++at)
        for (int bit = 0; bit < 8; ++bit) {
            std::string broken = bytes;
            broken[at] = char(uint8_t(broken[at]) ^ uint8_t(1u << bit));
            const Records records = read_records(broken);
            size_t whole = 0;
            while (whole < 3 && ends[whole + 1] <= at) ++whole;
            ASSERT_EQ(records.payloads.size(), at < 32 ? 0 : whole) << at;
            ASSERT_EQ(records.has_header, at >= 32);
            ASSERT_NE(records.fault, "");
        }
}

TEST_F(RecordFiles, ARecordOfAnotherFileOrPlaceIsNone) {
    const std::string a = made({"same", "same"}), b = made({"other", "same"});
    // The same payload at the same sequence, after another record.
    const std::string spliced = a.substr(0, 32 + 20) + b.substr(32 + 21);
    EXPECT_EQ(read_records(spliced).payloads.size(), 1u);
    // Twice.
    EXPECT_EQ(read_records(a + a.substr(a.size() - 20)).payloads.size(), 2u);
}

TEST_F(RecordFiles, OneWriterAtATime) {
    std::string bytes;
    auto first = RecordFile::open(path_, bytes);
    ASSERT_TRUE(first && first->restart({}));
    EXPECT_TRUE(RecordFile::is_held(path_));
    const auto second = RecordFile::open(path_, bytes);
    ASSERT_FALSE(second);
    EXPECT_THAT(second.error().message, HasSubstr("close it there first"));
    ASSERT_TRUE(first->append("x"));
    first = Error{};
    EXPECT_FALSE(RecordFile::is_held(path_));
    auto third = RecordFile::open(path_, bytes);
    ASSERT_TRUE(third);
    EXPECT_EQ(read_records(bytes).payloads.size(), 1u);
}

TEST_F(RecordFiles, AFileWithoutRecordsIsRemovedWhenItIsClosed) {
    {
        std::string bytes;
        auto file = RecordFile::open(path_, bytes);
        ASSERT_TRUE(file && file->restart({}));
        EXPECT_TRUE(fs::exists(path_));
    }
    EXPECT_FALSE(fs::exists(path_));
}

TEST_F(RecordFiles, ResumingCutsOffWhatIsBroken) {
    std::string bytes = made(kThree);
    std::ofstream(path_, std::ios::binary | std::ios::app) << "rubbish";
    auto file = RecordFile::open(path_, bytes);
    ASSERT_TRUE(file);
    ASSERT_TRUE(file->resume(read_records(bytes)));
    EXPECT_EQ(file->next_sequence(), 4u);
    ASSERT_TRUE(file->append("four"));
    ASSERT_TRUE(file->flush());
    const std::string after = bytes_of(path_);
    EXPECT_THAT(read_records(after).payloads, ElementsAre("one", "", "three, the longest", "four"));
    EXPECT_EQ(read_records(after).fault, "");
    ASSERT_TRUE(file->restart({7, 7}));
    ASSERT_TRUE(file->append("new"));
    const std::string anew = bytes_of(path_);
    EXPECT_THAT(read_records(anew).payloads, ElementsAre("new"));
}

TEST_F(RecordFiles, AFullDiskRefusesTheRecordAndKeepsTheFile) {
    std::string bytes;
    auto file = RecordFile::open(path_, bytes);
    ASSERT_TRUE(file && file->restart({}) && file->append("first"));
    const std::string before = bytes_of(path_);
    // Files of this process may not grow beyond this: write() takes a part and then fails, as on a full disk.
    struct rlimit old {};
    ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &old), 0);
    const auto handler = std::signal(SIGXFSZ, SIG_IGN);
    const struct rlimit low { before.size() + 20, old.rlim_max };
    ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &low), 0);
    const auto refused = file->append("a record of more than four bytes");
    const std::string after = bytes_of(path_);
    ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &old), 0);
    std::signal(SIGXFSZ, handler);
    ASSERT_FALSE(refused);
    EXPECT_THAT(refused.error().message, HasSubstr(path_));
    EXPECT_EQ(refused.error().kind, ErrorKind::Failed);
    EXPECT_EQ(after, before);
    ASSERT_TRUE(file->append("second"));
    const std::string last = bytes_of(path_);
    EXPECT_THAT(read_records(last).payloads, ElementsAre("first", "second"));
}

}  // namespace
}  // namespace kiln
