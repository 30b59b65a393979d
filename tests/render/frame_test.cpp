// SPDX-License-Identifier: MIT
// Whole pictures, under validation: the cached path against the exact one, and against itself.
#include "field/twenty_worlds.h"
#include "gpu_worlds.h"

#include <cmath>

namespace kiln::render {
namespace {

struct FrameGpu : testing::Test {
    void SetUp() override {
        renderer = renderer_or_skip();
        if (!renderer && !HasFailure()) GTEST_SKIP() << "no Vulkan device";
    }
    Picture picture(const Frame& frame, RenderSettings settings) {
        settings.width = 96;
        settings.height = 72;
        return rhi::must(renderer->render(frame, settings));
    }
    std::unique_ptr<Renderer> renderer;
};

// Pixels within `reach` of a jump of depth or of the solid's rim.
std::vector<char> near_edges(const Picture& p, float jump, int reach) {
    std::vector<char> edge(p.depth.size());
    for (int y = 0; y < p.height; ++y) {
        for (int x = 0; x < p.width; ++x) {
            const float d = p.depth[size_t(y * p.width + x)];
            for (int j = -reach; j <= reach; ++j) {
                for (int i = -reach; i <= reach; ++i) {
                    const int u = std::clamp(x + i, 0, p.width - 1), v = std::clamp(y + j, 0, p.height - 1);
                    const float e = p.depth[size_t(v * p.width + u)];
                    if (std::isinf(d) != std::isinf(e) || std::fabs(d - e) > jump) edge[size_t(y * p.width + x)] = 1;
                }
            }
        }
    }
    return edge;
}

TEST_F(FrameGpu, BricksShowWhatTheProgramsSay) {
    for (const auto& world : {field::worlds::blends(), on_ground()}) {
        const Frame frame = frame_of(world);
        const Picture cached = picture(frame, {.view = View::Normal});
        const Picture exact = picture(frame, {.view = View::Normal, .analytic = true});
        const Picture unpruned = picture(frame, {.view = View::Normal, .analytic = true, .unpruned = true});
        const float h = world.options.voxel_size;
        // A depth jump between neighbouring pixels that slopes alone would not make.
        const std::vector<char> edge = near_edges(exact, 0.25f, 2);
        int misses = 0, off = 0, turned = 0, judged = 0, hits = 0, pruning = 0;
        for (size_t i = 0; i < exact.depth.size(); ++i) {
            const bool a = std::isfinite(cached.depth[i]), b = std::isfinite(exact.depth[i]);
            hits += b;
            if (a != b) misses += edge[i] ? 0 : 1;
            if (std::isfinite(exact.depth[i]) != std::isfinite(unpruned.depth[i])) ++pruning;
            if (b && std::isfinite(unpruned.depth[i]) && !edge[i] &&
                std::fabs(exact.depth[i] - unpruned.depth[i]) > 0.02f * h)
                ++pruning;
            if (!a || !b || edge[i]) continue;
            ++judged;
            off += std::fabs(cached.depth[i] - exact.depth[i]) > 0.25f * h;
            float apart = 0;
            for (size_t k = 0; k < 3; ++k)
                apart = std::max(apart, std::fabs(cached.rgba[i * 4 + k] - exact.rgba[i * 4 + k]));
            turned += apart > 0.15f;
        }
        EXPECT_GT(hits, 500) << world.name;
        EXPECT_GT(judged, hits / 3) << world.name;
        EXPECT_EQ(misses, 0) << world.name;
        EXPECT_EQ(off, 0) << world.name << ": depth, of " << judged;
        EXPECT_LE(turned, judged / 500) << world.name << ": normals, of " << judged;
        EXPECT_LE(pruning, hits / 500) << world.name << ": pruned and unpruned differ";
    }
}

TEST_F(FrameGpu, JumpsAndTheWayIntoTheAtlasChangeNoPixel) {
    const Frame frame = frame_of(on_ground());
    const Picture fast = picture(frame, {});
    const Picture slow = picture(frame, {.accelerate = false});
    EXPECT_EQ(fast.srgb, slow.srgb);
    EXPECT_EQ(fast.depth, slow.depth);
    const Frame small = frame_of(field::worlds::sphere_of(10));
    const Picture host = picture(small, {.view = View::Depth});
    const Picture copied = picture(small, {.view = View::Depth, .atlas_by_copy = true});
    for (size_t i = 0; i < host.depth.size(); ++i) {
        if (std::isinf(host.depth[i]) || std::isinf(copied.depth[i])) continue;
        EXPECT_NEAR(host.depth[i], copied.depth[i], 1e-3f);
    }
}

struct FrameSlowGpu : FrameGpu {};

// Gate G4 over the twenty worlds: from outside, flat over what is there, and from within a brick.
TEST_F(FrameSlowGpu, JumpsChangeNoPixelOfTwentyWorlds) {
    int seen = 0;
    for (const auto& world : field::worlds::twenty()) {
        const Box3 box = world.options.bounds;
        const vec3 middle = (box.min + box.max) * 0.5f, half = (box.max - box.min) * 0.5f;
        Frame frame = frame_of(world);
        for (const vec3 from : {vec3{1.6f, 1.2f, 2.1f}, vec3{1.4f, 0.02f, 0.3f}, vec3{0.31f, 0.13f, -0.2f}}) {
            frame.camera.position = middle + from * half;
            frame.camera.target = middle;
            const View view = from.x > 1.5f ? View::Shaded : View::Normal;
            const Picture fast = picture(frame, {.view = view});
            const Picture slow = picture(frame, {.view = view, .accelerate = false});
            EXPECT_EQ(fast.depth, slow.depth) << world.name << " from " << from.x;
            EXPECT_EQ(fast.rgba, slow.rgba) << world.name << " from " << from.x;
            for (const float d : fast.depth) seen += std::isfinite(d);
        }
    }
    EXPECT_GT(seen, 50000);
}

TEST_F(FrameGpu, SameInputSameBytesAndNoPipelineOnceWarm) {
    const Frame frame = frame_of(on_ground());
    const Picture one = picture(frame, {});
    const uint64_t warm = renderer->stats().pipelines_created;
    EXPECT_GT(warm, 0u);
    for (int i = 0; i < 2; ++i) {
        const Picture again = picture(frame, {});
        EXPECT_EQ(one.srgb, again.srgb);
        EXPECT_EQ(one.rgba, again.rgba);
        EXPECT_EQ(renderer->stats().pipelines_created, warm);
    }
    auto other = renderer_or_skip();
    ASSERT_TRUE(other);
    renderer = std::move(other);
    EXPECT_EQ(picture(frame, {}).srgb, one.srgb);
}

TEST_F(FrameGpu, ACameraInSolidSeesItAtOnceAndAnEmptyWorldIsSky) {
    field::worlds::World ball = field::worlds::sphere_of(10);
    const Frame inside = frame_of(ball, {0.02f, 0.03f, 0.1f});
    const Picture p = picture(inside, {.view = View::Normal});
    for (const float d : p.depth) ASSERT_EQ(d, 0.0f);
    field::worlds::World none{"none", {}, {.voxel_size = 0.1f, .bounds = {{-1, -1, -1}, {1, 1, 1}}}};
    Frame empty = frame_of(none);
    empty.camera.tone_map = ToneMap::None;
    empty.environment = Environment{.color = {0.25f, 0.5f, 0.125f}};
    for (const bool first : {false, true}) {
        if (first) {
            auto other = renderer_or_skip();
            ASSERT_TRUE(other);
            renderer = std::move(other);
        }
        const Picture sky = picture(empty, {});
        for (size_t i = 0; i < sky.depth.size(); ++i) {
            ASSERT_TRUE(std::isinf(sky.depth[i])) << first;
            ASSERT_NEAR(sky.rgba[i * 4 + 1], 0.5f, 1e-3f) << first;
        }
    }
}

TEST_F(FrameGpu, AWhiteBallUnderAWhiteSkyDisappears) {
    // Gate G8: every roughness, no lights; what the surface sends to the eye is what the sky does.
    for (const float roughness : {0.1f, 0.5f, 1.0f}) {
        Frame frame = frame_of(field::worlds::sphere_of(10));
        frame.materials.assign(2, Material{.base_color = {1, 1, 1}, .roughness = roughness, .metallic = 1});
        frame.lights.clear();
        frame.environment = Environment{.color = {1, 1, 1}};
        const Picture p = picture(frame, {});
        for (const float v : p.rgba) {
            if (v == 0) continue;  // alpha of misses
            ASSERT_NEAR(v, 1.0f, 0.01f) << "roughness " << roughness;
        }
    }
}

TEST_F(FrameGpu, ABadCameraIsAnErrorNotAPicture) {
    Frame frame = frame_of(field::worlds::sphere_of(4));
    frame.camera.target = frame.camera.position;
    EXPECT_EQ(renderer->render(frame, {.width = 8, .height = 8}).error().kind, ErrorKind::Usage);
    frame = frame_of(field::worlds::sphere_of(4));
    EXPECT_EQ(renderer->render(frame, {.width = 0, .height = 8}).error().kind, ErrorKind::Usage);
    frame.camera.fov_y_deg = 180;
    EXPECT_EQ(renderer->render(frame, {.width = 8, .height = 8}).error().kind, ErrorKind::Usage);
}

}  // namespace
}  // namespace kiln::render
