// SPDX-License-Identifier: MIT
// Broken scenes: whatever bytes come, the reader answers with a world or with an error that has a place. Never a crash.

#include "feed.h"
#include "scene/bundled.h"

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <random>

namespace kiln::scene {
namespace {

void feed(const std::string& text) { ASSERT_EQ(scene_complaint(text), "") << text.substr(0, 2000); }

// Small scenes that hold every section and many kinds of values, and the bundled ones.
std::vector<std::string> seeds() {
    std::ifstream small(KILN_SOURCE_DIR "/tests/fuzz/seeds/scene/every_section.json");
    std::vector<std::string> out{std::string(std::istreambuf_iterator<char>(small), {})};
    for (const BundledScene& scene : bundled_files())
        if (scene.json.size() < 50000) out.emplace_back(scene.json);
    return out;
}

TEST(SceneFuzz, SeedsThemselvesAreRight) {
    for (const std::string& seed : seeds())
        ASSERT_TRUE(read_scene(seed, "f.json")) << read_scene(seed, "f.json").error().message;
}

TEST(SceneFuzz, EveryTruncation) {
    const std::string seed = seeds().front();
    for (size_t n = 0; n < seed.size(); ++n) feed(seed.substr(0, n));
}

TEST(SceneFuzz, EveryBitFlipOfASmallScene) {
    const std::string seed = seeds().front();
    for (size_t at = 0; at < seed.size(); ++at) {
        for (int bit = 0; bit < 8; ++bit) {
            std::string text = seed;
            text[at] = char(uint8_t(text[at]) ^ uint8_t(1u << bit));
            feed(text);
        }
    }
}

TEST(SceneFuzz, TokensThrownAbout) {
    std::mt19937 random(7);
    const std::vector<std::string> all = seeds();
    const char* const tokens[] = {"{",    "}",  "[",          "]",    ",",     ":",         "\"",       "null",
                                  "true", "-1", "0",          "1e38", "1e-45", "\"shape\"", "\"mesh\"", "\"children\"",
                                  "[]",   "{}", "\"object\"", "\"\"", "1e999", "\\u0000",   "-0.0"};
    for (int round = 0; round < 3000; ++round) {
        std::string text = all[random() % all.size()];
        for (unsigned k = 0; k <= random() % 4; ++k) {
            const size_t at = random() % (text.size() + 1), size = random() % 12;
            const std::string token = tokens[random() % std::size(tokens)];
            text.replace(at, std::min(size, text.size() - at), token);
        }
        feed(text);
    }
}

}  // namespace
}  // namespace kiln::scene
