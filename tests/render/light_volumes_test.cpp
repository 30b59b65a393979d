// SPDX-License-Identifier: MIT
// Lights as rasterised volumes give the picture that lists by tile give, but for what sums of half floats round.
#include "drawables.h"
#include "gpu_worlds.h"

#include <cmath>
#include <random>

namespace kiln::render {
namespace {

struct LightVolumesGpu : testing::Test {
    void SetUp() override {
        renderer = renderer_or_skip();
        if (!renderer && !HasFailure()) GTEST_SKIP() << "no Vulkan device";
    }
    Picture picture(const Frame& frame, LightTechnique lighting) {
        return rhi::must(renderer->render(frame, {.width = 80, .height = 60, .lighting = lighting}));
    }
    // Each term is rounded as it is added: so many half units in the last place of the whole.
    void expect_equal(const Frame& frame, int terms) {
        const Picture lists = picture(frame, LightTechnique::Clusters);
        EXPECT_EQ(renderer->stats().lighting, "clusters");
        const Picture volumes = picture(frame, LightTechnique::Volumes);
        EXPECT_EQ(renderer->stats().lighting, "volumes");
        double worst = 0, sum = 0, of = 0;
        for (size_t i = 0; i < lists.rgba.size(); ++i) {
            const double a = double(lists.rgba[i]), b = double(volumes.rgba[i]);
            const double ulp = std::exp2(std::floor(std::log2(std::max(a, 1e-4))) - 10);
            worst = std::max(worst, std::fabs(a - b) / ulp);
            sum += std::fabs(a - b);
            of += a;
        }
        EXPECT_LE(worst, terms) << "units in the last place";
        EXPECT_LE(sum / of, 1e-3);
    }
    std::unique_ptr<Renderer> renderer;
};

// `count` lights of random places, ranges and kinds over a ground with balls; some of them round the eye.
Frame crowd(int count, uint32_t seed) {
    Frame frame = frame_of(on_ground());
    frame.environment = Environment{.color = {0.02f, 0.02f, 0.03f}};
    std::mt19937 random(seed);
    const auto in = [&](float low, float high) { return std::uniform_real_distribution<float>(low, high)(random); };
    frame.lights = {{.kind = Light::Kind::Directional, .illuminance = 0.3f}};
    for (int i = 0; i < count; ++i) {
        Light l{.kind = i % 3 == 0 ? Light::Kind::Spot : Light::Kind::Point};
        l.position = {in(-2, 2.4f), in(-0.4f, 1.6f), in(-2, 2.8f)};
        l.direction = {in(-1, 1), in(-1, 0.2f), in(-1, 1)};
        l.color = {in(0.1f, 1), in(0.1f, 1), in(0.1f, 1)};
        l.intensity = in(0.02f, 0.3f);
        l.range = in(0.3f, 1.5f);
        l.radius = i % 4 == 0 ? 0.05f : 0;
        l.outer_deg = in(10, 85);
        l.inner_deg = 0.6f * l.outer_deg;
        frame.lights.push_back(l);
    }
    return frame;
}

TEST_F(LightVolumesGpu, TwoHundredAndFiftySixLightsAreThoseOfTheLists) { expect_equal(crowd(256, 3), 24); }

TEST_F(LightVolumesGpu, LightsRoundTheEyeAndWithoutARangeReachAllThatTheyReach) {
    Frame frame = crowd(4, 5);
    for (Light& l : frame.lights) l.range = 0;
    frame.lights.push_back({.kind = Light::Kind::Point, .position = frame.camera.position, .intensity = 1, .range = 6});
    const vec3 ahead = frame.camera.target - frame.camera.position;
    frame.lights.push_back(
        {.kind = Light::Kind::Spot, .direction = ahead, .position = frame.camera.position, .intensity = 1, .range = 6});
    // Behind the eye, its cone reaching past it; and one that shines towards it.
    frame.lights.push_back({.kind = Light::Kind::Spot,
                            .direction = ahead,
                            .position = frame.camera.position - ahead * 0.3f,
                            .intensity = 1,
                            .range = 9});
    frame.lights.push_back(
        {.kind = Light::Kind::Spot, .direction = ahead * -1.0f, .position = {0, 1.5f, 0}, .intensity = 1, .range = 3});
    expect_equal(frame, 6);
}

TEST_F(LightVolumesGpu, MeshesAndGlassAreLitAlike) {
    Frame frame = crowd(20, 9);
    model::Surface pane = meshes::matte({0.5f, 0.7f, 0.6f});
    pane.blend = pane.double_sided = true;
    pane.base_color.w = 0.4f;
    frame.meshes = {meshes::at(meshes::sphere(0.3f, 20, meshes::matte({0.6f, 0.6f, 0.6f})), {0.3f, 0.6f, 0.9f}),
                    meshes::at(meshes::sheet(-0.5f, -0.5f, 0.5f, 0.5f, pane), {0.6f, 0.5f, 0.6f})};
    expect_equal(frame, 10);
}

}  // namespace
}  // namespace kiln::render
