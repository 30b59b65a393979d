// SPDX-License-Identifier: MIT
// Shaders that change while the program runs, in a copy of the sources.
#include "gpu_worlds.h"
#include "render/live_shaders.h"
#include "render/passes/passes.h"
#include "temp_folder.h"

#include <cstdlib>
#include <fstream>
#include <sstream>

namespace kiln::render {
namespace {

std::string text_of(const std::filesystem::path& path) {
    std::ifstream in(path);
    std::stringstream out;
    out << in.rdbuf();
    return out.str();
}

struct LiveShadersGpu : GpuTest {
    void SetUp() override {
        GpuTest::SetUp();
        if (!device_) return;
        const std::filesystem::path src = std::filesystem::path(KILN_SOURCE_DIR) / "src";
        for (const auto& entry : std::filesystem::recursive_directory_iterator(src)) {
            if (!entry.is_regular_file()) continue;
            const auto to = root() / std::filesystem::relative(entry.path(), src);
            std::filesystem::create_directories(to.parent_path());
            std::filesystem::copy_file(entry.path(), to);
        }
        live = rhi::must(LiveShaders::watch({root().string(), std::string(KILN_BINARY_DIR) + "/generated"}));
    }
    std::filesystem::path root() const { return folder.path() / "it's a copy"; }
    void change(const std::string& file, std::string_view from, std::string_view to) {
        std::string text = text_of(root() / file);
        const size_t at = text.find(from);
        ASSERT_NE(at, std::string::npos) << file << " has no " << from;
        text.replace(at, from.size(), to);
        std::ofstream(root() / "changed") << text;
        std::filesystem::rename(root() / "changed", root() / file);  // never half of it
    }
    // A grey picture through the tone map, on its way.
    Readback draw() {
        Graph g(*runner_);
        Image radiance = g.create("radiance", {.size = {16, 8}, .format = rhi::Format::Rgba16Float});
        g.clear(radiance, {0.5f, 0.25f, 0.125f, 1});
        const float one[4] = {1, 0, 0, 0};
        const Buffer exposure = g.upload("exposure", std::span<const float>(one));
        const Readback back = g.readback(tonemap(g, radiance, radiance, exposure, {.tone_map = ToneMap::None}));
        rhi::must(runner_->execute(g));
        return back;
    }
    std::vector<uint8_t> shown() { return rhi::must(draw().get_as<uint8_t>()); }
    std::vector<std::string> looked() {
        live->finish();
        return live->apply(runner_->pipelines());
    }
    TempFolder folder;
    std::unique_ptr<LiveShaders> live;
};

TEST_F(LiveShadersGpu, AChangedShaderIsSeenInTheNextPictureAndABrokenOneIsNot) {
    const auto before = shown();
    EXPECT_TRUE(looked().empty());
    EXPECT_EQ(live->swapped(), 0u);
    EXPECT_EQ(shown(), before);

    change("render/passes/tonemap.comp", "c * exposure.multiplier", "c.bgr * exposure.multiplier");
    EXPECT_TRUE(looked().empty());
    EXPECT_EQ(live->swapped(), 1u);
    const auto turned = shown();
    ASSERT_EQ(turned.size(), before.size());
    EXPECT_EQ(turned[0], before[2]);
    EXPECT_EQ(turned[2], before[0]);

    change("render/passes/tonemap.comp", "c.bgr * exposure.multiplier", "c.bgr * no_such_thing");
    const auto errors = looked();
    ASSERT_EQ(errors.size(), 1u);
    EXPECT_NE(errors[0].find("tonemap.comp:"), std::string::npos) << errors[0];
    EXPECT_NE(errors[0].find("no_such_thing"), std::string::npos) << errors[0];
    EXPECT_EQ(live->swapped(), 1u);
    EXPECT_EQ(shown(), turned);
    EXPECT_TRUE(looked().empty()) << "an error is told once";

    change("render/passes/tonemap.comp", "c.bgr * no_such_thing", "c * exposure.multiplier");
    EXPECT_TRUE(looked().empty());
    EXPECT_EQ(shown(), before);
}

// Frames are in flight when the pipeline is made anew. What validation says of any of them fails the test as it ends.
TEST_F(LiveShadersGpu, AReloadAmongSixtyFramesChangesThoseBehindItAndLeavesNothing) {
    std::vector<Readback> frames;
    size_t settled = 0;
    for (int frame = 0; frame < 60; ++frame) {
        if (frame == 29) settled = device_->live_handle_count();
        if (frame == 30) {
            change("render/passes/tonemap.comp", "c * exposure.multiplier", "c.bgr * exposure.multiplier");
            live->finish();
        }
        EXPECT_TRUE(live->apply(runner_->pipelines()).empty()) << frame;
        frames.push_back(draw());
        if (frame < 2) continue;
        const auto seen = rhi::must(frames[0].get_as<uint8_t>());
        EXPECT_EQ(seen[0] < seen[2], frame - 2 >= 30) << "frame " << frame - 2;
        frames.erase(frames.begin());
    }
    EXPECT_EQ(live->swapped(), 1u);
    EXPECT_EQ(device_->live_handle_count(), settled) << device_->live_handles();
}

TEST_F(LiveShadersGpu, WhatAShaderIncludesCountsAsItsOwn) {
    const auto before = shown();
    change("render/lib/tonemap.gpu.h", "#ifdef __cplusplus", "#error broken here\n#ifdef __cplusplus");
    auto errors = looked();
    ASSERT_EQ(errors.size(), 1u) << "one for all that include it";
    EXPECT_NE(errors[0].find("tonemap.gpu.h:"), std::string::npos) << errors[0];
    EXPECT_EQ(shown(), before);
}

TEST_F(LiveShadersGpu, AShaderThatBindsAnythingElseIsRefusedWithAReason) {
    const auto before = shown();
    change("render/passes/tonemap.comp", "void main() {",
           "layout(set = 0, binding = 9, std430) buffer More { float more[]; };\nvoid main() {\n    more[0] = 1.0;");
    const auto errors = looked();
    ASSERT_EQ(errors.size(), 1u);
    EXPECT_NE(errors[0].find("tonemap.comp"), std::string::npos) << errors[0];
    EXPECT_NE(errors[0].find("needs a new build"), std::string::npos) << errors[0];
    EXPECT_EQ(shown(), before);
}

TEST(LiveShaders, SourcesThatAreNotThereAreSaidSo) {
    const TempFolder empty;
    const auto live = LiveShaders::watch({empty.path().string()});
    ASSERT_FALSE(live);
    EXPECT_EQ(live.error().kind, ErrorKind::Usage);
    EXPECT_NE(live.error().message.find("an installed program has no shader sources"), std::string::npos)
        << live.error().message;
}

}  // namespace
}  // namespace kiln::render
