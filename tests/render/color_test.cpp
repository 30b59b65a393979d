// SPDX-License-Identifier: MIT

#include "render/lib/color.gpu.h"
#include "render/lib/octahedral.gpu.h"
#include "render/lib/pack.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

using namespace kiln::render::shade;
using kiln::vec3;

TEST(Color, SrgbCurveIsTheExactOne) {
    EXPECT_NEAR(srgb_from_linear(0.001f), 0.012920, 1e-6);
    EXPECT_NEAR(srgb_from_linear(0.18f), 0.461356, 1e-6);
    EXPECT_NEAR(srgb_from_linear(0.5f), 0.735357, 1e-6);
    EXPECT_EQ(srgb_from_linear(0), 0);
    EXPECT_NEAR(srgb_from_linear(1), 1, 1e-6);
    EXPECT_EQ(srgb_from_linear(-3), 0);
    EXPECT_EQ(srgb_from_linear(std::numeric_limits<float>::quiet_NaN()), 0);
    EXPECT_NEAR(srgb_from_linear(1e9f), 1, 1e-6);
}

TEST(Color, EveryByteSurvivesTheRoundTrip) {
    for (uint i = 0; i < 256; ++i) EXPECT_EQ(byte_from_unit(srgb_from_linear(linear_from_srgb(float(i) / 255))), i);
}

TEST(Octahedral, RoundTripTurnsByLessThanAHundredthOfADegree) {
    double worst = 0;
    for (int i = 0; i < 20000; ++i) {
        const double z = 1 - 2 * (i + 0.5) / 20000, phi = i * 2.39996322972865332, s = std::sqrt(1 - z * z);
        const vec3 n{float(s * std::cos(phi)), float(s * std::sin(phi)), float(z)};
        const vec3 m = unpack_unit(pack_unit(n));
        worst = std::max(worst, double(length(cross(n, m))));
        EXPECT_GT(dot(n, m), 0.99f);
        EXPECT_NEAR(length(m), 1, 1e-6);
    }
    EXPECT_LE(worst * 180 / std::numbers::pi, 0.01);
}

TEST(Octahedral, AxesAreExact) {
    for (const vec3 n : {vec3{1, 0, 0}, vec3{-1, 0, 0}, vec3{0, 1, 0}, vec3{0, -1, 0}, vec3{0, 0, 1}, vec3{0, 0, -1}}) {
        const vec3 m = unpack_unit(pack_unit(n));
        EXPECT_TRUE(m == n) << n.x << " " << n.y << " " << n.z << " came back as " << m.x << " " << m.y << " " << m.z;
    }
}

TEST(Basis, IsRightHandedAndOrthonormal) {
    for (int i = 0; i < 5000; ++i) {
        const double z = 1 - 2 * i / 4999.0, phi = i * 2.39996322972865332, s = std::sqrt(std::max(0.0, 1 - z * z));
        const vec3 n{float(s * std::cos(phi)), float(s * std::sin(phi)), float(z)};
        const Basis b = basis_around(n);
        EXPECT_NEAR(dot(b.tangent, n), 0, 1e-6);
        EXPECT_NEAR(dot(b.bitangent, n), 0, 1e-6);
        EXPECT_NEAR(length(cross(b.tangent, b.bitangent) - n), 0, 2e-6);
    }
}

TEST(Camera, RaysGoThroughThePixelsTheyName) {
    kiln::Camera camera{.position = {1, 2, 3}, .target = {1, 2, -7}, .fov_y_deg = 90};
    const CameraParams p = camera_params(camera, 200, 100);
    const vec3 middle = camera_direction_at(p, 100, 50), top = camera_direction_at(p, 100, 0),
               right = camera_direction_at(p, 200, 50);
    EXPECT_NEAR(length(middle - vec3{0, 0, -1}), 0, 1e-6);
    EXPECT_NEAR(length(top - normalize(vec3{0, 1, -1})), 0, 1e-6) << "the upper edge is 45 degrees up";
    EXPECT_NEAR(length(right - normalize(vec3{2, 0, -1})), 0, 1e-6);
    EXPECT_EQ(reversed_depth(kNearPlane, kNearPlane), 1);
    EXPECT_NEAR(view_distance(kNearPlane, reversed_depth(kNearPlane, 123)), 123, 1e-4);
}

TEST(Camera, DegenerateOnesStillGiveFiniteRays) {
    const kiln::Camera cameras[] = {{.position = {0, 5, 0}, .target = {0, 0, 0}},
                                    {.position = {1, 1, 1}, .target = {1, 1, 1}},
                                    {.position = {0, 0, 0}, .target = {0, 0, -1}, .up = {0, 0, 0}}};
    for (const kiln::Camera& camera : cameras) {
        const vec3 d = camera_direction_at(camera_params(camera, 64, 48), 0.5f, 0.5f);
        EXPECT_NEAR(length(d), 1, 1e-5);
    }
}

TEST(Sky, MeetsItsThreeColorsAndAConstantIsConstant) {
    const SkyParams sky = default_sky();
    EXPECT_NEAR(sky_radiance(sky, {0, 1, 0}).z, 0.62f, 1e-5);
    EXPECT_NEAR(sky_radiance(sky, {1, 0, 0}).z, 0.84f, 1e-5);
    EXPECT_NEAR(sky_radiance(sky, {0, -1, 0}).z, 0.16f, 1e-5);
    const SkyParams flat = sky_params(kiln::Environment{.color = {0.5f, 0.6f, 0.8f}, .intensity = 2});
    for (const vec3 d : {vec3{0, 1, 0}, vec3{1, 0, 0}, vec3{0, -1, 0}, normalize(vec3{1, 2, 3})}) {
        EXPECT_NEAR(sky_radiance(flat, d).x, 1, 1e-6);
        EXPECT_NEAR(sky_ambient(flat, d).y, 1.2, 1e-6);
        EXPECT_NEAR(sky_reflection(flat, d, 0.3f).z, 1.6, 1e-6);
    }
}

// The closed form against the integral it stands for.
TEST(Sky, AmbientIsTheCosineWeightedMean) {
    SkyParams sky = default_sky();
    sky.sun.w = 2;
    for (const vec3 n : {vec3{0, 1, 0}, vec3{1, 0, 0}, normalize(vec3{1, -2, 0.5f})}) {
        const Basis b = basis_around(n);
        double sum = 0;
        const int side = 200;
        for (int i = 0; i < side; ++i) {
            for (int j = 0; j < side; ++j) {  // cosine-weighted: u = cosine²
                const double c = std::sqrt((i + 0.5) / side), s = std::sqrt(1 - c * c),
                             phi = 2 * std::numbers::pi * (j + 0.5) / side;
                sum += sky_radiance(sky, n * float(c) + b.tangent * float(s * std::cos(phi)) +
                                             b.bitangent * float(s * std::sin(phi)))
                           .y;
            }
        }
        EXPECT_NEAR(sky_ambient(sky, n).y, sum / (side * side), 1e-3);
    }
}
