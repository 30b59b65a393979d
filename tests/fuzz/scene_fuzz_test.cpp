// SPDX-License-Identifier: MIT
// Broken scenes: whatever bytes come, the reader answers with a world or with an error that has a place. Never a crash.

#include "scene/bundled.h"
#include "scene/scene_file.h"

#include <gtest/gtest.h>

#include <chrono>
#include <random>

namespace kiln::scene {
namespace {

void feed(const std::string& text) {
    const auto scene = read_scene(text, "f.json");
    if (scene) {
        const std::string saved = write_scene(*scene, scene->stage);
        const auto again = read_scene(saved, "f.json");
        ASSERT_TRUE(again) << again.error().message << "\n" << saved.substr(0, 2000);
        ASSERT_EQ(write_scene(*again, again->stage), saved);
    } else {
        ASSERT_EQ(scene.error().kind, ErrorKind::Input);
        ASSERT_EQ(scene.error().message.substr(0, 7), "f.json:");
        ASSERT_EQ(scene.error().message.find('\n'), std::string::npos) << scene.error().message;
    }
}

// Small scenes that hold every section and many kinds of values, and the bundled ones.
std::vector<std::string> seeds() {
    std::vector<std::string> out{
        R"({"format":1,"$schema":"x","field":{"voxel_size":0.02,"levels":4,"bounds":{"min":[-5,-1,-5],"max":[5,4,5]}},
"materials":{"clay":{"base_color":[0.72,0.33,0.22],"roughness":0.7,"emissive":[0,0,0],"opacity":1.0}},
"objects":{"washer":{"op":"subtract","blend_radius":0.01,"children":[{"shape":"cylinder","half_height":0.05,"radius":0.4},{"object":"other","position":[0,1,0]}]},
"other":{"shape":"box","domain":[{"warp":"mirror","axis":"x"},{"warp":"repeat","spacing":[2,0,2],"count":[3,1,3]}]}},
"edits":[{"id":"ground","shape":"plane","material":"clay"},{"id":"l\u00e9","shape":"sphere","radius":0.5,"op":"paint","material":"clay","rotation":[0,0,0,1],"scale":[1,2,1]},
{"id":"f","shape":"expression","expression":"length(p)-1","lipschitz":1,"half_extents":[1,1,1]},{"shape":"expression","file":"a.vm"},
{"id":"w1","object":"washer","dynamic":true,"outline":{"color":[1,0,0],"width_px":2}}],
"meshes":[{"id":"engine","file":"engine.glb"}],"lights":[{"type":"spot","position":[0,3,0],"direction":[0,-1,0],"inner_deg":15,"outer_deg":25}],
"environment":{"color":[0.5,0.6,0.8],"file":"sky.exr"},"cameras":{"main":{"position":[3,2,4],"target":[0,0.5,0],"tone_map":"aces"}},
"physics":{"gravity":[0,-9.81,0]},"bodies":[{"id":"b","edits":["l\u00e9"],"motion":"dynamic"}],"triggers":[{"id":"goal","object":"washer"}],
"cloths":[{"id":"flag","size":[2,1],"pinned":[[0,0],[1,2]]}],"fluids":[{"id":"water","box":{"min":[0,0,0],"max":[1,1,1]}}],"wind":[0,0,0]})"};
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
