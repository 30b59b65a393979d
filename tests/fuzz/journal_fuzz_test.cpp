// SPDX-License-Identifier: MIT
// Broken journals: whatever bytes come, what is good of them is found, and each command is one or has an error with a place.

#include "feed.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>

namespace kiln::scene {
namespace {

void feed(const std::string& bytes) { ASSERT_EQ(journal_complaint(bytes), ""); }

std::vector<std::string> seeds() {
    std::vector<std::string> out;
    for (const auto& entry : std::filesystem::directory_iterator(KILN_SOURCE_DIR "/tests/fuzz/seeds/journal")) {
        std::ifstream in(entry.path(), std::ios::binary);
        out.emplace_back(std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>());
    }
    return out;
}

TEST(JournalFuzz, SeedsThemselvesAreRight) {
    ASSERT_FALSE(seeds().empty());
    for (const std::string& seed : seeds()) {
        const Records records = read_records(seed);
        EXPECT_EQ(records.fault, "");
        EXPECT_GE(records.payloads.size(), 10u);
        feed(seed);
    }
}

TEST(JournalFuzz, EveryTruncationAndFlippedBit) {
    const std::string seed = seeds().front();
    for (size_t n = 0; n < seed.size(); ++n) feed(seed.substr(0, n));
    for (size_t at = 0; at < seed.size(); ++at) {
        std::string broken = seed;
        broken[at] = char(uint8_t(broken[at]) ^ uint8_t(1u << (at % 8)));
        feed(broken);
    }
}

// With checksums made right again, so that the commands themselves are fed.
TEST(JournalFuzz, PayloadsThrownAbout) {
    std::mt19937 random(5);
    const std::string seed = seeds().front();  // the records look into it
    const Records good = read_records(seed);
    const char* const tokens[] = {"{",    "}",  "[",    "]",       ",",      ":",          "\"",
                                  "null", "-1", "1e38", "\"add\"", "\"id\"", "\"before\"", "{}"};
    for (int round = 0; round < 2000; ++round) {
        std::string payload(good.payloads[random() % good.payloads.size()]);
        for (unsigned k = 0; k <= random() % 3; ++k) {
            const size_t at = random() % (payload.size() + 1), size = random() % 8;
            payload.replace(at, std::min(size, payload.size() - at), tokens[random() % std::size(tokens)]);
        }
        ASSERT_EQ(payload_complaint(payload), "") << payload;
    }
}

}  // namespace
}  // namespace kiln::scene
