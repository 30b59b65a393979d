// SPDX-License-Identifier: MIT
// Starts threads.
// Assert, format, log, hash and profile.
#include "base/assert.h"
#include "base/hash.h"
#include "base/log.h"
#include "base/profile.h"

#include <gtest/gtest.h>

#include <array>
#include <limits>
#include <thread>

using namespace kiln;

namespace {

TEST(Format, TakesEveryKindOfValue) {
    enum class Colour : uint8_t { Red, Green };
    const std::string word = "word";
    EXPECT_EQ(formatted("{} {} {} {}", -1, 2u, size_t(3), int64_t(-4)), "-1 2 3 -4");
    EXPECT_EQ(formatted("{:.2f} {} {}", 0.125, 0.1f, true), "0.12 0.1 true");
    EXPECT_EQ(formatted("{}{}{} {}", word, "c", 'x', Colour::Green), "wordcx 1");
    EXPECT_EQ(formatted("{}", std::numeric_limits<uint64_t>::max()), "18446744073709551615");
    EXPECT_EQ(formatted("{}", static_cast<const char*>(nullptr)), "(null)");
    EXPECT_EQ(one_line("two\nlines\tand\x7f\x1b ends\r\n"), "two lines and   ends");
    EXPECT_EQ(one_line(" \n"), "");
    EXPECT_EQ(formatted("{{}} {1} {0}", 1, 2), "{} 2 1");
}

TEST(Format, AWrongPatternNeverThrows) {
    EXPECT_EQ(formatted("{} {}", 1).substr(0, 5), "{} {}");
    EXPECT_NE(formatted("{:d}", "text").find("bad format"), std::string::npos);
}

TEST(AssertDeathTest, StopsWithConditionAndValues) {
    const int brick = 7, capacity = 4;
    EXPECT_DEATH(KILN_ASSERT(brick < capacity, "brick {} of {}", brick, capacity),
                 "base_test.cpp:[0-9]+: TestBody: `brick < capacity` is false: brick 7 of 4");
    EXPECT_DEATH(KILN_ASSERT(brick == capacity), "`brick == capacity` is false");
    KILN_ASSERT(brick > capacity, "{}", brick);
}

TEST(Log, LevelsBelowTheLeastAreNotShownAndNothingGoesToStdout) {
    log::set_level(log::Level::Warn);
    testing::internal::CaptureStderr();
    testing::internal::CaptureStdout();
    log::info("quiet {}", 1);
    log::warn("loud {}", 2);
    log::error("braces {{}} {}", "{}");
    EXPECT_EQ(testing::internal::GetCapturedStdout(), "");
    const std::string seen = testing::internal::GetCapturedStderr();
    EXPECT_EQ(seen.find("quiet"), std::string::npos) << seen;
    EXPECT_NE(seen.find("loud 2"), std::string::npos) << seen;
    EXPECT_NE(seen.find("braces {} {}"), std::string::npos) << seen;
}

// XXH3's published test vector for no bytes and seed 0, so that files stay readable on every machine.
TEST(Hash, IsXxh3) {
    EXPECT_EQ(hash64(std::string_view{}), 0x2d06800538d394c2u);
    EXPECT_EQ(hex(0x0123456789abcdefu), "0123456789abcdef");
    EXPECT_EQ(hash128({}).low, 0x6001c324468d497fu);
    EXPECT_EQ(hash128({}).high, 0x99aa06d3014798d8u);
}

TEST(Hash, DependsOnEveryByteAndOnTheSeed) {
    std::array<uint32_t, 33> values{};
    const uint64_t zeros = hash64_of(std::span<const uint32_t>(values));
    EXPECT_NE(hash64_of(std::span<const uint32_t>(values), 1), zeros);
    for (uint32_t& v : values) {
        v = 1;
        EXPECT_NE(hash64_of(std::span<const uint32_t>(values)), zeros);
        v = 0;
    }
    EXPECT_NE(hash_combine(hash_combine(0, 1), 2), hash_combine(hash_combine(0, 2), 1));
}

TEST(Profile, AddsUpCallsOfAllThreads) {
    profile_reset();
    const auto work = [] {
        for (int i = 0; i < 10; ++i) {
            KILN_PROFILE("profile test");
        }
    };
    std::thread a(work), b(work);
    a.join();
    b.join();
    for (const ProfileRow& row : profile_report()) {
        if (row.name == "profile test") {
            EXPECT_EQ(row.calls, 20u);
            EXPECT_GE(row.total_ms, 0.0);
            return;
        }
    }
    FAIL() << "no row for the site";
}

}  // namespace
