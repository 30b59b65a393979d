// SPDX-License-Identifier: MIT
// Gates G4 and G5: what culling of clusters and ends of rays leave out is never seen. The twin draws everything.
#include "drawables.h"
#include "gpu_worlds.h"
#include "render/passes/depth_pyramid.gpu.h"
#include "render/passes/passes.h"
#include "shaders/pyramid_of_hash.spv.h"

#include <bit>
#include <cmath>

namespace kiln::render {
namespace {

const Kernel kPyramidOfHash{"pyramid of hash", kPyramidOfHashSpv};

struct PyramidGpu : GpuTest {
    static float source(int x, int y) {
        uint32_t word = (uint32_t(x) * 0x9e3779b1u) ^ (uint32_t(y) * 0x85ebca77u);
        word = (word ^ (word >> 15)) * 0x2c1b3c6du;
        return float(word >> 8);
    }
    static Readback record(Graph& g, int width, int height) {
        DepthPyramidPush push{.width = width, .height = height, .from = 0, .levels = pyramid_levels(width, height)};
        Buffer out = g.create_buffer("pyramid", 4 * uint64_t(pyramid_first(width, height, push.levels + 1)));
        const auto groups = [](int w, int h) { return Groups{uint32_t(w + 63) / 64, uint32_t(h + 63) / 64, 1}; };
        g.dispatch(kPyramidOfHash, groups(width, height), {g.write(out)}, push);
        for (push.from = kPyramidAtOnce; push.from < push.levels; push.from += kPyramidAtOnce)
            g.dispatch(kDepthPyramidRest, groups(pyramid_side(width, push.from), pyramid_side(height, push.from)),
                       {g.read_write(out)}, push);
        return g.readback(out);
    }
    static void check(const std::vector<float>& pyramid, int width, int height) {
        size_t at = 0;
        for (int level = 1; level <= pyramid_levels(width, height); ++level) {
            const int side = 1 << level;
            for (int y = 0; y < height; y += side) {
                for (int x = 0; x < width; x += side, ++at) {
                    float least = INFINITY;
                    for (int v = y; v < std::min(y + side, height); ++v)
                        for (int u = x; u < std::min(x + side, width); ++u) least = std::min(least, source(u, v));
                    ASSERT_LT(at, pyramid.size());
                    ASSERT_EQ(pyramid[at], least)
                        << width << " x " << height << ", level " << level << " at " << x << ", " << y;
                }
            }
        }
        EXPECT_EQ(at, pyramid.size()) << width << " x " << height;
        EXPECT_EQ(pyramid_side(width, pyramid_levels(width, height)), 1);
    }
};

TEST_F(PyramidGpu, EachLevelHasTheLeastOfItsPixelsAtEverySize) {
    std::vector<std::pair<int, int>> sizes{{4099, 3}, {2, 4097}, {8200, 1}};
    for (int n = 1; n <= 257; ++n) sizes.emplace_back(n, n % 3 == 0 ? n : (n * 89) % 257 + 1);
    for (size_t first = 0; first < sizes.size(); first += 65) {
        Graph g(*runner_);
        std::vector<Readback> found;
        const size_t last = std::min(first + 65, sizes.size());
        for (size_t i = first; i < last; ++i) found.push_back(record(g, sizes[i].first, sizes[i].second));
        rhi::must(runner_->execute(g));
        for (size_t i = first; i < last; ++i)
            check(rhi::must(found[i - first].get_as<float>()), sizes[i].first, sizes[i].second);
    }
}

// A wall and a hole in it of the field, balls behind and before, sheets of triangles that move, two balls at one place.
struct Stage {
    Stage() {
        using namespace field::worlds;
        world.name = "stage";
        world.edits = {edit(Box{.half_extents = {1.2f, 0.8f, 0.15f}}, {0, 0, 0})};
        world.options.voxel_size = 0.08f;
        world.options.bounds = Box3{{-1.8f, -1.4f, -1.8f}, {1.8f, 1.4f, 1.8f}};
        frame = frame_of(world);
        for (int i = 0; i < 8; ++i)
            balls.push_back(meshes::sphere(0.22f + 0.02f * float(i % 3), 48,
                                           meshes::matte({0.1f + 0.1f * float(i), 0.9f - 0.1f * float(i), 0.3f})));
        model::Surface both = meshes::matte({0.9f, 0.9f, 0.1f});
        both.double_sided = true;
        curtain = meshes::sheet(-0.9f, -0.7f, 0.9f, 0.7f, both);
    }
    // Frame i of a path with a cut every 17 frames.
    const Frame& at(int i) {
        frame.meshes.clear();
        const double turn = 0.11 * i + (i / 17) * 2.1;
        const float far = i % 5 == 4 ? 1.2f : 3.4f;  // into the scene, too
        frame.camera.position = {far * float(std::sin(turn)), 0.5f + 0.3f * float(std::sin(0.3 * i)),
                                 far * float(std::cos(turn))};
        frame.camera.target = {0, 0, 0};
        for (size_t k = 0; k < balls.size(); ++k) {
            const float x = -1.0f + 0.3f * float(k), z = k % 2 == 0 ? -0.9f : 0.9f;
            frame.meshes.push_back(meshes::at(balls[k], {x, 0.2f * float(std::sin(0.4 * i + double(k))), z}));
        }
        frame.meshes.push_back(meshes::at(balls[7], {0.5f, -0.2f, 0.12f}));  // half in the wall
        frame.meshes.push_back(meshes::at(balls[1], {-0.6f, 0.3f, -0.02f}));
        frame.meshes.push_back(meshes::at(balls[2], {0.3f, 0.6f, -0.9f}));
        frame.meshes.push_back(meshes::at(balls[5], {0.3f, 0.6f, -0.9f}));  // another colour
        const float half = float(0.7 + 0.05 * i), s = std::sin(half), c = std::cos(half);
        frame.meshes.push_back(meshes::at(curtain, {0.8f * std::sin(0.2f * float(i)), 0, 1.3f}, {s, 0, 0, c}));
        return frame;
    }
    field::worlds::World world;
    Frame frame;
    std::vector<std::shared_ptr<const model::Drawable>> balls;
    std::shared_ptr<const model::Drawable> curtain;
};

struct Walk {
    int missing = 0, frames = 0;
    uint64_t clusters = 0, drawn = 0, late = 0, evaluations = 0, evaluations_of_all = 0;
};

// The path with and without, by a renderer each, pixel by pixel.
Walk walk(Renderer& fast, Renderer& slow, int frames, Tier tier = Tier::Compute) {
    Stage stage;
    Walk out;
    for (int i = 0; i < frames; ++i, ++out.frames) {
        const Frame& frame = stage.at(i);
        const RenderSettings settings{.width = 67, .height = 49, .view = View::Albedo, .tier = tier};
        RenderSettings all = settings;
        all.cull_meshes = false;
        const Picture a = rhi::must(fast.render(frame, settings)), b = rhi::must(slow.render(frame, all));
        for (size_t p = 0; p < a.depth.size(); ++p) {
            bool same = std::bit_cast<uint32_t>(a.depth[p]) == std::bit_cast<uint32_t>(b.depth[p]);
            for (size_t c = 0; c < 4; ++c) same = same && a.rgba[4 * p + c] == b.rgba[4 * p + c];
            out.missing += !same;
        }
        out.clusters += fast.stats().clusters;
        out.drawn += fast.stats().clusters_early + fast.stats().clusters_late;
        out.late += fast.stats().clusters_late;
        out.evaluations += fast.stats().evaluations;
        out.evaluations_of_all += slow.stats().evaluations;
        EXPECT_LE(fast.stats().triangles_drawn, slow.stats().triangles_drawn);
    }
    return out;
}

struct MeshCullGpu : testing::Test {
    void SetUp() override {
        fast = renderer_or_skip();
        slow = renderer_or_skip();
        if (!fast && !HasFailure()) GTEST_SKIP() << "no Vulkan device";
    }
    std::unique_ptr<Renderer> fast, slow;
};
struct MeshCullSlowGpu : MeshCullGpu {};

TEST_F(MeshCullGpu, NothingSeenIsLeftOutWhereCamerasJumpAndThingsMove) {
    const Walk w = walk(*fast, *slow, 40);
    EXPECT_EQ(w.missing, 0);
    EXPECT_LT(double(w.drawn), 0.85 * double(w.clusters)) << "of clusters in sight";
    EXPECT_GT(w.late, 0u);
    EXPECT_LT(w.evaluations, w.evaluations_of_all);
    RecordProperty("drawn", std::to_string(double(w.drawn) / double(w.clusters)));
    RecordProperty("evaluations", std::to_string(double(w.evaluations) / double(w.evaluations_of_all)));
}

TEST_F(MeshCullSlowGpu, NothingSeenIsLeftOutInSixHundredFrames) {
    const Walk w = walk(*fast, *slow, 600);
    EXPECT_EQ(w.missing, 0);
    EXPECT_LT(double(w.drawn), 0.85 * double(w.clusters));
    RecordProperty("drawn", std::to_string(double(w.drawn) / double(w.clusters)));
}

// With a mesh shader the device packs the same list.
TEST_F(MeshCullGpu, TheTierOfMeshShadersLeavesOutTheSame) {
    Stage stage;
    const auto one = fast->render(stage.at(0), {.width = 64, .height = 48, .tier = Tier::Mesh});
    if (!one) {
        EXPECT_EQ(one.error().kind, ErrorKind::NoDevice);
        return;
    }
    const Walk w = walk(*fast, *slow, 24, Tier::Mesh);
    EXPECT_EQ(w.missing, 0);
    EXPECT_LT(double(w.drawn), 0.85 * double(w.clusters));
}

// Gates G24 and G25: shaded frames over time have the same bits in two runs, and only the first makes pipelines.
TEST_F(MeshCullGpu, FramesHaveTheSameBitsInTwoRunsAndMakeNoPipelineLate) {
    Stage stage;
    uint64_t made = 0;
    for (int i = 0; i < 4; ++i) {
        const Frame& frame = stage.at(3 * i);
        const RenderSettings settings{.width = 40, .height = 30, .taa = true};
        const Picture a = rhi::must(fast->render(frame, settings)), b = rhi::must(slow->render(frame, settings));
        EXPECT_EQ(a.rgba, b.rgba) << i;
        EXPECT_EQ(a.srgb, b.srgb) << i;
        EXPECT_EQ(a.depth, b.depth) << i;
        EXPECT_TRUE(i == 0 || fast->stats().pipelines_created == made) << i;
        made = fast->stats().pipelines_created;
    }
    EXPECT_GT(made, 10u);
}

// What is wholly behind the field is not given to the rasteriser once that was noticed, and comes back when the view does.
TEST_F(MeshCullGpu, WhatTheFieldHidesIsDrawnNoMore) {
    Stage stage;
    Frame frame = stage.at(0);
    frame.meshes = {meshes::at(stage.balls[0], {0, 0, -0.9f})};
    frame.camera.position = {0, 0, 3};
    const RenderSettings settings{.width = 64, .height = 48, .view = View::Depth};
    rhi::must(fast->render(frame, settings));
    rhi::must(fast->render(frame, settings));
    EXPECT_GT(fast->stats().clusters, 10u);
    EXPECT_EQ(fast->stats().clusters_early + fast->stats().clusters_late, 0u);
    EXPECT_EQ(fast->stats().triangles_drawn, 0u);
    frame.camera.position = {0, 0, -3};
    rhi::must(fast->render(frame, settings));
    EXPECT_EQ(fast->stats().clusters_early, 0u);
    EXPECT_GT(fast->stats().clusters_late, 5u);
}

// Rays end behind the triangles that are drawn before the march, and no pixel changes.
TEST_F(MeshCullGpu, RaysEndBehindTriangles) {
    Stage stage;
    Frame frame = stage.at(0);
    frame.meshes = {meshes::at(stage.curtain, {0, 0, 1.2f}, {0.70710678f, 0, 0, 0.70710678f})};
    frame.camera.position = {0.4f, 0.3f, 3};
    RenderSettings settings{.width = 64, .height = 48, .view = View::Normal};
    const Picture with = rhi::must(fast->render(frame, settings));
    const uint64_t ended = fast->stats().evaluations;
    settings.cull_meshes = false;
    const Picture without = rhi::must(fast->render(frame, settings));
    EXPECT_EQ(with.depth, without.depth);
    EXPECT_EQ(with.rgba, without.rgba);
    EXPECT_LT(2 * ended, fast->stats().evaluations);
    EXPECT_GT(ended, 0u);
}

}  // namespace
}  // namespace kiln::render
