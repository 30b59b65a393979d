// SPDX-License-Identifier: MIT
// Broken height images: whatever bytes come, the reader answers with a grid in [0, 1] or with an error that names the file.

#include "feed.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <vector>

namespace kiln::scene {
namespace {

using Bytes = std::vector<uint8_t>;

void feed(const Bytes& bytes) { ASSERT_EQ(heights_complaint(bytes), ""); }

// 1, 8 and 16 bits, grey, colours, palette.
std::vector<Bytes> seeds() {
    std::vector<Bytes> out;
    for (const auto& entry : std::filesystem::directory_iterator(KILN_SOURCE_DIR "/tests/fuzz/seeds/heights")) {
        std::ifstream file(entry.path(), std::ios::binary);
        out.emplace_back(std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>());
    }
    return out;
}

TEST(HeightsFuzz, EveryTruncationAndBitFlip) {
    const std::vector<Bytes> all = seeds();
    ASSERT_EQ(all.size(), 6u);
    for (const Bytes& seed : all) {
        feed(seed);
        for (size_t n = 0; n < seed.size(); ++n) feed({seed.begin(), seed.begin() + long(n)});
        for (size_t at = 0; at < seed.size(); ++at) {
            for (int bit = 0; bit < 8; ++bit) {
                Bytes bytes = seed;
                bytes[at] = uint8_t(bytes[at] ^ (1u << bit));
                feed(bytes);
            }
        }
    }
}

}  // namespace
}  // namespace kiln::scene
