// SPDX-License-Identifier: MIT

#include "render/lib/pack.h"
#include "render/lib/shading.gpu.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

using namespace kiln::render::shade;
using kiln::Light;
using kiln::vec3;

TEST(Lights, DirectionalIsTheSameEverywhere) {
    const LightRecord sun = light_record({.color = {1, 0.5f, 0.25f},
                                          .direction = {0, -2, 0},
                                          .position = {},
                                          .illuminance = 4,
                                          .angular_diameter_deg = 2});
    for (const vec3 p : {vec3{0, 0, 0}, vec3{1e5f, -3, 7}}) {
        const LightSample s = sample_light(sun, p);
        EXPECT_EQ(s.l, (vec3{0, 1, 0}));
        EXPECT_EQ(s.illuminance, (vec3{4, 2, 1}));
        EXPECT_NEAR(s.tan_radius, std::tan(std::numbers::pi / 180), 1e-7);
    }
}

TEST(Lights, PointFallsOffWithTheSquareAndEndsAtItsRange) {
    Light lamp{.kind = Light::Kind::Point, .position = {0, 3, 0}, .intensity = 20};
    for (const float d : {0.5f, 1.0f, 2.0f, 100.0f}) {
        EXPECT_NEAR(sample_light(light_record(lamp), {0, 3 - d, 0}).illuminance.x, 20 / (d * d), 1e-4 * 20 / (d * d));
    }
    lamp.range = 10;
    // KHR_lights_punctual: max(min(1 - (d / range)^4, 1), 0) / d².
    for (const float d : {1.0f, 5.0f, 9.0f}) {
        const double expected = 20 * (1 - std::pow(d / 10, 4)) / (d * d);
        EXPECT_NEAR(sample_light(light_record(lamp), {d, 3, 0}).illuminance.x, expected, 1e-4 * expected);
    }
    EXPECT_EQ(sample_light(light_record(lamp), {10, 3, 0}).illuminance.x, 0);
    EXPECT_EQ(sample_light(light_record(lamp), {50, 3, 0}).illuminance.x, 0);
    const LightSample inside = sample_light(light_record(lamp), {0, 3, 0});
    EXPECT_TRUE(std::isfinite(inside.illuminance.x) && std::isfinite(inside.l.x) && std::isfinite(inside.tan_radius));
}

// A sphere of radiance L and radius r lights a surface that faces it with pi (r/d)² L; its intensity is pi r² L.
TEST(Lights, ASphereLightGivesWhatItsSolidAngleDoes) {
    const float r = 0.5f, radiance = 1;
    const Light sphere{.kind = Light::Kind::Point,
                       .position = {0, 0, 0},
                       .intensity = std::numbers::pi_v<float> * r * r * radiance,
                       .radius = r};
    EXPECT_NEAR(sample_light(light_record(sphere), {1, 0, 0}).illuminance.x, 0.785398, 1e-5);
    EXPECT_NEAR(sample_light(light_record(sphere), {2, 0, 0}).illuminance.x, 0.196350, 1e-5);
    EXPECT_NEAR(sample_light(light_record(sphere), {2, 0, 0}).tan_radius, 0.25, 1e-6);
}

TEST(Lights, SpotIsFullInsideItsInnerConeAndDarkOutsideTheOuter) {
    const Light spot{.kind = Light::Kind::Spot,
                     .direction = {0, -1, 0},
                     .position = {0, 1, 0},
                     .intensity = 20,
                     .inner_deg = 15,
                     .outer_deg = 25};
    const LightRecord record = light_record(spot);
    double before = 20.001;
    for (double degrees = 0; degrees < 60; degrees += 0.25) {
        const double a = degrees * std::numbers::pi / 180;
        const vec3 p{float(std::sin(a)), float(1 - std::cos(a)), 0};
        const double e = sample_light(record, p).illuminance.x;
        if (degrees <= 15) {
            EXPECT_NEAR(e, 20, 2e-3) << degrees;
        } else if (degrees >= 25.1) {
            EXPECT_EQ(e, 0) << degrees;
        }
        EXPECT_LE(e, before + 1e-3) << degrees;
        before = e;
    }
}

// Lambert sphere: the mean over its disc, seen along the light, is 2/3 of the peak, and the brightness by phase angle a is
// (sin a + (pi - a) cos a) / pi of that.
TEST(Lights, LambertSphereHasItsPhaseFunction) {
    SurfaceOptics lambert = surface_optics({1, 1, 1}, 0, 1);
    lambert.dielectric_f0 = 0;
    lambert.f90 = 0;
    const double expected[][2] = {{0, 1}, {45, 0.75541}, {90, 0.31831}, {135, 0.04830}};
    for (const auto& [degrees, share] : expected) {
        const double a = degrees * std::numbers::pi / 180;
        LightSample light{};
        light.l = {float(std::sin(a)), 0, float(std::cos(a))};
        light.illuminance = {1, 1, 1};
        double sum = 0, peak = 0;
        const int side = 300;
        for (int i = 0; i < side; ++i) {
            for (int j = 0; j < side; ++j) {
                const double x = 2 * (i + 0.5) / side - 1, y = 2 * (j + 0.5) / side - 1, rr = x * x + y * y;
                if (rr >= 1) continue;
                const vec3 n{float(x), float(y), float(std::sqrt(1 - rr))};
                const double seen = shade_light(surface_view(lambert, n, {0, 0, 1}), light, 1).x;
                sum += seen * 4 / (side * side) / std::numbers::pi;
                peak = std::max(peak, seen);
            }
        }
        if (degrees == 0) {
            EXPECT_NEAR(peak, 1 / std::numbers::pi, 1e-4);
        }
        EXPECT_NEAR(sum * std::numbers::pi, 2.0 / 3 * share, 2e-3) << degrees << " degrees";
    }
}
