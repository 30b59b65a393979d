// SPDX-License-Identifier: MIT
// Starts threads.
// What lights a scene that says little: default sun and sky, and images of the sky.

#include "image/exr_file.h"
#include "render/lib/pack.h"
#include "scene_text.h"
#include "temp_folder.h"

#include <kiln/world.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>

namespace kiln::scene {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

const char* const kBall = "{\"id\": \"ball\", \"shape\": \"sphere\", \"radius\": 0.5, \"material\": \"white\"}";
const char* const kWhite = "\"materials\": {\"white\": {\"base_color\": [1, 1, 1], \"roughness\": 0.6}}";

class SkyImages : public testing::Test {
protected:
    void write(const std::string& name, int width, int height, const std::vector<float>& values) {
        const auto done = image::write_exr((folder_ / name).string(), width, height, 3, values);
        ASSERT_TRUE(done) << done.error().message;
    }
    std::string text_with(const std::string& file, const std::string& more = "") {
        return scene_with(kBall, std::string(kWhite) + ", \"environment\": {\"file\": \"" + file + "\"" + more + "}");
    }
    Result<World> world_with(const std::string& file, const std::string& more = "") {
        return World::parse(text_with(file, more), (folder_ / "s.json").string());
    }
    const TempFolder folder_;
};

Frame frame_of(const std::string& more) {
    const auto world = World::parse(scene_with(kBall, std::string(kWhite) + more), "s.json");
    EXPECT_TRUE(world) << world.error().message;
    const auto frame = world->frame();
    EXPECT_TRUE(frame) << frame.error().message;
    return *frame;
}

bool same_direction(vec3 a, vec3 b) { return length(normalize(a) - normalize(b)) < 1e-5f; }

}  // namespace

TEST(Sky, ASceneThatSaysNothingGetsASunAndASky) {
    const Frame frame = frame_of("");
    const Light sun = render::shade::default_sun();
    ASSERT_EQ(frame.lights.size(), 1u);
    EXPECT_TRUE(same_direction(frame.lights[0].direction, sun.direction));
    EXPECT_EQ(frame.lights[0].illuminance, sun.illuminance);
    EXPECT_FALSE(frame.environment);
    const auto sky = render::shade::sky_params(frame);
    EXPECT_GT(sky_radiance(sky, normalize(sun.direction * -1.0f)).x, 1000) << "the disc";
    EXPECT_LT(sky_radiance(sky, {0, 1, 0}).x, 1);
    EXPECT_GT(sky_radiance(sky, {1, 0, 0}).z, sky_radiance(sky, {0, -1, 0}).z) << "the ground is darker";
}

TEST(Sky, LightsWithoutAnEnvironmentGetTheSkyWithTheirOwnSun) {
    const Frame lamp = frame_of(R"(, "lights": [{"type": "point", "position": [0, 3, 0]}])");
    ASSERT_EQ(lamp.lights.size(), 1u);
    EXPECT_FALSE(lamp.environment);
    EXPECT_GT(render::shade::sky_params(lamp).sun.w, 1) << "no disc without a sun";
    const Frame day = frame_of(R"(, "lights": [{"type": "directional", "direction": [1, -1, 0], "illuminance": 2}])");
    const auto sky = render::shade::sky_params(day);
    EXPECT_GT(sky_radiance(sky, normalize(vec3{-1, 1, 0})).x, 1000);
    EXPECT_LT(sky_radiance(sky, normalize(render::shade::default_sun().direction * -1.0f)).x, 1);
}

TEST(Sky, AnEnvironmentWithoutLightsKeepsItsColorAndGetsTheSun) {
    const Frame frame = frame_of(R"(, "environment": {"color": [0.1, 0.2, 0.3]})");
    ASSERT_EQ(frame.lights.size(), 1u);
    EXPECT_TRUE(same_direction(frame.lights[0].direction, render::shade::default_sun().direction));
    EXPECT_NEAR(sky_radiance(render::shade::sky_params(frame), {0, 1, 0}).z, 0.3f, 1e-6f);
}

TEST_F(SkyImages, AreReadBesideTheSceneAndHaveTheirOwnSun) {
    write("sky.exr", 4, 2, std::vector<float>(24, 0.5f));
    const auto world = world_with("sky.exr", ", \"intensity\": 2");
    ASSERT_TRUE(world) << world.error().message;
    const auto frame = world->frame();
    ASSERT_TRUE(frame) << frame.error().message;
    EXPECT_TRUE(frame->lights.empty());
    EXPECT_TRUE(frame->environment_map);
    EXPECT_EQ(world->frame()->environment_map, frame->environment_map) << "made once";
    EXPECT_THAT(world->to_json(), HasSubstr("\"file\": \"sky.exr\""));
    EXPECT_TRUE(world->not_drawn_yet().empty());
}

TEST_F(SkyImages, FaultsHaveAPlaceAndAMend) {
    const auto fault = [&](const std::string& file) {
        const auto world = world_with(file);
        EXPECT_FALSE(world) << file;
        if (world) return std::string();
        EXPECT_EQ(world.error().kind, ErrorKind::Input);
        return world.error().message;
    };
    const std::string place = (folder_ / "s.json").string() + ":1:";
    EXPECT_THAT(fault("missing.exr"), StartsWith(place));
    EXPECT_THAT(fault("missing.exr"), HasSubstr("environment.file: cannot read"));
    EXPECT_THAT(fault("missing.exr"), HasSubstr("; name an equirectangular OpenEXR image"));
    EXPECT_THAT(fault(""), HasSubstr("empty file name"));
    {
        std::ofstream out(folder_ / "text.exr");
        out << "not an image";
    }
    EXPECT_THAT(fault("text.exr"), HasSubstr("not an OpenEXR file"));
    write("whole.exr", 64, 32, std::vector<float>(64 * 32 * 3, 1.0f));
    {
        std::ifstream in(folder_ / "whole.exr", std::ios::binary);
        const std::string bytes((std::istreambuf_iterator<char>(in)), {});
        std::ofstream out(folder_ / "cut.exr", std::ios::binary);
        out << bytes.substr(0, bytes.size() / 2);
    }
    EXPECT_THAT(fault("cut.exr"), HasSubstr("broken OpenEXR"));
    // The depth writer keeps what the other one replaces.
    std::vector<float> values(32, 1.0f);
    values[10] = std::numeric_limits<float>::quiet_NaN();
    ASSERT_TRUE(image::write_exr_depth((folder_ / "nan.exr").string(), 8, 4, values));
    EXPECT_THAT(fault("nan.exr"), HasSubstr("pixel (2, 1) is NaN"));
    values[10] = std::numeric_limits<float>::infinity();
    ASSERT_TRUE(image::write_exr_depth((folder_ / "inf.exr").string(), 8, 4, values));
    EXPECT_THAT(fault("inf.exr"), HasSubstr("pixel (2, 1) is infinite"));
    EXPECT_THAT(image::read_exr((folder_ / "inf.exr").string(), 31).error().message,
                HasSubstr("8 x 4 pixels; at most 31 are read"));
}

TEST_F(SkyImages, AnImageNamedByCodeIsReadWhenDrawn) {
    write("later.exr", 4, 2, std::vector<float>(24, 0.5f));
    World world;
    world.environment = Environment{.file = (folder_ / "later.exr").string()};
    EXPECT_TRUE(world.frame()->environment_map);
    world.environment->file = "/nowhere.exr";
    EXPECT_THAT(world.frame().error().message, HasSubstr("environment.file: cannot read /nowhere.exr"));
}

// The renderer against the path tracer: a ball has nothing to hide from itself, so both sum the same light.
TEST_F(SkyImages, SkyGpuLightsAsThePathTracerSays) {
    auto renderer = Renderer::create({.validation = true});
    if (!renderer) {
        const char* required = std::getenv("REQUIRE_VULKAN");
        ASSERT_FALSE(required != nullptr && std::string_view(required) == "1") << renderer.error().message;
        GTEST_SKIP() << renderer.error().message;
    }
    const int width = 64, height = 32;
    std::vector<float> values;
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            const double turn = 2 * 3.14159265358979 * ((x + 0.5) / width - 0.5),
                         fall = 3.14159265358979 * (y + 0.5) / height;
            const double dx = std::sin(fall) * std::sin(turn), dy = std::cos(fall),
                         dz = -std::sin(fall) * std::cos(turn);
            for (const double c : {1 + 0.8 * dx, 1 + 0.8 * dy, 1 - 0.8 * dz}) values.push_back(float(c));
        }
    }
    write("slopes.exr", width, height, values);
    auto world = world_with("slopes.exr", ", \"intensity\": 0.5");
    ASSERT_TRUE(world) << world.error().message;
    world->cameras = {{"main", Camera{.position = {1.2f, 0.7f, 1.5f}, .target = {0, 0, 0}}}};
    const auto frame = world->frame();
    ASSERT_TRUE(frame);
    const RenderSettings settings{.width = 40, .height = 30};
    const auto drawn = renderer->render(*frame, settings);
    const auto traced = render_reference(*frame, settings, 256);
    ASSERT_TRUE(drawn && traced) << (drawn ? traced.error() : drawn.error()).message;
    int balls = 0, skies = 0;
    for (size_t i = 0; i < 40 * 30; ++i) {
        const float alpha = traced->rgba[4 * i + 3];
        if (alpha > 0 && alpha < 1) continue;  // the rim
        (alpha > 0 ? balls : skies) += 1;
        for (size_t c = 0; c < 3; ++c)
            EXPECT_NEAR(drawn->rgba[4 * i + c], traced->rgba[4 * i + c], alpha > 0 ? 0.06 : 0.02)
                << i << " of " << alpha;
    }
    EXPECT_GT(balls, 200);
    EXPECT_GT(skies, 200);
}

// Gate G8: a constant image lights a white surface to exactly its radiance.
TEST_F(SkyImages, SkyGpuWhiteFurnace) {
    auto renderer = Renderer::create({.validation = true});
    if (!renderer) GTEST_SKIP() << renderer.error().message;
    write("constant.exr", 6, 3, std::vector<float>(54, 0.5f));
    const auto world = world_with("constant.exr", ", \"color\": [9, 0, 9], \"intensity\": 2");
    ASSERT_TRUE(world) << world.error().message;
    const auto frame = world->frame();
    ASSERT_TRUE(frame);
    const auto picture = renderer->render(*frame, {.width = 48, .height = 36});
    ASSERT_TRUE(picture) << picture.error().message;
    int hits = 0;
    for (size_t i = 0; i < 48 * 36; ++i) {
        hits += std::isfinite(picture->depth[i]);
        for (size_t c = 0; c < 3; ++c) ASSERT_NEAR(picture->rgba[4 * i + c], 1, 0.01) << i;
    }
    EXPECT_GT(hits, 300);
}

}  // namespace kiln::scene
