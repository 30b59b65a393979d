// SPDX-License-Identifier: MIT
// Glass in worlds: what stands apart from what is solid, what questions see of it, and pictures against the path tracer's.
#include "field/brick_set.h"
#include "image/metrics.h"
#include "render/lens.h"
#include "sdf/program.h"

#include <kiln/world.h>

#include <gtest/gtest.h>

#include <cstdlib>
#include <memory>
#include <string>
#include <string_view>

namespace kiln {
namespace {

constexpr const char* kMaterials =
    R"("materials": {"clear": {"opacity": 0.01, "roughness": 0.05}, "amber": {"opacity": 0.05, "ior": 1.54, "roughness": 0.1,
        "attenuation_color": [0.9, 0.5, 0.1], "attenuation_distance": 0.1}, "clay": {"base_color": [0.7, 0.3, 0.2]}})";

World world_of(const std::string& edits, const std::string& rest = "") {
    auto world = World::parse(
        std::string(
            R"({"format": 1, "field": {"voxel_size": 0.04, "bounds": {"min": [-2, -2, -2], "max": [2, 2, 2]}}, )") +
            kMaterials +
            R"(, "objects": {"jar": {"op": "subtract", "material": "clear", "children": [
                                  {"shape": "cylinder", "half_height": 0.5, "radius": 0.4}, {"shape": "cylinder", "half_height": 0.5, "radius": 0.3, "position": [0, 0.1, 0]}]}},
                              "edits": [)" +
            edits + "]" + rest + "}",
        "test.kiln.json");
    EXPECT_TRUE(world) << (world ? "" : world.error().message);
    return world ? std::move(*world) : World();
}

int count_glass(const World& world) {
    const auto frame = world.frame();
    EXPECT_TRUE(frame) << (frame ? "" : frame.error().message);
    int out = 0;
    for (const Instance& i : frame->instances) out += i.glass != 0 && frame->materials[i.glass].opacity < 1;
    return out;
}

constexpr const char* kBlock =
    R"({"id": "block", "shape": "box", "half_extents": [0.6, 0.2, 0.6], "position": [0, -1, 0], "material": "clay"})";
constexpr const char* kBall = R"({"id": "ball", "shape": "sphere", "radius": 0.5, "material": "amber")";

TEST(WorldGlass, StandsApartFromWhatIsSolid) {
    EXPECT_EQ(count_glass(world_of(kBlock)), 0);
    EXPECT_EQ(count_glass(world_of(std::string(kBlock) + ", " + kBall + "}")), 1);
    EXPECT_EQ(count_glass(world_of(std::string(kBlock) + R"(, {"id": "jar", "object": "jar"})")), 1);
    EXPECT_EQ(count_glass(world_of(std::string(kBlock) + R"(, {"id": "jar", "object": "jar", "material": "clay"})")), 1)
        << "the tree's own";
    // The field is what it is without it, and questions see it.
    const World with = world_of(std::string(kBlock) + ", " + kBall + "}"), without = world_of(kBlock);
    const auto a = with.frame(), b = without.frame();
    ASSERT_TRUE(a && b);
    EXPECT_EQ(a->field->stats().bricks, b->field->stats().bricks);
    EXPECT_NEAR(with.distance({0, 0.7f, 0}), 0.2f, 1e-5f);
    // What blends with it, or cuts it later, makes one with it: that is drawn as solid.
    EXPECT_EQ(count_glass(
                  world_of(std::string(kBlock) + ", " + kBall + R"(, "blend_radius": 0.1, "position": [0, -0.5, 0]})")),
              0);
    EXPECT_EQ(count_glass(world_of(
                  std::string(kBall) +
                  R"(}, {"id": "cut", "op": "subtract", "shape": "sphere", "radius": 0.3, "position": [0, 0.5, 0]})")),
              0);
    EXPECT_EQ(count_glass(world_of(
                  std::string(kBall) +
                  R"(}, {"id": "cut", "op": "subtract", "shape": "sphere", "radius": 0.3, "position": [0, 1.5, 0]})")),
              1);
}

TEST(WorldGlass, FollowsWhatItsMaterialBecomes) {
    World world = world_of(std::string(kBlock) + ", " + kBall + "}");
    ASSERT_EQ(count_glass(world), 1);
    world.add_material("amber", {.opacity = 1});
    EXPECT_EQ(count_glass(world), 0);
    const auto solid = world.frame();
    ASSERT_TRUE(solid);
    world.add_material("amber", {.opacity = 0.5f});
    EXPECT_EQ(count_glass(world), 1);
    const auto glass = world.frame();
    EXPECT_LT(glass->field->stats().bricks, solid->field->stats().bricks);
}

TEST(WorldGlass, OfABodyIsGlassWhereAllOfItIs) {
    const std::string body = R"(, "bodies": [{"id": "b", "edits": ["ball", "other"], "motion": "dynamic"}])";
    const auto other = [](const char* material) {
        return std::string(
                   R"(}, {"id": "other", "shape": "box", "half_extents": [0.2, 0.2, 0.2], "position": [0.5, 0, 0], "material": ")") +
               material + "\"}";
    };
    EXPECT_EQ(count_glass(world_of(std::string(kBlock) + ", " + kBall + other("clear"), body)), 1);
    EXPECT_EQ(count_glass(world_of(std::string(kBlock) + ", " + kBall + other("clay"), body)), 0);
}

// The left half of a picture as it is shown, or the right one.
image::Rgb shown(const Picture& p, bool right) {
    image::Rgb out{p.width / 2, p.height, {}};
    for (int y = 0; y < p.height; ++y) {
        for (int x = 0; x < p.width / 2; ++x) {
            const uint8_t* c = &p.srgb[size_t(y * p.width + x + (right ? p.width / 2 : 0)) * 4];
            for (int k = 0; k < 3; ++k) out.values.push_back(float(c[k]) / 255);
        }
    }
    return out;
}

// The mean of four by four rays a pixel: what anti-aliasing over time adds has tests of its own.
Picture many_rays(Renderer& renderer, const Frame& frame, const RenderSettings& settings) {
    constexpr int kSide = 4;
    RenderSettings larger = settings;
    larger.width *= kSide, larger.height *= kSide;
    const auto picture = renderer.render(frame, larger);
    EXPECT_TRUE(picture) << (picture ? "" : picture.error().message);
    Picture out;
    out.width = settings.width, out.height = settings.height;
    out.rgba.resize(size_t(out.width) * size_t(out.height) * 4);
    if (!picture) return out;
    for (int y = 0; y < larger.height; ++y)
        for (int x = 0; x < larger.width; ++x)
            for (size_t c = 0; c < 4; ++c)
                out.rgba[size_t(y / kSide * out.width + x / kSide) * 4 + c] +=
                    picture->rgba[size_t(y * larger.width + x) * 4 + c] / float(kSide * kSide);
    render::develop(out, frame.camera, render::measured_exposure(out.rgba, frame.camera, 0, {}));
    return out;
}

// A device, and worlds of glass among things that glow on their own: the path tracer's bounces between solid things would tell the two apart
// otherwise. Materials a and b glow; the others, the edits and the camera are each test's.
struct GlassPictures : testing::Test {
    void SetUp() override {
        auto made = Renderer::create({.validation = true});
        if (made) {
            renderer = std::make_unique<Renderer>(std::move(*made));
            return;
        }
        const char* required = std::getenv("REQUIRE_VULKAN");
        ASSERT_FALSE(required != nullptr && std::string_view(required) == "1") << made.error().message;
        GTEST_SKIP() << made.error().message;
    }
    static Frame frame_of(const std::string& materials, const std::string& edits, const std::string& camera) {
        const auto world = World::parse(
            R"({"format": 1, "field": {"voxel_size": 0.03, "bounds": {"min": [-3, -1.2, -3], "max": [3, 2, 1.5]}},
      "materials": {"a": {"base_color": [0, 0, 0], "emissive": [0.8, 0.2, 0.1], "roughness": 1}, "b": {"base_color": [0, 0, 0], "emissive": [0.1, 0.5, 0.7], "roughness": 1}, )" +
                materials + R"(}, "edits": [)" + edits +
                R"(], "environment": {"color": [0.25, 0.3, 0.35]}, "lights": [{"type": "directional", "illuminance": 0}],
      "cameras": {"main": {"target": [0, 0, 0], "fov_y_deg": 40, "tone_map": "neutral", "position": )" +
                camera + "}}}",
            "test.kiln.json");
        EXPECT_TRUE(world) << world.error().message;
        auto frame = world->frame();
        EXPECT_TRUE(frame) << frame.error().message;
        return std::move(*frame);
    }
    std::unique_ptr<Renderer> renderer;
};
struct GlassGpu : GlassPictures {};
struct RoughGlassGpu : GlassPictures {};

TEST_F(GlassGpu, LooksAsThePathTracerSays) {
    const Frame frame = frame_of(
        R"("c": {"base_color": [0, 0, 0], "emissive": [0.7, 0.6, 0.2], "roughness": 1},
        "clear": {"opacity": 0.000001, "roughness": 0.0}, "amber": {"opacity": 0.000001, "roughness": 0.0, "attenuation_color": [0.9, 0.4, 0.2], "attenuation_distance": 0.4})",
        R"({"id": "1", "shape": "box", "half_extents": [0.4, 1, 0.2], "position": [-1.2, 0, -2], "material": "a"},
        {"id": "2", "shape": "box", "half_extents": [0.4, 1, 0.2], "position": [0.2, 0.3, -2], "material": "b"},
        {"id": "3", "shape": "box", "half_extents": [0.4, 1, 0.2], "position": [1.5, 0, -2], "material": "c"},
        {"id": "4", "shape": "sphere", "radius": 0.2, "position": [0.5, -0.1, 0.2], "material": "c"},
        {"id": "ball", "shape": "sphere", "radius": 0.6, "position": [-0.6, 0, 0], "material": "clear"},
        {"id": "block", "shape": "rounded_box", "half_extents": [0.4, 0.5, 0.4], "rounding": 0.1, "position": [0.6, 0, 0.2], "rotation": [0, 0.2588190, 0, 0.9659258], "material": "amber"})",
        "[0, 0.3, 3.4]");
    const RenderSettings settings{.width = 72, .height = 54};
    const auto fast = many_rays(*renderer, frame, settings);
    const auto slow = render_reference(frame, settings, 192);
    ASSERT_TRUE(slow) << slow.error().message;
    // Left a ball, right a block with something in it and many ways back and forth.
    EXPECT_LT(image::flip(shown(*slow, false), shown(fast, false)), 0.02);
    EXPECT_LT(image::flip(shown(*slow, true), shown(fast, true)), 0.03);
    // Glass is there at all.
    Frame bare = frame;
    std::erase_if(bare.instances, [](const Instance& i) { return i.glass != 0; });
    const auto without = renderer->render(bare, settings);
    ASSERT_TRUE(without);
    EXPECT_GT(image::flip(shown(*slow, false), shown(*without, false)), 0.1);
    EXPECT_GT(image::flip(shown(*slow, true), shown(*without, true)), 0.1);
}

// Rough glass blurs what is behind it by how far it is behind: bars that touch a pane are seen in it, those far behind it are not.
TEST_F(RoughGlassGpu, LooksAsThePathTracerSays) {
    const Frame frame = frame_of(
        R"("frosted": {"opacity": 0.000001, "roughness": 0.4}, "smeared": {"opacity": 0.000001, "roughness": 0.45})",
        R"({"id": "1", "shape": "box", "half_extents": [0.15, 1, 0.1], "position": [-1.1, 0, -1.2], "material": "a"},
        {"id": "2", "shape": "box", "half_extents": [0.15, 1, 0.1], "position": [-0.5, 0, -1.2], "material": "b"},
        {"id": "3", "shape": "box", "half_extents": [0.1, 0.8, 0.05], "position": [-0.8, 0, -0.05], "material": "a"},
        {"id": "4", "shape": "box", "half_extents": [0.2, 1, 0.1], "position": [0.9, 0.3, -1.2], "material": "b"},
        {"id": "pane", "shape": "box", "half_extents": [0.6, 0.7, 0.05], "position": [-0.8, 0, 0.15], "material": "frosted"},
        {"id": "ball", "shape": "sphere", "radius": 0.55, "position": [0.75, 0, 0], "material": "smeared"})",
        "[0, 0.2, 3.2]");
    const RenderSettings settings{.width = 64, .height = 40};
    const auto slow = render_reference(frame, settings, 192);
    ASSERT_TRUE(slow) << slow.error().message;
    const Picture fast = many_rays(*renderer, frame, settings);
    const auto one_ray = renderer->render(frame, settings);
    ASSERT_TRUE(one_ray) << one_ray.error().message;
    Frame as_smooth = frame;
    for (Material& m : as_smooth.materials)
        if (m.opacity < 1) m.roughness = 0;
    const Picture smooth = many_rays(*renderer, as_smooth, settings);
    for (const bool right : {false, true}) {
        EXPECT_LT(image::flip(shown(*slow, right), shown(fast, right)), 0.03) << (right ? "ball" : "pane");
        EXPECT_LT(image::flip(shown(*slow, right), shown(*one_ray, right)), 0.06) << (right ? "ball" : "pane");
        EXPECT_GT(image::flip(shown(*slow, right), shown(smooth, right)), 0.045) << (right ? "ball" : "pane");
    }
}

}  // namespace
}  // namespace kiln
