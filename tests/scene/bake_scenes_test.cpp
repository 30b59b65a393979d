// SPDX-License-Identifier: MIT
// The GPU's bake is the CPU's on every texel of every bundled scene, both ways into the atlas.

#include "render/bake_compare.h"
#include "render/gpu_worlds.h"

#include <kiln/world.h>

namespace kiln::render {
namespace {

struct BakeScenesSlowGpu : GpuTest, testing::WithParamInterface<Baker> {};
INSTANTIATE_TEST_SUITE_P(Ways, BakeScenesSlowGpu, testing::Values(Baker::Storage, Baker::Copy),
                         [](const auto& p) { return std::string(p.param == Baker::Storage ? "Storage" : "Copy"); });

TEST_P(BakeScenesSlowGpu, EveryTexelOfEverySceneIsTheCpusOwn) {
    for (const auto& [name, what] : bundled_scenes()) {
        const auto world = World::load(name);
        ASSERT_TRUE(world) << world.error().message;
        if (world->field_settings.levels > 1) continue;  // levels are the CPU's bake
        const auto frame = world->frame();
        ASSERT_TRUE(frame) << frame.error().message;
        GpuField gpu(*runner_);
        rhi::must(gpu.update(frame->field, GetParam()));
        EXPECT_EQ(gpu.bricks_baked(), frame->field->stats().bricks) << name;
        expect_same_texels(gpu, *frame->field, std::string(name));
    }
}

}  // namespace
}  // namespace kiln::render
