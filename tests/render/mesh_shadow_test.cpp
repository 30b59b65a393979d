// SPDX-License-Identifier: MIT
// What a workgroup leaves out when it looks for shadowing triangles together changes no bit; nor do the backs of closed surfaces.
#include "drawables.h"
#include "gpu_worlds.h"
#include "render/lib/lights.gpu.h"
#include "render/lib/pack.h"
#include "render/mesh_trace.h"

#include <cmath>

namespace kiln::render {
namespace {

// A box with corners of its own on every face, listed counter-clockwise from outside.
std::shared_ptr<const model::Drawable> box(vec3 half, model::Surface surface) {
    std::vector<model::Vertex> v;
    std::vector<uint32_t> corners;
    for (int axis = 0; axis < 3; ++axis)
        for (const float side : {-1.0f, 1.0f}) {
            const auto first = uint32_t(v.size());
            for (int corner = 0; corner < 4; ++corner) {
                const float a = corner == 1 || corner == 2 ? 1.0f : -1.0f, b = corner >= 2 ? 1.0f : -1.0f;
                float p[3] = {}, n[3] = {};
                p[axis] = n[axis] = side;
                p[(axis + 1) % 3] = side * a, p[(axis + 2) % 3] = b;
                model::Vertex q;
                q.position = vec3{p[0], p[1], p[2]} * half;
                q.normal = {n[0], n[1], n[2]};
                v.push_back(q);
            }
            for (const uint32_t i : {0u, 1u, 2u, 0u, 2u, 3u}) corners.push_back(first + i);
        }
    return meshes::of_surface(std::move(v), std::move(corners), std::move(surface));
}

model::Image checks() {
    model::Image image{.name = "checks", .width = 8, .height = 8, .rgba = {}};
    for (int i = 0; i < 64; ++i)
        for (const int c : {200, 200, 200, (i / 8 + i) % 2 == 0 ? 255 : 0}) image.rgba.push_back(uint8_t(c));
    return image;
}

// Meshes and a field under a sun, a lamp and a spot, one of them hard; boxes turned, stretched and mirrored, a sheet with holes.
Frame crowd() {
    field::worlds::World w;
    w.name = "floor";
    w.edits = {field::worlds::edit(Box{.half_extents = {1.4f, 0.1f, 1.4f}}, {0, -0.6f, 0}),
               field::worlds::edit(Sphere{.radius = 0.2f}, {0.1f, -0.3f, 0.6f})};
    w.options.voxel_size = 0.05f;
    w.options.bounds = Box3{{-1.5f, -1.5f, -1.5f}, {1.5f, 1.5f, 1.5f}};
    Frame frame = frame_of(w, {0.9f, 1.1f, 2.4f});
    frame.lights = {
        {.kind = Light::Kind::Directional, .direction = {-0.5f, -1, -0.3f}, .angular_diameter_deg = 6},
        {.kind = Light::Kind::Point, .position = {1.1f, 0.9f, 0.8f}, .intensity = 3, .radius = 0.12f},
        {.kind = Light::Kind::Spot, .direction = {0.4f, -1, -0.2f}, .position = {-0.9f, 1.2f, 0.6f}, .intensity = 4}};
    model::Surface grey = meshes::matte({0.6f, 0.6f, 0.6f});
    for (int i = 0; i < 24; ++i) {
        const float turn = float(i) * 0.9f;
        frame.meshes.push_back(meshes::at(box({0.09f, 0.05f, 0.13f}, grey),
                                          {0.8f * std::cos(turn), -0.35f + 0.03f * float(i), 0.8f * std::sin(turn)},
                                          axis_angle({0.3f, 0.8f, 0.5f}, turn)));
        if (i % 3 == 1) frame.meshes.back().transform.scale = {-1.4f, 1, 0.7f};
    }
    frame.meshes.push_back(meshes::at(meshes::sphere(0.25f, 24, grey), {-0.3f, 0.1f, -0.2f}));
    model::Surface holes = grey;
    holes.double_sided = holes.mask = true;
    holes.base_texture.image = 0;
    holes.base_texture.nearest = true;
    frame.meshes.push_back(meshes::at(meshes::sheet(-0.3f, -0.3f, 0.3f, 0.3f, holes, {checks()}), {0.4f, 0.45f, 0.1f}));
    return frame;
}

struct MeshShadowGpu : testing::Test {
    void SetUp() override {
        renderer = renderer_or_skip();
        if (!renderer && !HasFailure()) GTEST_SKIP() << "no Vulkan device";
    }
    Picture picture(const Frame& frame, bool accelerate) {
        return rhi::must(renderer->render(frame, {.width = 72, .height = 56, .accelerate = accelerate}));
    }
    std::unique_ptr<Renderer> renderer;
};

TEST_F(MeshShadowGpu, WhatAWorkgroupLeavesOutChangesNoBit) {
    Frame frame = crowd();
    for (const bool holes : {true, false}) {
        if (!holes) frame.meshes.pop_back();
        const Picture with = picture(frame, true), without = picture(frame, false);
        EXPECT_EQ(with.rgba, without.rgba) << holes;
    }
}

TEST_F(MeshShadowGpu, BacksOfClosedSurfacesChangeNoMoreThanRounding) {
    Frame frame = crowd();
    const Picture fronts = picture(frame, true);
    int closed = 0;
    for (MeshInstance& m : frame.meshes) {
        auto open = std::make_shared<model::Drawable>(*m.model);
        for (model::Primitive& p : open->primitives) {
            closed += p.closed;
            p.closed = false;
        }
        m.model = open;
    }
    EXPECT_EQ(closed, 24);
    const Picture both = picture(frame, true);
    int differ = 0;
    for (size_t i = 0; i < both.rgba.size(); ++i) {
        const float a = both.rgba[i], b = fronts.rgba[i];
        differ += std::fabs(a - b) > 0.02f * a + 0.004f;
    }
    // At a silhouette the last piece of a chord may be hidden by a back alone.
    EXPECT_LE(differ, 40) << "of " << both.rgba.size();
    // They do shadow: without them the picture is another.
    Frame bare = frame;
    for (MeshInstance& m : bare.meshes) m.transform.position.y += 50;
    EXPECT_NE(picture(bare, true).rgba, both.rgba);
}

TEST_F(MeshShadowGpu, ALampInAClosedBoxLightsNothingOutsideIt) {
    Frame frame = crowd();
    frame.meshes.clear();
    frame.environment = Environment{.color = {0, 0, 0}};
    const vec3 middle{0.4f, 0.1f, 0.2f};
    frame.lights = {{.kind = Light::Kind::Point, .position = middle, .intensity = 5, .radius = 0.05f}};
    const auto brightest = [&] {
        const Picture p = picture(frame, true);
        float most = 0;
        for (size_t i = 0; i < p.rgba.size(); ++i)
            if (i % 4 != 3) most = std::max(most, p.rgba[i]);
        return most;
    };
    EXPECT_GT(brightest(), 0.1f);
    frame.meshes.push_back(meshes::at(box({0.15f, 0.15f, 0.15f}, meshes::matte({0.6f, 0.6f, 0.6f})), middle));
    for (const float side : {1.0f, -1.0f}) {
        frame.meshes[0].transform.scale = {side, 1, 1};
        EXPECT_EQ(brightest(), 0) << side;
    }
}

// A ball of 32 000 triangles with knobs all over, so that nodes of its tree overlap and edges of its shadow lie in several of them.
std::shared_ptr<const model::Drawable> knobbly(float radius) {
    auto out = std::make_shared<model::Drawable>(*meshes::sphere(radius, 180, meshes::matte({0.5f, 0.5f, 0.5f}, 1)));
    for (model::Vertex& v : out->vertices) {
        const vec3 n = v.normal;
        v.position = n * (radius * (1 + 0.16f * std::sin(13 * n.x) * std::sin(11 * n.y + 1) * std::sin(12 * n.z + 2)));
    }
    model::finish(*out);
    return out;
}

// Three of them over a floor, turned, stretched and mirrored; 400 rays a pixel to each light's disc, in double precision, say what is seen of it.
TEST_F(MeshShadowGpu, SharesOfDiscsBehindDeepTreesAreWhatRaysCount) {
    field::worlds::World w;
    w.name = "speck";
    w.edits = {field::worlds::edit(Sphere{.radius = 0.05f}, {0, -3, 0})};
    w.options.voxel_size = 0.05f;
    w.options.bounds = Box3{{-0.2f, -3.2f, -0.2f}, {0.2f, -2.8f, 0.2f}};
    Frame open = frame_of(w, {-0.3f, 1.9f, 1.3f});
    open.camera.target = {-0.1f, 0, 0};
    open.environment = Environment{.color = {0, 0, 0}};
    open.meshes = {meshes::at(meshes::sheet(-3, -3, 3, 3, meshes::matte({0.6f, 0.6f, 0.6f}, 1)))};
    Frame shaded = open;
    const auto ball = knobbly(0.22f);
    shaded.meshes.push_back(meshes::at(ball, {-0.1f, 0.5f, -0.1f}, axis_angle({0.6f, 0, 0.8f}, 0.7f)));
    shaded.meshes.push_back(meshes::at(ball, {0.45f, 0.4f, 0.2f}, axis_angle({0, 0.6f, 0.8f}, 2)));
    shaded.meshes.back().transform.scale = {-1.3f, 0.6f, 1};
    shaded.meshes.push_back(meshes::at(ball, {-0.6f, 0.25f, 0.3f}));
    shaded.meshes.back().transform.scale = {0.5f, 1, 0.7f};
    const MeshSet set = make_mesh_set(shaded);
    const MeshTrace trace(set);
    const Light lights[] = {
        {.kind = Light::Kind::Directional, .direction = {-0.4f, -1, -0.3f}, .angular_diameter_deg = 16},
        {.kind = Light::Kind::Point, .position = {0.3f, 1.4f, 0.4f}, .intensity = 3, .radius = 0.2f},
        {.kind = Light::Kind::Spot,
         .direction = {0.3f, -1, -0.1f},
         .position = {-0.5f, 1.7f, 0.2f},
         .intensity = 9,
         .radius = 0.15f,
         .inner_deg = 50,
         .outer_deg = 70}};
    constexpr int kWidth = 64, kHeight = 48, kRays = 400;
    const shade::CameraParams eye = shade::camera_params(open.camera, kWidth, kHeight);
    for (const Light& light : lights) {
        open.lights = shaded.lights = {light};
        const RenderSettings settings{.width = kWidth, .height = kHeight, .ao = AmbientOcclusion::Off};
        const Picture a = rhi::must(renderer->render(open, settings)),
                      b = rhi::must(renderer->render(shaded, settings));
        const shade::LightRecord record = shade::light_record(light);
        double worst = 0, sum = 0;
        int judged = 0, dark = 0, half = 0;
        for (int i = 0; i < kWidth * kHeight; ++i) {
            const float lit = a.rgba[4 * size_t(i)];
            if (a.depth[size_t(i)] != b.depth[size_t(i)] || !(lit > 0.01f)) continue;  // the floor, and in the light
            const vec3 d = shade::camera_direction_at(eye, float(i % kWidth) + 0.5f, float(i / kWidth) + 0.5f);
            const vec3 p = open.camera.position + d * a.depth[size_t(i)];
            const shade::LightSample to = shade::sample_light(record, p);
            const shade::Basis basis = shade::basis_around(to.l);
            int seen = 0;
            for (int k = 0; k < kRays; ++k) {  // Vogel's spiral: equal parts of the disc
                const double r = double(to.tan_radius) * std::sqrt((k + 0.5) / kRays), turn = 2.39996322972865 * k;
                const vec3 way =
                    to.l + basis.tangent * float(r * std::cos(turn)) + basis.bitangent * float(r * std::sin(turn));
                const double size = std::sqrt(double(dot(way, way)));
                seen += !trace.hides({double(p.x), 1e-4, double(p.z)},
                                     {double(way.x) / size, double(way.y) / size, double(way.z) / size},
                                     std::min(double(to.distance), 1e3) * size);
            }
            const double by = std::fabs(double(b.rgba[4 * size_t(i)]) / double(lit) - double(seen) / kRays);
            worst = std::max(worst, by);
            sum += by;
            ++judged;
            dark += seen == 0;
            half += seen > 0 && seen < kRays;
        }
        EXPECT_GT(judged, 1500);
        EXPECT_GT(dark, 20);
        EXPECT_GT(half, 200);
        EXPECT_LE(worst, 0.02) << "light " << &light - lights;
        EXPECT_LE(sum / half, 0.004) << "light " << &light - lights;
    }
}

}  // namespace
}  // namespace kiln::render
