// SPDX-License-Identifier: MIT
// Outlines of meshes: the same width from every distance, round what is seen alone; and by larger hulls, for comparison.
#include "drawables.h"
#include "gpu_worlds.h"
#include "render/lib/color.gpu.h"

#include <cmath>

namespace kiln::render {
namespace {

constexpr int kMeshesWidth = 96, kMeshesHeight = 72;

struct OutlineMeshesGpu : testing::Test {
    void SetUp() override {
        renderer = renderer_or_skip();
        if (!renderer && !HasFailure()) GTEST_SKIP() << "no Vulkan device";
        field::worlds::World world{"wall",
                                   {field::worlds::edit(Box{{0.5f, 3, 0.1f}}, {1.0f, 0, 1.2f})},
                                   {.voxel_size = 0.05f, .bounds = {{0.4f, -3.2f, 1}, {1.6f, 3.2f, 1.4f}}}};
        frame.field = world.field();
        frame.materials.resize(1);
        frame.materials[0].base_color = {0, 0, 0};
        frame.environment = Environment{.color = {0, 0, 0}};
        frame.camera.tone_map = ToneMap::None;
    }
    // Red of each pixel.
    std::vector<float> drawn(bool hulls) {
        const Picture p = rhi::must(
            renderer->render(frame, {.width = kMeshesWidth, .height = kMeshesHeight, .outline_hulls = hulls}));
        std::vector<float> out;
        for (size_t i = 0; i < p.srgb.size(); i += 4) out.push_back(shade::linear_from_srgb(float(p.srgb[i]) / 255));
        return out;
    }
    std::unique_ptr<Renderer> renderer;
    Frame frame;
};

TEST_F(OutlineMeshesGpu, AreAsWideFromEveryDistanceAndNotBehindThings) {
    const auto ball = meshes::sphere(0.25f, 96, meshes::matte({0, 0, 0}));
    for (const float distance : {1.0f, 2.0f, 10.0f, 50.0f}) {
        frame.camera.position = {0, 0, distance};
        frame.camera.target = {0, 0, 0};
        MeshInstance mesh = meshes::at(ball);
        // As large on the screen from everywhere.
        mesh.transform.scale = mesh.before.scale = {distance, distance, distance};
        mesh.outline = Outline{.color = {1, 0, 0}, .width_px = 5};
        frame.meshes = {mesh};
        const std::vector<float> line = drawn(false);
        float left = 0, above = 0;
        for (int x = 0; x < kMeshesWidth / 2; ++x) left += line[size_t(kMeshesHeight / 2 * kMeshesWidth + x)];
        for (int y = 0; y < kMeshesHeight / 2; ++y) above += line[size_t(y * kMeshesWidth + kMeshesWidth / 2)];
        EXPECT_NEAR(left, 5, 0.5f) << distance;
        EXPECT_NEAR(above, 5, 0.5f) << distance;
        EXPECT_EQ(line[size_t(kMeshesHeight / 2 * kMeshesWidth + kMeshesWidth / 2)], 0.0f) << "inside";
    }
    // The wall hides its right side: the line goes round what is left of it.
    frame.camera.position = {0, 0, 4};
    MeshInstance mesh = meshes::at(meshes::sphere(1, 96, meshes::matte({0, 0, 0})));
    mesh.outline = Outline{.color = {1, 0, 0}, .width_px = 3};
    frame.meshes = {mesh};
    const std::vector<float> line = drawn(false);
    float right = 0;
    int last = 0;
    for (int x = kMeshesWidth / 2; x < kMeshesWidth; ++x) {
        right += line[size_t(kMeshesHeight / 2 * kMeshesWidth + x)];
        if (line[size_t(kMeshesHeight / 2 * kMeshesWidth + x)] > 0.5f) last = x;
    }
    EXPECT_NEAR(right, 3, 0.5f);
    EXPECT_LT(last, kMeshesWidth / 2 + 20) << "at the wall's edge";
}

TEST_F(OutlineMeshesGpu, OfHullsGrowThinWithDistanceAndAreDrawnOutsideAlone) {
    const auto ball = meshes::sphere(0.4f, 96, meshes::matte({0, 0, 0}));
    float before = 1e9f;
    for (const float distance : {0.9f, 1.4f, 2.2f}) {
        frame.camera.position = {0, 0, distance};
        MeshInstance mesh = meshes::at(ball, {-0.1f, 0, 0});
        mesh.outline = Outline{.color = {1, 0, 0}, .width_px = 5};
        frame.meshes = {mesh};
        const std::vector<float> line = drawn(true);
        float covered = 0;
        for (const float share : line) covered += share;
        EXPECT_GT(covered, 1) << distance;
        EXPECT_LT(covered, before) << distance;
        EXPECT_EQ(line[size_t(kMeshesHeight / 2 * kMeshesWidth + kMeshesWidth / 2 - 8)], 0.0f) << "inside";
        before = covered;
    }
}

}  // namespace
}  // namespace kiln::render
