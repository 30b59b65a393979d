// SPDX-License-Identifier: MIT
// Starts threads.

#include "render/reference.h"

#include "render/lib/pack.h"
#include "render/lib/shadow_march.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <numbers>

using namespace kiln;
using namespace kiln::render;

namespace {

double length_of(dvec3 p) { return std::sqrt(p.x * p.x + p.y * p.y + p.z * p.z); }

ReferenceField sphere(const Material& material) {
    return {.distance = [](dvec3 p) { return length_of(p) - 1; },
            .normal = {},
            .material = [=](dvec3) { return material; },
            .bounds = {{-1, -1, -1}, {1, 1, 1}}};
}

const Camera kFront{.position = {0, 0, 3}, .target = {0, 0, 0}};

shade::SkyParams constant_sky(float radiance) {
    return shade::sky_params(Environment{.color = {radiance, radiance, radiance}});
}

}  // namespace

// Camera rays against the quadratic formula, and misses stay misses.
TEST(Reference, HitsAreWhereTheSphereIs) {
    const ReferenceField field = sphere({});
    for (int i = 0; i < 4000; ++i) {
        const double y = -1.2 + 2.4 * i / 3999;
        const dvec3 o{0.1, y, 5}, d{0, 0, -1};
        const double h = 1 - 0.01 - y * y, t = reference_hit(field, o, d, 100);
        if (h < 0) {
            EXPECT_LT(t, 0) << y;
        } else if (h > 1e-9) {
            EXPECT_NEAR(t, 5 - std::sqrt(h), 1e-9) << y;
        }
    }
    EXPECT_EQ(reference_hit(field, {0, 0, 0}, {1, 0, 0}, 10), 0) << "inside";
    EXPECT_LT(reference_hit(field, {0, 0, 5}, {0, 0, -1}, 3.9), 0) << "the ray ends before";
}

TEST(Reference, UnboundedFieldsAreMarched) {
    const float inf = std::numeric_limits<float>::infinity();
    const ReferenceField ground{.distance = [](dvec3 p) { return p.y; },
                                .normal = {},
                                .material = [](dvec3) { return Material{}; },
                                .bounds = {{-inf, -inf, -inf}, {inf, 0, inf}}};
    EXPECT_NEAR(reference_hit(ground, {0, 2, 0}, {0.6, -0.8, 0}, 100), 2.5, 1e-9);
    EXPECT_LT(reference_hit(ground, {0, 2, 0}, {1, 0, 0}, 100), 0);
    EXPECT_LT(reference_hit(ground, {0, 2, 0}, {0, 1, 0}, 100), 0);
}

// A white object in a constant sky cannot be told from the sky.
TEST(Reference, WhiteFurnace) {
    for (const float metallic : {0.0f, 1.0f}) {
        for (const float roughness : {0.3f, 0.6f, 1.0f}) {
            const ReferenceField field =
                sphere({.base_color = {1, 1, 1}, .roughness = roughness, .metallic = metallic});
            const ReferencePicture traced =
                render_reference(field, {}, constant_sky(1), kFront, {.width = 12, .height = 12, .samples = 400});
            const ReferencePicture direct =
                render_reference(field, {}, constant_sky(1), kFront, {.width = 12, .height = 12});
            double sum = 0;
            for (size_t i = 0; i < 144; ++i) {
                sum += traced.rgba[4 * i] / 144;
                EXPECT_NEAR(traced.rgba[4 * i], 1, 0.01 + 4 * traced.standard_error[i])
                    << "roughness " << roughness << ", metallic " << metallic;
                EXPECT_NEAR(direct.rgba[4 * i], 1, 0.01) << "roughness " << roughness << ", metallic " << metallic;
            }
            EXPECT_NEAR(sum, 1, 0.01) << "roughness " << roughness << ", metallic " << metallic;
        }
    }
}

// Inside a closed room that glows with radiance 1, light after n bounces is the sum of albedo^k for k <= n.
TEST(Reference, ClosedFurnaceIsAGeometricSum) {
    const double expected[][3] = {{0.5, 0, 1},       {0.5, 1, 1.5},  {0.5, 2, 1.75},  {0.5, 4, 1.9375},
                                  {0.5, 8, 1.99609}, {0.8, 2, 2.44}, {0.9, 4, 4.0951}};
    for (const auto& [albedo, bounces, radiance] : expected) {
        const float a = float(albedo);
        const ReferenceField room{.distance = [](dvec3 p) { return 1 - length_of(p); },
                                  .normal = {},
                                  .material =
                                      [=](dvec3) {
                                          return Material{.base_color = {a, a, a}, .emissive = {1, 1, 1}};
                                      },
                                  .bounds = {{-2, -2, -2}, {2, 2, 2}}};
        const Camera inside{.position = {0.2f, 0.1f, 0}, .target = {0, 0, -1}};
        const ReferencePicture picture =
            render_reference(room, {}, constant_sky(100), inside,
                             {.width = 4, .height = 4, .samples = 64, .most_bounces = int(bounces), .lambert = true});
        double sum = 0;
        for (size_t i = 0; i < 16; ++i) sum += picture.rgba[4 * i] / 16;
        EXPECT_NEAR(sum, radiance, 0.02 * radiance) << "albedo " << albedo << ", " << bounces << " bounces";
    }
}

// Lit from the eye, the mean of a Lambert sphere's disc is 2/3 of its middle, which is illuminance / pi.
TEST(Reference, LambertSphereMeanIsTwoThirdsOfItsPeak) {
    const Light sun{.direction = {0, 0, -1}, .position = {}, .illuminance = 1, .angular_diameter_deg = 0};
    const Camera far{.position = {0, 0, 400},
                     .target = {0, 0, 0},
                     .fov_y_deg = float(2 * std::atan(1.0 / 400) * 180 / std::numbers::pi)};
    for (const int samples : {0, 4}) {
        const ReferencePicture picture =
            render_reference(sphere({.base_color = {1, 1, 1}}), {&sun, 1}, constant_sky(0), far,
                             {.width = 65, .height = 65, .samples = samples, .lambert = true});
        double sum = 0;
        for (size_t i = 0; i < 65 * 65; ++i) sum += picture.rgba[4 * i];
        const double peak = picture.rgba[4 * (32 * 65 + 32)];
        EXPECT_NEAR(peak, 1 / std::numbers::pi, 2e-3);
        EXPECT_NEAR(sum / (65 * 65 * std::numbers::pi / 4) / (1 / std::numbers::pi), 2.0 / 3, 0.01)
            << samples << " samples";
        EXPECT_NEAR(picture.depth[32 * 65 + 32], 399, 1e-4);
        EXPECT_TRUE(std::isinf(picture.depth[0]));
    }
}

TEST(Reference, SameBytesForAnyNumberOfWorkers) {
    const ReferenceField field = sphere({.base_color = {0.7f, 0.4f, 0.2f}, .roughness = 0.4f});
    const Light lamp{.kind = Light::Kind::Point, .position = {2, 2, 2}, .intensity = 20, .radius = 0.3f};
    for (const int samples : {0, 8}) {
        auto picture = [&](int workers) {
            return render_reference(field, {&lamp, 1}, shade::default_sky(), kFront,
                                    {.width = 20, .height = 16, .samples = samples, .workers = workers});
        };
        const ReferencePicture one = picture(1);
        for (const int workers : {2, 3, 8})
            EXPECT_EQ(std::memcmp(picture(workers).rgba.data(), one.rgba.data(), one.rgba.size() * 4), 0) << workers;
    }
}

// The shadow that the passes march, against rays to the disc: a ball over a plane under a lamp. One straight edge stands
// for the ball's round one.
TEST(Reference, MarchedSoftShadowsAgreeWithCountedRays) {
    auto distance = [](dvec3 p) { return std::min(p.y, length_of({p.x, p.y - 1.5, p.z}) - 0.6); };
    const float inf = std::numeric_limits<float>::infinity();
    const ReferenceField field{.distance = distance,
                               .normal = {},
                               .material =
                                   [](dvec3) {
                                       return Material{.base_color = {1, 1, 1}};
                                   },
                               .bounds = {{-inf, -inf, -inf}, {inf, 2.1f, inf}}};
    const float height = 5, radius = 0.4f;
    const Light lamp{.kind = Light::Kind::Point, .position = {0, height, 0}, .intensity = 30, .radius = radius};
    const Light bare{.kind = Light::Kind::Point, .position = {0, height, 0}, .intensity = 30};
    // Nine pixels wide strip of the ground through the whole penumbra, seen steeply from the side.
    shade::SoftShadow shadow{[&](vec3 p) { return float(distance({p.x, p.y, p.z})); }};
    double worst = 0, mean = 0;
    int n = 0;
    for (float x = 0.5f; x <= 1.5f; x += 0.05f, ++n) {
        const Camera down{.position = {x + 3, 0.5f, 0}, .target = {x, 0, 0}, .fov_y_deg = 0.01f};
        const ReferenceSettings one{.width = 1, .height = 1, .shadow_samples = 1024, .lambert = true, .workers = 1};
        const double lit = render_reference(field, {&bare, 1}, constant_sky(0), down, one).rgba[0];
        const double soft = render_reference(field, {&lamp, 1}, constant_sky(0), down, one).rgba[0];
        const shade::LightSample light = shade::sample_light(shade::light_record(lamp), {x, 0, 0});
        const double unshadowed = light.illuminance.x * light.l.y / std::numbers::pi;
        const double marched =
            shadow.shadow_visible({x, 0, 0}, light.l, light.tan_radius, {1e-3f, light.distance, 1e-4f, 1e30f, 256});
        EXPECT_TRUE(lit == 0 || std::fabs(lit - unshadowed) < 1e-3 * unshadowed) << lit << " " << unshadowed;
        worst = std::max(worst, std::fabs(soft / unshadowed - marched));
        mean += soft / unshadowed - marched;
    }
    EXPECT_LE(worst, 0.06);
    EXPECT_LE(std::fabs(mean / n), 0.02);
}
