// SPDX-License-Identifier: MIT
// Starts threads.
// Gates of whole frames that no single pass has to itself: white furnaces, a sky at infinity, depth that is never copied.
#include "drawables.h"
#include "field/brick_set.h"
#include "gpu_worlds.h"
#include "render/lib/environment_map.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

namespace kiln::render {
namespace {

using shade::EnvironmentLight;
using shade::EnvironmentMap;

struct GatesGpu : testing::Test {
    void SetUp() override {
        renderer = renderer_or_skip();
        if (!renderer && !HasFailure()) GTEST_SKIP() << "no Vulkan device";
    }
    Picture picture(const Frame& frame, const RenderSettings& settings) {
        return rhi::must(renderer->render(frame, settings));
    }
    std::unique_ptr<Renderer> renderer;
};
struct GatesSlowGpu : GatesGpu {};

// The image of everything far away that shines so in every direction.
std::shared_ptr<const EnvironmentMap> map_of(int width, vec3 (*color)(vec3)) {
    image::FloatPixels image{.width = width, .height = width / 2, .channels = 3, .values = {}};
    for (int y = 0; y < image.height; ++y) {
        for (int x = 0; x < image.width; ++x) {
            const double turn = 2 * std::numbers::pi * ((x + 0.5) / width - 0.5),
                         fall = std::numbers::pi * (y + 0.5) / image.height;
            const vec3 c = color({float(std::sin(turn) * std::sin(fall)), float(std::cos(fall)),
                                  float(-std::cos(turn) * std::sin(fall))});
            for (const float v : {c.x, c.y, c.z}) image.values.push_back(v);
        }
    }
    return std::make_shared<const EnvironmentMap>(shade::make_environment_map(image));
}

vec3 uneven(vec3 d) { return {0.5f + 0.3f * d.x, 0.5f - 0.2f * d.y * d.z, 0.4f + 0.3f * d.z * d.x}; }

// Gate G8: white things in an image of light that is one everywhere are not seen.
TEST_F(GatesGpu, WhiteThingsUnderAWhiteImageDisappear) {
    for (const float roughness : {0.1f, 1.0f}) {
        for (const float metallic : {0.0f, 1.0f}) {
            Frame frame = frame_of(field::worlds::sphere_of(10));
            frame.materials.assign(3, Material{.base_color = {1, 1, 1}, .roughness = roughness, .metallic = metallic});
            frame.materials[2].opacity = 1e-6f;
            frame.lights.clear();
            frame.environment = Environment{.color = {1, 1, 1}};
            frame.environment_map = map_of(32, [](vec3) { return vec3{1, 1, 1}; });
            auto set =
                rhi::must(field::BrickSet::make(field::worlds::compiled({field::worlds::edit(Sphere{0.3f})}), 0.05f));
            frame.instances = {Instance{.bricks = set,
                                        .pose = {{0.9f, 0.8f, 1}, {}},
                                        .before = {{0.9f, 0.8f, 1}, {}},
                                        .material = 2,
                                        .glass = 2}};
            frame.meshes = {
                meshes::at(meshes::sphere(0.3f, 16, meshes::matte({1, 1, 1}, roughness)), {-0.9f, 0.9f, 0.6f})};
            const Picture p = picture(frame, {.width = 40, .height = 30});
            float worst = 0;
            for (size_t i = 0; i < p.rgba.size(); ++i)
                if (i % 4 != 3) worst = std::max(worst, std::fabs(p.rgba[i] - 1));
            EXPECT_LE(worst, 0.01f) << "roughness " << roughness << ", metallic " << metallic;
        }
    }
}

// … nor under as many suns as make the same light: a ball of any roughness that suns so far apart do not show in.
TEST_F(GatesGpu, AWhiteBallUnderSunsFromAllAroundIsWhite) {
    constexpr int kSuns = 512;
    Frame frame = frame_of(field::worlds::sphere_of(10));
    frame.environment = Environment{.color = {0, 0, 0}};
    frame.lights.clear();
    for (int i = 0; i < kSuns; ++i) {  // Fibonacci's spiral: each has as much of the sphere
        const double y = 1 - (2 * i + 1.0) / kSuns, turn = 2.39996322972865 * i, r = std::sqrt(1 - y * y);
        frame.lights.push_back({.kind = Light::Kind::Directional,
                                .direction = {float(r * std::cos(turn)), float(y), float(r * std::sin(turn))},
                                .illuminance = float(4 * std::numbers::pi / kSuns),
                                .angular_diameter_deg = 0});
    }
    for (const float roughness : {0.6f, 1.0f}) {
        for (const float metallic : {0.0f, 1.0f}) {
            frame.materials.assign(2, Material{.base_color = {1, 1, 1}, .roughness = roughness, .metallic = metallic});
            const Picture p = picture(frame, {.width = 32, .height = 32});
            double sum = 0;
            int on = 0;
            for (size_t i = 0; i < p.depth.size(); ++i) {
                if (!std::isfinite(p.depth[i])) continue;
                sum += double(p.rgba[4 * i + 1]);
                ++on;
            }
            ASSERT_GT(on, 80);
            EXPECT_NEAR(sum / on, 1, 0.01) << "roughness " << roughness << ", metallic " << metallic;
        }
    }
}

// Gate: the sky is at infinity. Whoever moves and looks the same way sees the same bits of it, as an image and as the clear sky.
TEST_F(GatesGpu, TheSkyStaysWhereItIsForWhoMoves) {
    Frame frame = frame_of(field::worlds::sphere_of(4));
    frame.environment_map = map_of(64, uneven);
    for (const bool image : {true, false}) {
        if (!image) frame.environment.reset(), frame.environment_map.reset();
        Picture first;
        for (const vec3 by : {vec3{0, 64, 0}, vec3{128, 256, -512}, vec3{-4096, 1024, 2048}}) {
            frame.camera.position = by;
            frame.camera.target = by + vec3{0.5f, 0.25f, 1};
            const Picture p = picture(frame, {.width = 48, .height = 36});
            for (const float d : p.depth) ASSERT_TRUE(std::isinf(d));
            if (first.rgba.empty()) first = p;
            EXPECT_EQ(p.rgba, first.rgba) << by.x;
            EXPECT_EQ(p.srgb, first.srgb) << by.x;
        }
        EXPECT_NE(first.srgb[0], first.srgb[size_t(4 * (48 * 36 - 1))]) << "the same everywhere proves nothing";
    }
}

// Gate: no border of the image is seen in it: steps between neighbouring directions are the light's own, to 1/255, round the seam
// behind, over the poles, and everywhere.
TEST(Gates, AnImageOfTheSkyHasNoSeam) {
    const auto map = map_of(256, uneven);
    EnvironmentLight light{map->words};
    std::mt19937 random(5);
    const auto in = [&](float low, float high) { return std::uniform_real_distribution<float>(low, high)(random); };
    float worst = 0;
    for (int i = 0; i < 30000; ++i) {
        vec3 d{in(-1, 1), in(-1, 1), in(-1, 1)};
        if (i % 3 == 1) d = {in(-0.01f, 0.01f), in(-1, 1), 1};                                  // the seam
        if (i % 3 == 2) d = {in(-0.02f, 0.02f), i % 2 == 0 ? 1.0f : -1.0f, in(-0.02f, 0.02f)};  // a pole
        if (!(dot(d, d) > 0.01f)) continue;
        const vec3 a = normalize(d), b = normalize(a + vec3{in(-1, 1), in(-1, 1), in(-1, 1)} * 0.004f);
        for (const float roughness : {0.0f, 0.3f, 1.0f}) {
            const vec3 step =
                roughness > 0 ? light.environment_reflection(a, roughness) - light.environment_reflection(b, roughness)
                              : light.environment_radiance(a) - light.environment_radiance(b);
            const vec3 own = roughness > 0 ? vec3{} : uneven(a) - uneven(b);
            worst = std::max({worst, std::fabs(step.x - own.x), std::fabs(step.y - own.y), std::fabs(step.z - own.z)});
        }
    }
    EXPECT_LE(worst, 1.0f / 255);
}

// A ball of glass, a sheet that blends, and a particle.
Frame frame_with_see_through() {
    Frame frame = frame_of(on_ground());
    frame.materials[1].opacity = 0.2f;
    auto set = rhi::must(field::BrickSet::make(field::worlds::compiled({field::worlds::edit(Sphere{0.4f})}), 0.05f));
    frame.instances = {
        Instance{.bricks = set, .pose = {{0, 1, 0.5f}, {}}, .before = {{0, 1, 0.5f}, {}}, .material = 1, .glass = 1}};
    model::Surface s = meshes::matte({1, 0.5f, 0.2f}, 1);
    s.base_color.w = 0.5f;
    s.blend = s.double_sided = true;
    frame.meshes = {meshes::at(meshes::sheet(-0.8f, -0.8f, 0.8f, 0.8f, s), {0, 0.6f, 0})};
    frame.particles = {Particle{.position = {0.2f, 0.5f, 0.4f},
                                .before = {},
                                .radius = 0.3f,
                                .color = {1, 1, 1},
                                .opacity = 0.6f,
                                .emissive = {}}};
    return frame;
}

// Gates G24 and G25 of a frame with everything in it: two renderers draw the same bits, and no picture but the first makes a pipeline.
TEST_F(GatesSlowGpu, AFrameOfEverythingIsTheSameInTwoRunsAndMakesNoPipelineLate) {
    Frame frame = frame_with_see_through();
    const Pose beside{{-0.9f, 0.4f, 0.8f}, {}};
    frame.instances.push_back(
        Instance{.bricks = frame.instances[0].bricks, .pose = beside, .before = beside, .material = 2});
    frame.meshes.push_back(meshes::at(meshes::sphere(0.3f, 16, meshes::matte({0.2f, 0.8f, 0.3f})), {0.8f, 0.3f, 0.9f}));
    frame.meshes[1].outline = Outline{.color = {1, 0, 0}, .width_px = 2};
    frame.outlines = {{frame.field->program().rows()[1], Outline{.color = {0, 1, 0}, .width_px = 2}}};
    frame.lines = {DebugLine{{-1, 0, 0}, {1, 1, 0}}};
    frame.lights.push_back({.kind = Light::Kind::Point, .position = {1, 2, 1}, .intensity = 3, .radius = 0.1f});
    frame.camera.bloom = 0.1f;
    frame.camera.auto_exposure = true;
    auto other = renderer_or_skip();
    ASSERT_TRUE(other);
    for (const MeshShadows shadows : {MeshShadows::Rays, MeshShadows::Cascades}) {
        RenderSettings settings{.width = 40, .height = 30, .taa = true, .elapsed = 0.02f, .mesh_shadows = shadows};
        uint64_t made = 0;
        for (int i = 0; i < 3; ++i) {
            frame.camera.position.x += 0.01f;
            frame.instances[1].before = frame.instances[1].pose;
            frame.instances[1].pose.position.y += 0.02f;
            const Picture a = picture(frame, settings), b = rhi::must(other->render(frame, settings));
            EXPECT_EQ(a.rgba, b.rgba) << i;
            EXPECT_EQ(a.srgb, b.srgb) << i;
            EXPECT_EQ(a.depth, b.depth) << i;
            EXPECT_TRUE(i == 0 || renderer->stats().pipelines_created == made) << i;
            made = renderer->stats().pipelines_created;
        }
    }
    // Where there is much to share, it is shared.
    const RenderStats& stats = renderer->stats();
    EXPECT_LE(double(stats.transient_peak_bytes), 0.6 * double(stats.transient_sum_bytes));
    EXPECT_LE(stats.transient_pass_bytes, stats.transient_peak_bytes);
}

// Gate: what is behind glass, panes, particles and lines needs no copy of depth: the frame copies nothing but what leaves it or comes in.
TEST_F(GatesGpu, NothingOfAFrameIsCopiedForWhatIsTransparent) {
    const Frame frame = frame_with_see_through();
    (void)picture(frame, {.width = 40, .height = 30, .refine = false});
    ASSERT_FALSE(renderer->stats().passes.empty());
    int copies = 0;
    for (const auto& [name, ms] : renderer->stats().passes) {
        if (!name.starts_with("copy ")) continue;
        if (name == "copy glass tree to glass tree" || name == "copy instance tree to instance tree" ||
            name == "copy instance ways to instance ways")
            continue;  // came in
        EXPECT_NE(name.find("to read-back of"), std::string::npos) << name;
        ++copies;
    }
    EXPECT_GT(copies, 0);
}

}  // namespace
}  // namespace kiln::render
