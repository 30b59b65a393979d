// SPDX-License-Identifier: MIT
// What a renderer tells of a picture's cost, and what --quality changes.
#include "drawables.h"
#include "gpu_worlds.h"

#include <algorithm>
#include <numeric>

namespace kiln::render {
namespace {

struct FrameCostGpu : testing::Test {
    void SetUp() override {
        renderer = renderer_or_skip();
        if (!renderer && !HasFailure()) GTEST_SKIP() << "no Vulkan device";
    }
    // A ball on a slab, a sheet above them, one round lamp.
    static Frame scene() {
        field::worlds::World w;
        w.name = "slab";
        w.edits = {field::worlds::edit(Box{.half_extents = {1.2f, 0.1f, 1.2f}}, {0, -0.5f, 0}),
                   field::worlds::edit(Sphere{.radius = 0.3f}, {0, -0.1f, 0})};
        w.options.voxel_size = 0.05f;
        w.options.bounds = Box3{{-1.5f, -1.5f, -1.5f}, {1.5f, 1.5f, 1.5f}};
        Frame frame = frame_of(w, {0.6f, 1.0f, 2.6f});
        frame.lights = {{.kind = Light::Kind::Point, .position = {0.8f, 1.5f, 0.4f}, .intensity = 6, .radius = 0.25f}};
        model::Surface s = meshes::matte({0.6f, 0.6f, 0.6f});
        s.double_sided = true;
        frame.meshes.push_back(meshes::at(meshes::sheet(-0.3f, -0.3f, 0.3f, 0.3f, s), {0.5f, 0.4f, 0.3f}));
        frame.camera.bloom = 0.1f;
        return frame;
    }
    std::unique_ptr<Renderer> renderer;
};

TEST_F(FrameCostGpu, EveryPassTellsItsBytesAndTransientsShareTheirMemory) {
    const RenderSettings settings{.width = 96, .height = 64};
    (void)rhi::must(renderer->render(scene(), settings));
    const RenderStats& s = renderer->stats();
    ASSERT_EQ(s.pass_bytes.size(), s.passes.size());
    for (size_t i = 0; i < s.passes.size(); ++i) EXPECT_EQ(s.pass_bytes[i].first, s.passes[i].first);
    const auto of = [](const auto& list, std::string_view name) {
        return std::find_if(list.begin(), list.end(), [&](const auto& p) { return p.first == name; })->second;
    };
    // Visibility, surface, fractions read and fractions written: four images of four words; the masks of 6 x 4 tiles, a word each; one light.
    const uint64_t pixels = 96 * 64;
    EXPECT_GE(of(s.pass_bytes, "mesh shadow"), 4 * 16 * pixels + 24 * 4 + 64);
    EXPECT_LE(of(s.pass_bytes, "mesh shadow"), 4 * 16 * pixels + 8192)
        << "what stays from frame to frame does not count";
    EXPECT_LE(of(s.pass_bytes, "march"), 20 * pixels + 8192)
        << "it reads where meshes are and writes words and counts; the atlas stays";
    ASSERT_FALSE(s.pass_evaluations.empty());
    EXPECT_GT(of(s.pass_evaluations, "march"), 0u);
    EXPECT_EQ(s.evaluations, std::accumulate(s.pass_evaluations.begin(), s.pass_evaluations.end(), uint64_t{0},
                                             [](uint64_t sum, const auto& p) {
                                                 return sum + (p.first.starts_with("march") ? p.second : 0);
                                             }));
    EXPECT_GT(s.transient_peak_bytes, 0u);
    EXPECT_LE(double(s.transient_peak_bytes), 0.6 * double(s.transient_sum_bytes));
}

// With maps no larger than the picture, so that images of the picture are most of what a frame holds.
TEST_F(FrameCostGpu, NoFrameHoldsMoreThanSixTenthsOfItsTransients) {
    Frame bare = scene();
    bare.meshes.clear();
    bare.camera.bloom = 0;
    for (const Frame& frame : {bare, scene()}) {
        for (const Quality q : {Quality::Low, Quality::Medium, Quality::High, Quality::Ultra}) {
            RenderSettings settings{.width = 96, .height = 64, .shadow_map_side = 64};
            set_quality(settings, q);
            (void)rhi::must(renderer->render(frame, settings));
            const RenderStats& s = renderer->stats();
            EXPECT_LE(double(s.transient_peak_bytes), 0.6 * double(s.transient_sum_bytes))
                << int(q) << ", meshes " << frame.meshes.size();
        }
    }
}

// A picture over time is drawn whole, one of the moment in bands, where nothing looks at neighbours.
TEST_F(FrameCostGpu, BandsAreThePictureThatIsDrawnWhole) {
    Frame frame = scene();
    frame.meshes.clear();
    for (int i = 0; i < 24; ++i)  // more than one batch, and lists that differ from tile to tile
        frame.lights.push_back({.kind = Light::Kind::Point,
                                .position = {-1.2f + 0.1f * float(i), 0.3f, 0.5f * float(i % 3)},
                                .intensity = 0.3f,
                                .range = i % 2 == 0 ? 0.0f : 0.8f,
                                .radius = 0.05f});
    for (const bool refine : {false, true}) {
        const RenderSettings bands{.width = 72, .height = 75, .refine = refine, .ao = AmbientOcclusion::Off};
        RenderSettings whole = bands;
        whole.taa = whole.cut = true;
        whole.taa_jitter = false;
        const Picture a = rhi::must(renderer->render(frame, bands));
        const uint64_t peak = renderer->stats().transient_peak_bytes;
        const Picture b = rhi::must(renderer->render(frame, whole));
        EXPECT_EQ(a.rgba, b.rgba) << refine;
        EXPECT_EQ(a.srgb, b.srgb) << refine;
        EXPECT_EQ(a.depth, b.depth) << refine;
        EXPECT_LT(peak, renderer->stats().transient_peak_bytes * 4 / 5);
    }
}

TEST_F(FrameCostGpu, QualitiesChangeWhatTheySay) {
    const Frame frame = scene();
    const auto drawn = [&](Quality q) {
        RenderSettings settings{.width = 96, .height = 64, .cut = true};
        set_quality(settings, q);
        return rhi::must(renderer->render(frame, settings));
    };
    const Picture low = drawn(Quality::Low), medium = drawn(Quality::Medium), high = drawn(Quality::High);
    EXPECT_EQ(high.rgba, rhi::must(renderer->render(frame, {.width = 96, .height = 64})).rgba);
    EXPECT_NE(low.depth, medium.depth) << "surfaces as the bricks have them";
    EXPECT_EQ(medium.depth, high.depth);
    // Hard shadows: a lamp without size, but for shadows alone.
    Frame small = frame;
    small.lights[0].radius = 0;
    const RenderSettings maps{
        .width = 96, .height = 64, .mesh_shadows = MeshShadows::Cascades, .ao = AmbientOcclusion::Off};
    EXPECT_EQ(medium.rgba, rhi::must(renderer->render(small, maps)).rgba);
    EXPECT_NE(medium.rgba, rhi::must(renderer->render(small, {.width = 96, .height = 64})).rgba) << "meshes have maps";
    EXPECT_NE(medium.rgba, high.rgba);
    RenderSettings ultra;
    set_quality(ultra, Quality::Ultra);
    EXPECT_TRUE(ultra.taa && ultra.refine && ultra.soft_shadows);
    EXPECT_EQ(ultra.transparent_layers, 4);
    EXPECT_EQ(ultra.glass_bounces, 4);
    EXPECT_EQ(ultra.ao, AmbientOcclusion::Full);
    set_quality(ultra, Quality::Low);
    EXPECT_EQ(ultra.ao, AmbientOcclusion::Off);
    set_quality(ultra, Quality::Medium);
    EXPECT_EQ(ultra.transparent_layers, 2);
    EXPECT_EQ(ultra.glass_bounces, 0);
}

}  // namespace
}  // namespace kiln::render
