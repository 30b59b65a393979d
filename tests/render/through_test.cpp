// SPDX-License-Identifier: MIT
// What lets light through: the law of Beer and Lambert, Snell's, Fresnel's, and orders that change nothing.
#include "drawables.h"
#include "field/brick_set.h"
#include "gpu_worlds.h"
#include "render/lib/glass.gpu.h"
#include "render/lib/pack.h"
#include "render/reference_glass.h"
#include "render/through_rects.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>
#include <random>

namespace kiln::render {
namespace {

using field::worlds::edit;

Instance glass_of(Shape shape, vec3 position, uint32_t material, float voxel = 0.02f) {
    auto set = field::BrickSet::make(field::worlds::compiled({edit(std::move(shape))}), voxel);
    EXPECT_TRUE(set) << (set ? "" : set.error().message);
    Instance out;
    out.bricks = *set;
    out.pose.position = out.before.position = position;
    out.material = out.glass = material;
    return out;
}

// A small black ball far below in a sky that shines the same from everywhere.
Frame bright_frame() {
    field::worlds::World world{"speck",
                               {edit(Sphere{0.1f}, {0, -9, 0})},
                               {.voxel_size = 0.05f, .bounds = {{-0.2f, -9.2f, -0.2f}, {0.2f, -8.8f, 0.2f}}}};
    Frame frame;
    frame.field = world.field();
    frame.materials.resize(4);
    frame.environment = Environment{.color = {1, 1, 1}};
    frame.camera.position = {0, 0, 4};
    frame.camera.tone_map = ToneMap::None;
    return frame;
}

struct ThroughGpu : testing::Test {
    void SetUp() override {
        renderer = renderer_or_skip();
        if (!renderer && !HasFailure()) GTEST_SKIP() << "no Vulkan device";
    }
    Picture picture(const Frame& frame, int width = 48, int height = 36) {
        return rhi::must(renderer->render(frame, {.width = width, .height = height}));
    }
    std::unique_ptr<Renderer> renderer;
};

vec3 middle(const Picture& p) {
    const float* c = &p.rgba[size_t(p.height / 2 * p.width + p.width / 2) * 4];
    return {c[0], c[1], c[2]};
}

TEST_F(ThroughGpu, ASlabLeavesWhatBeerAndLambertSay) {
    Frame frame = bright_frame();
    Material& m = frame.materials[1];
    m = {.base_color = {0, 0, 0}, .roughness = 0, .opacity = 1e-6f, .ior = 1, .attenuation_color = {0.8f, 0.4f, 0.1f}};
    m.attenuation_distance = 0.3f;
    for (const float thick : {0.02f, 0.137f, 0.3f, 0.55f}) {
        frame.instances = {glass_of(Box{{1.5f, 1.2f, thick / 2}}, {0.1f, 0.05f, 0.3f}, 1)};
        const Picture p = picture(frame);
        // Through the middle of the pixel, by the cosine.
        const shade::CameraParams eye = shade::camera_params(frame.camera, p.width, p.height);
        const vec3 d = shade::camera_direction_at(eye, float(p.width / 2) + 0.5f, float(p.height / 2) + 0.5f);
        const double way = double(thick) / double(-d.z);
        const vec3 got = middle(p);
        const double left[3] = {got.x, got.y, got.z}, color[3] = {0.8, 0.4, 0.1};
        for (size_t c = 0; c < 3; ++c) {
            const double wanted = std::pow(double(color[c]), way / 0.3);
            EXPECT_NEAR(left[c] / wanted, 1, 0.005) << thick << " m, channel " << c;
        }
        EXPECT_TRUE(std::isinf(p.depth[size_t(p.height / 2 * p.width + p.width / 2)])) << "depth is of what is solid";
    }
}

// In a sky that is one everywhere clear glass is not seen at all: what is not let through is reflected.
TEST_F(ThroughGpu, ClearGlassInAWhiteFurnaceVanishes) {
    Frame frame = bright_frame();
    frame.materials[1] = {.roughness = 0, .opacity = 1e-6f};
    frame.instances = {glass_of(Box{{1.5f, 1.2f, 0.2f}}, {}, 1)};
    const vec3 slab = middle(picture(frame));
    EXPECT_NEAR(slab.x, 1, 0.004f);
    frame.instances = {glass_of(Sphere{1}, {0, 0, 0}, 1, 0.05f)};
    const Picture ball = picture(frame);
    const shade::CameraParams eye = shade::camera_params(frame.camera, ball.width, ball.height);
    for (int y = 0; y < ball.height; ++y) {
        for (int x = 0; x < ball.width; ++x) {
            const vec3 d = shade::camera_direction_at(eye, float(x) + 0.5f, float(y) + 0.5f), o = frame.camera.position;
            // Not at the rim itself.
            if (std::fabs(std::sqrt(dot(o, o) - dot(o, d) * dot(o, d)) - 1) < 0.05f) continue;
            EXPECT_NEAR(ball.rgba[size_t(y * ball.width + x) * 4], 1, 0.01f) << x << ", " << y;
        }
    }
}

// Nor does rough glass lose or make light: what small surfaces do not let through they throw back.
TEST_F(ThroughGpu, RoughGlassInAWhiteFurnaceVanishes) {
    Frame frame = bright_frame();
    for (const float roughness : {0.2f, 0.5f, 0.9f}) {
        frame.materials[1] = {.roughness = roughness, .opacity = 1e-6f};
        frame.instances = {glass_of(Box{{0.6f, 0.8f, 0.2f}}, {-0.8f, 0, 0}, 1),
                           glass_of(Sphere{0.6f}, {0.7f, 0, 0}, 1)};
        const Picture p = picture(frame);
        float worst = 0;
        for (size_t i = 0; i < p.rgba.size(); ++i)
            if (i % 4 != 3) worst = std::max(worst, std::fabs(p.rgba[i] - 1));
        EXPECT_LT(worst, 0.015f) << roughness;
    }
}

// Nothing shines but a wall behind a dark slab: what the slab's top shows is the wall's light by Fresnel's share, and black where it is mirrored past it.
TEST_F(ThroughGpu, GlassMirrorsWhatIsSolid) {
    field::worlds::World world{"wall",
                               {edit(Box{.half_extents = {0.8f, 0.8f, 0.1f}}, {0, 0.9f, -2})},
                               {.voxel_size = 0.05f, .bounds = {{-1, 0, -2.2f}, {1, 1.8f, -1.8f}}}};
    Frame frame = bright_frame();
    frame.field = world.field();
    frame.environment = Environment{.color = {0, 0, 0}};
    frame.materials[0] = frame.materials[1] = {.base_color = {0, 0, 0}, .emissive = {2, 1, 0.5f}};
    frame.materials[2] = {
        .base_color = {0, 0, 0}, .roughness = 0, .opacity = 1e-6f, .attenuation_color = {1e-3f, 1e-3f, 1e-3f}};
    frame.materials[2].attenuation_distance = 0.01f;
    frame.instances = {glass_of(Box{{1.6f, 0.1f, 1.6f}}, {0, -0.1f, 0}, 2)};
    frame.camera.position = {0, 1, 3.5f};
    const Picture p = picture(frame, 96, 72);
    const shade::CameraParams eye = shade::camera_params(frame.camera, p.width, p.height);
    int wall = 0, past = 0;
    for (int y = 0; y < p.height; ++y) {
        for (int x = 0; x < p.width; ++x) {
            const vec3 d = shade::camera_direction_at(eye, float(x) + 0.5f, float(y) + 0.5f);
            if (d.y >= 0) continue;
            const vec3 at = frame.camera.position + d * (frame.camera.position.y / -d.y);
            if (std::fabs(at.x) > 1.4f || std::fabs(at.z) > 1.4f) continue;
            // Where the mirrored ray meets the wall's front.
            const float way = (-1.9f - at.z) / d.z;
            const vec3 there{at.x + d.x * way, -d.y * way, -1.9f};
            const float off = std::max(std::fabs(there.x) - 0.8f, std::fabs(there.y - 0.9f) - 0.8f);
            const float* c = &p.rgba[size_t(y * p.width + x) * 4];
            const float share = shade::dielectric_reflectance(-d.y, 1 / 1.5f);
            if (off < -0.06f) {
                EXPECT_NEAR(c[0], 2 * share, 0.06f) << x << ", " << y;
                EXPECT_NEAR(c[2], 0.5f * share, 0.02f) << x << ", " << y;
                ++wall;
            }
            if (off > 0.06f) {
                EXPECT_LT(c[0], 0.005f) << x << ", " << y;
                ++past;
            }
        }
    }
    EXPECT_GT(wall, 100);
    EXPECT_GT(past, 20);
}

// A ray through a ball leaves where two refractions in the plane of ray and middle take it.
TEST_F(ThroughGpu, ABallBendsRaysAsSnellSays) {
    Frame frame = bright_frame();
    frame.environment.reset();  // the clear sky: another colour in every direction
    frame.lights = {Light{.direction = {0, 1, 0.3f}, .illuminance = 0}};
    frame.materials[1] = {.base_color = {0, 0, 0}, .roughness = 0, .opacity = 1e-6f, .ior = 1.5f};
    frame.instances = {glass_of(Sphere{1}, {0, 0, 0}, 1)};
    frame.camera.position = {0, 0.3f, 4};
    const Picture p = picture(frame, 64, 48);
    const shade::CameraParams eye = shade::camera_params(frame.camera, p.width, p.height);
    const shade::SkyParams sky = shade::sky_params(frame);
    double worst = 0, sum = 0;
    int judged = 0;
    for (int y = 0; y < p.height; ++y) {
        for (int x = 0; x < p.width; ++x) {
            const vec3 d = shade::camera_direction_at(eye, float(x) + 0.5f, float(y) + 0.5f), o = frame.camera.position;
            const float b = dot(o, d), c = dot(o, o) - 1;
            if (b * b - c < 0.25f) continue;  // off the rim, where a pixel is much of the ball
            const vec3 n = o + d * (-b - std::sqrt(b * b - c));
            const float f = shade::dielectric_reflectance(-dot(d, n), 1 / 1.5f);
            const vec3 in = shade::refracted(d, n, 1 / 1.5f);
            const vec3 n_out = n - in * (2 * dot(n, in));
            const vec3 out = shade::refracted(in, n_out * -1.0f, 1.5f);
            const vec3 wanted =
                shade::sky_radiance(sky, out) * (1 - f) + shade::sky_radiance(sky, d + n * (-2 * dot(d, n))) * f;
            const float* got = &p.rgba[size_t(y * p.width + x) * 4];
            const double off = std::fabs(double(got[1] - wanted.y)) / double(wanted.y);
            worst = std::max(worst, off);
            sum += off;
            ++judged;
        }
    }
    ASSERT_GT(judged, 200);
    EXPECT_LT(sum / judged, 0.01);
    EXPECT_LT(worst, 0.08);
}

// A sheet of triangles that covers a share of what is behind.
std::shared_ptr<const model::Drawable> pane(vec3 color, float share) {
    model::Surface s = meshes::matte(color, 1);
    s.base_color.w = share;
    s.blend = s.double_sided = true;
    return meshes::sheet(-0.8f, -0.8f, 0.8f, 0.8f, s);
}

TEST_F(ThroughGpu, TheOrderOfListsChangesNoByte) {
    Frame frame = bright_frame();
    frame.environment->color = {0.6f, 0.7f, 0.9f};
    frame.lights = {Light{.illuminance = 2}};
    frame.materials[1] = {.base_color = {0.9f, 0.2f, 0.2f}, .roughness = 0.2f, .opacity = 0.4f, .ior = 1.3f};
    frame.materials[2] = {.base_color = {0.2f, 0.9f, 0.2f}, .roughness = 0.1f, .opacity = 0.3f};
    frame.materials[3] = {.roughness = 0.1f, .opacity = 0.1f, .attenuation_color = {0.2f, 0.4f, 1}};
    frame.materials[3].attenuation_distance = 0.2f;
    std::vector<Instance> things{glass_of(Box{{0.8f, 0.7f, 0.05f}}, {0.2f, 0.1f, 0.6f}, 1, 0.05f),
                                 glass_of(Box{{0.6f, 0.8f, 0.08f}}, {-0.2f, 0, -0.2f}, 2, 0.05f),
                                 glass_of(Sphere{0.4f}, {0, -0.2f, 0.1f}, 3, 0.05f)};
    const quat upright{0.70710678f, 0, 0, 0.70710678f};
    std::vector<MeshInstance> panes{meshes::at(pane({1, 0.8f, 0.1f}, 0.5f), {-0.3f, 0, 1}, upright),
                                    meshes::at(pane({0.1f, 0.3f, 1}, 0.3f), {0.3f, 0.2f, -0.6f}, upright)};
    std::vector<float> first;
    do {
        frame.instances = things;
        frame.meshes = panes;
        const Picture p = picture(frame);
        if (first.empty()) first = p.rgba;
        EXPECT_EQ(std::memcmp(first.data(), p.rgba.data(), first.size() * sizeof(float)), 0);
        std::swap(panes[0], panes[1]);
        std::rotate(things.begin(), things.begin() + 1, things.end());
    } while (things[0].glass != 1);
}

// Two panes of triangles: share by share, the far one first.
TEST_F(ThroughGpu, PanesCoverTheirShareFromFarToNear) {
    Frame frame = bright_frame();
    frame.environment->color = {0.25f, 0.25f, 0.25f};
    const quat upright{0.70710678f, 0, 0, 0.70710678f};
    const auto glow = [&](vec3 color, float share) {
        model::Surface s = meshes::matte({0, 0, 0}, 1);
        s.base_color.w = share;
        s.emissive = color;
        s.blend = s.double_sided = true;
        return meshes::sheet(-0.8f, -0.8f, 0.8f, 0.8f, s);
    };
    const auto alone = [&](const MeshInstance& m) {
        frame.meshes = {m};
        return middle(picture(frame));
    };
    const MeshInstance opaque_far = meshes::at(glow({0, 0, 2}, 1), {0, 0, -1}, upright),
                       opaque_near = meshes::at(glow({3, 0, 0}, 1), {0, 0, 1}, upright),
                       far = meshes::at(glow({0, 0, 2}, 0.5f), {0, 0, -1}, upright),
                       near = meshes::at(glow({3, 0, 0}, 0.25f), {0, 0, 1}, upright);
    const vec3 of_far = alone(opaque_far), of_near = alone(opaque_near);
    frame.meshes = {near, far};
    const vec3 got = middle(picture(frame));
    const float a = 64.0f / 255, b = 128.0f / 255;  // as eight bits have them
    const vec3 wanted = of_near * a + (of_far * b + vec3{0.25f, 0.25f, 0.25f} * (1 - b)) * (1 - a);
    EXPECT_NEAR(got.x, wanted.x, 0.01f);
    EXPECT_NEAR(got.y, wanted.y, 0.01f);
    EXPECT_NEAR(got.z, wanted.z, 0.01f);
}

// Six panes that cut each other: which is nearer changes across the picture. Every pixel against the list of what its ray meets, sorted.
TEST_F(ThroughGpu, PanesThatCutEachOtherAreWhatASortedListSays) {
    Frame frame = bright_frame();
    frame.environment->color = {0, 0, 0};
    struct Pane {
        vec3 color;
        double share;
        Transform place;
    };
    std::vector<Pane> panes;
    for (int i = 0; i < 6; ++i) {
        const float turn = 1.1f * float(i);
        Pane& pane = panes.emplace_back();
        pane.color = {i % 3 == 0 ? 3.0f : 0.2f, i % 3 == 1 ? 2.0f : 0.1f, i % 3 == 2 ? 2.5f : 0.4f};
        pane.share = (50 + 30 * i) / 255.0;
        const vec3 axis = normalize(vec3{1, 0.3f * std::sin(turn), 0.4f * std::cos(turn)});
        pane.place = {{0.1f * std::sin(turn), 0.1f * std::cos(turn), 0.15f * std::sin(2 * turn)},
                      axis_angle(axis, 1.57f + 0.5f * std::sin(2 * turn)),
                      {1, 1, 1}};
        model::Surface s = meshes::matte({0, 0, 0}, 1);
        s.base_color.w = float(pane.share);
        s.emissive = pane.color;
        s.blend = s.double_sided = true;
        frame.meshes.push_back(
            meshes::at(meshes::sheet(-0.8f, -0.8f, 0.8f, 0.8f, s), pane.place.position, pane.place.rotation));
    }
    const Picture p = rhi::must(renderer->render(frame, {.width = 96, .height = 72, .transparent_layers = 6}));
    const shade::CameraParams eye = shade::camera_params(frame.camera, p.width, p.height);
    int judged = 0, deep = 0, orders = 0;
    std::vector<size_t> before;
    double worst = 0;
    for (int i = 0; i < p.width * p.height; ++i) {
        const vec3 d = shade::camera_direction_at(eye, float(i % p.width) + 0.5f, float(i / p.width) + 0.5f);
        std::vector<std::pair<double, size_t>> met;
        bool sure = true;
        for (size_t k = 0; k < panes.size(); ++k) {
            const quat back = conjugate(panes[k].place.rotation);
            const vec3 o = rotate(back, frame.camera.position - panes[k].place.position), v = rotate(back, d);
            const double t = -double(o.y) / double(v.y);
            const double off =
                std::max(std::fabs(double(o.x) + t * double(v.x)), std::fabs(double(o.z) + t * double(v.z)));
            sure = sure && std::fabs(off - 0.8) > 1e-3 && std::fabs(double(v.y)) > 0.02;
            if (off < 0.8 && t > 0) met.emplace_back(t, k);
        }
        std::sort(met.begin(), met.end());
        for (size_t k = 1; k < met.size(); ++k) sure = sure && met[k].first - met[k - 1].first > 1e-3;
        if (!sure) continue;
        std::vector<size_t> order;
        double left = 1, sum[3] = {};
        for (const auto& [t, k] : met) {
            order.push_back(k);
            const double of[3] = {panes[k].color.x, panes[k].color.y, panes[k].color.z};
            for (size_t c = 0; c < 3; ++c) sum[c] += left * panes[k].share * of[c];
            left *= 1 - panes[k].share;
        }
        for (size_t c = 0; c < 3; ++c)
            worst = std::max(worst, std::fabs(double(p.rgba[4 * size_t(i) + c]) - sum[c]) - 0.01 * sum[c]);
        ++judged;
        deep += met.size() >= 5;
        orders += order != before;
        before = order;
    }
    EXPECT_GT(judged, 4000);
    EXPECT_GT(deep, 300);
    EXPECT_GT(orders, 100);
    EXPECT_LE(worst, 0.002) << "more than a hundredth";
}

// Dark glass goes over a bright sky: where it was three frames ago the sky is as bright as ever, and where it is it is as dark.
TEST_F(ThroughGpu, MovingGlassLeavesNoTrail) {
    Frame frame = bright_frame();
    frame.materials[1] = {.roughness = 0.3f, .opacity = 0.02f, .ior = 1.1f, .attenuation_color = {0.02f, 0.05f, 0.1f}};
    frame.materials[1].attenuation_distance = 0.3f;
    frame.instances = {glass_of(Box{{0.4f, 0.5f, 0.2f}}, {-1, 0, 0}, 1)};
    const RenderSettings settings{.width = 64, .height = 48, .taa = true};
    RenderSettings fresh = settings;
    fresh.cut = true;
    std::vector<Picture> pictures;
    for (int i = 0; i < 10; ++i) {
        Instance& glass = frame.instances[0];
        glass.before = glass.pose;
        glass.pose.position.x += 0.15f;
        pictures.push_back(rhi::must(renderer->render(frame, settings)));
    }
    const Picture again = rhi::must(renderer->render(frame, fresh));
    const Picture& last = pictures.back();
    const shade::CameraParams eye = shade::camera_params(frame.camera, last.width, last.height);
    const auto column = [&](float x) {
        return int(shade::camera_pixel(eye, vec3{x, 0, 0.2f} - frame.camera.position).x);
    };
    const float now = frame.instances[0].pose.position.x, left = now - 0.4f, right = now + 0.4f;
    int behind = 0, on = 0;
    for (int x = 1; x < last.width - 1; ++x) {
        const size_t at = size_t(last.height / 2 * last.width + x) * 4;
        if (x < column(left - 0.45f - 0.05f)) {  // left three frames ago
            EXPECT_NEAR(last.rgba[at], 1, 0.02f) << x;
            ++behind;
        }
        if (x > column(left + 0.1f) && x < column(right - 0.1f)) {
            EXPECT_NEAR(last.rgba[at], again.rgba[at], 0.05f) << x;
            EXPECT_LT(last.rgba[at], 0.5f) << x;
            ++on;
        }
    }
    EXPECT_GT(behind, 5);
    EXPECT_GT(on, 3);
}

TEST(Glass, ReflectsAsFresnelSays) {
    // Right angles; Brewster's angle, where only one polarisation is left; grazing; past the critical angle.
    EXPECT_NEAR(shade::dielectric_reflectance(1, 1 / 1.5f), 0.04f, 1e-6f);
    const float brewster = std::atan(1.5f), sine = std::sin(brewster);
    const float across = (1 - 1.5f * 1.5f) / (1 + 1.5f * 1.5f);  // sin(i - t) / sin(i + t), with i + t a right angle
    EXPECT_NEAR(shade::dielectric_reflectance(std::sqrt(1 - sine * sine), 1 / 1.5f), 0.5f * across * across, 1e-5f);
    EXPECT_NEAR(shade::dielectric_reflectance(0, 1 / 1.5f), 1.0f, 1e-6f);
    EXPECT_EQ(shade::dielectric_reflectance(std::cos(std::asin(0.67f)), 1.5f), 1.0f);
    EXPECT_LT(shade::dielectric_reflectance(std::cos(std::asin(0.66f)), 1.5f), 1.0f);
    // Snell, there and back.
    const vec3 d = normalize(vec3{0.6f, -0.8f, 0.1f}), n{0, 1, 0};
    const vec3 in = shade::refracted(d, n, 1 / 1.4f), back = shade::refracted(in, n, 1.4f);
    EXPECT_NEAR(std::hypot(in.x, in.z) * 1.4f, std::hypot(d.x, d.z), 1e-6f);
    EXPECT_NEAR(length(back - d), 0.0f, 1e-6f);
}

TEST(Glass, OnTheScreenIsWithinItsParts) {
    std::mt19937 random(7);
    const auto in = [&](float low, float high) { return std::uniform_real_distribution<float>(low, high)(random); };
    const PixelRect tile{40, 30, 200, 150};
    int seen = 0;
    for (int round = 0; round < 300; ++round) {
        Camera camera{.position = {0, 0, 0}, .target = {in(-1, 1), in(-1, 1), in(-1, 1)}};
        const shade::CameraParams eye = shade::camera_params(camera, 320, 240);
        std::vector<Box3> boxes;
        for (int i = 0; i < 1 + round % 3; ++i) {
            const vec3 at{in(-3, 3), in(-3, 3), in(-3, 3)}, half{in(0.01f, 1), in(0.01f, 1), in(0.01f, 1)};
            boxes.push_back({at - half, at + half});
        }
        const std::vector<PixelRect> parts = through_rects(boxes, eye, tile, 5000, 1 + 500 * (round % 5));
        for (size_t i = 0; i < parts.size(); ++i) {
            const PixelRect& r = parts[i];
            EXPECT_LE(r.width * r.height, 5000);
            EXPECT_TRUE(r.width > 0 && r.height > 0 && r.x >= 40 && r.y >= 30 && r.x + r.width <= 240 &&
                        r.y + r.height <= 180);
            for (size_t k = 0; k < i; ++k) {
                const PixelRect& other = parts[k];
                EXPECT_TRUE(r.x >= other.x + other.width || other.x >= r.x + r.width || r.y >= other.y + other.height ||
                            other.y >= r.y + r.height)
                    << "each pixel is drawn once";
            }
        }
        std::shuffle(boxes.begin(), boxes.end(), random);
        EXPECT_EQ(through_rects(boxes, eye, tile, 5000, 1 + 500 * (round % 5)), parts) << "in any order";
        for (int k = 0; k < 200; ++k) {
            const Box3& box = boxes[size_t(k) % boxes.size()];
            const vec3 p{in(box.min.x, box.max.x), in(box.min.y, box.max.y), in(box.min.z, box.max.z)};
            if (dot(p, {eye.forward.x, eye.forward.y, eye.forward.z}) <= 0) continue;
            const vec2 at = shade::camera_pixel(eye, p);
            if (at.x < 40 || at.y < 30 || at.x >= 240 || at.y >= 180) continue;
            ++seen;
            bool found = false;
            for (const PixelRect& r : parts)
                found = found || (int(at.x) >= r.x && int(at.x) < r.x + r.width && int(at.y) >= r.y &&
                                  int(at.y) < r.y + r.height);
            EXPECT_TRUE(found) << at.x << ", " << at.y;
        }
    }
    EXPECT_GT(seen, 500);
}

TEST(Glass, ThatStandsApartHasPartsOfItsOwn) {
    const shade::CameraParams eye = shade::camera_params(Camera{.position = {0, 0, 0}, .target = {0, 0, -1}}, 320, 240);
    const PixelRect tile{0, 0, 320, 240};
    const auto ball = [](float x, float y) { return Box3{{x - 0.1f, y - 0.1f, -5.1f}, {x + 0.1f, y + 0.1f, -4.9f}}; };
    const std::vector<Box3> two{ball(-2, 1), ball(2, -1)};
    const auto pixels = [](const std::vector<PixelRect>& parts) {
        int sum = 0;
        for (const PixelRect& r : parts) sum += r.width * r.height;
        return sum;
    };
    const auto apart = through_rects(two, eye, tile, 1 << 20, 1000),
               one = through_rects(two, eye, tile, 1 << 20, 1 << 20);
    EXPECT_EQ(apart.size(), 2u);
    EXPECT_EQ(one.size(), 1u);
    EXPECT_LT(10 * pixels(apart), pixels(one));
    std::vector<Box3> many;
    for (int i = 0; i < 400; ++i) many.push_back(ball(float(i % 20) * 0.25f - 2.4f, float(i / 20) * 0.25f - 2.4f));
    EXPECT_LE(through_rects(many, eye, tile, 1 << 20, 1).size(), 6u) << "each costs passes of its own";
    const std::vector<Box3> corners{ball(-2.4f, -2), ball(-2.4f, 2), ball(2.4f, -2), ball(2.4f, 2)};
    std::vector<Box3> near;
    for (const Box3& box : corners)
        for (int i = 0; i < 5; ++i)
            near.push_back(Box3{box.min + vec3(0.04f * float(i)), box.max + vec3(0.04f * float(i))});
    EXPECT_EQ(through_rects(near, eye, tile, 1 << 20, 1000).size(), 4u) << "what overlaps is one";
}

// The judge itself: what comes straight through a slab.
TEST(Glass, TheJudgesSlabAbsorbsAndReflects) {
    const Material m{.opacity = 0.25f, .ior = 1.5f, .attenuation_color = {0.5f, 1, 0.1f}, .attenuation_distance = 0.2f};
    const ReferenceGlass slab{[](dvec3 p) { return std::fabs(p.z) - 0.2; }, {{-9, -9, -0.2f}, {9, 9, 0.2f}}, m};
    const GlassTrace glass(std::span(&slab, 1));
    const vec3 left = glass.straight({0, 0, 3}, {0, 0, -1}, 10);
    const float surfaces = 0.96f * 0.96f * 0.75f;
    EXPECT_NEAR(left.x, surfaces * 0.25f, 1e-4f);
    EXPECT_NEAR(left.y, surfaces, 1e-4f);
    EXPECT_NEAR(left.z, surfaces * 0.01f, 1e-5f);
    EXPECT_NEAR(glass.straight({0, 0, 0.1}, {0, 0, -1}, 10).x, 0.96f * std::pow(0.5f, 1.5f), 1e-4f) << "from inside";
    EXPECT_EQ(glass.straight({0, 0, 3}, {0, 0, -1}, 2).x, 1.0f) << "the light is before it";
}

}  // namespace
}  // namespace kiln::render
