// SPDX-License-Identifier: MIT
// Starts threads.
// Images of the sky: where their texels lie, and the light that they give, against sums over the sphere.

#include "render/lib/environment_map.h"
#include "render/lib/pack.h"
#include "render/reference.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>

using namespace kiln;
using namespace kiln::render;
using namespace kiln::render::shade;

namespace {

constexpr double kPiD = std::numbers::pi;

image::FloatPixels image_of(int width, int height, const std::function<vec3(int, int)>& color) {
    image::FloatPixels out{width, height, 3, {}};
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            const vec3 c = color(x, y);
            out.values.insert(out.values.end(), {c.x, c.y, c.z});
        }
    }
    return out;
}

// Direction of a texel's middle, from the format's words: -Z in the middle, +Y on top, +X right of the middle.
vec3 direction_at(double u, double v) {
    const double turn = 2 * kPiD * (u - 0.5), fall = kPiD * v;
    return {float(std::sin(fall) * std::sin(turn)), float(std::cos(fall)), float(-std::sin(fall) * std::cos(turn))};
}

image::FloatPixels image_of_directions(int width, int height, const std::function<vec3(vec3)>& color) {
    return image_of(width, height,
                    [&](int x, int y) { return color(direction_at((x + 0.5) / width, (y + 0.5) / height)); });
}

// Mean of `color` with weights by direction, summed over the sphere.
vec3 mean_over_sphere(const std::function<vec3(vec3)>& color, const std::function<double(vec3)>& weight) {
    const int width = 512, height = 256;
    double sum[3] = {}, total = 0;
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            const vec3 d = direction_at((x + 0.5) / width, (y + 0.5) / height);
            const double w = weight(d) * std::sin(kPiD * (y + 0.5) / height);
            if (w <= 0) continue;
            const vec3 c = color(d);
            sum[0] += w * double(c.x), sum[1] += w * double(c.y), sum[2] += w * double(c.z), total += w;
        }
    }
    return {float(sum[0] / total), float(sum[1] / total), float(sum[2] / total)};
}

// No symmetry, and nothing that nine harmonics do not hold.
vec3 smooth(vec3 d) {
    return {1 + 0.5f * d.x + 0.3f * d.y * d.z, 1 - 0.4f * d.z + 0.3f * d.x * d.y,
            1 + 0.6f * d.y * d.y - 0.5f * d.x * d.z};
}

const vec3 kDirections[] = {{1, 0, 0},
                            {-1, 0, 0},
                            {0, 1, 0},
                            {0, -1, 0},
                            {0, 0, 1},
                            {0, 0, -1},
                            normalize(vec3{1, 2, -3}),
                            normalize(vec3{-2, -1, 0.5f})};

}  // namespace

TEST(Environment, ConstantImagesGiveTheirRadianceEverywhere) {
    for (const int width : {2, 7, 64}) {
        const EnvironmentMap map = make_environment_map(image_of(width, std::max(width / 2, 1), [](int, int) {
            return vec3{0.25f, 0.7f, 30};
        }));
        EnvironmentLight light{map.words};
        for (const vec3 d : kDirections) {
            EXPECT_NEAR(light.environment_radiance(d).y, 0.7, 1e-6);
            EXPECT_NEAR(light.environment_ambient(d).x, 0.25, 1e-6);
            EXPECT_NEAR(light.environment_ambient(d).z, 30, 1e-4);
            for (const float roughness : {0.0f, 0.1f, 0.5f, 0.77f, 1.0f})
                EXPECT_NEAR(light.environment_reflection(d, roughness).y, 0.7, 1e-5) << roughness;
        }
    }
}

TEST(Environment, TexelsLieWhereTheFormatSays) {
    // A colour for each of the four quarters of the horizon, other ones above and below.
    const image::FloatPixels image = image_of(16, 9, [](int x, int y) {
        if (y < 2) return vec3{0, 9, 0};
        if (y > 6) return vec3{0, 0, 9};
        return vec3{float((x + 2) % 16 / 4), 0, 0};
    });
    const EnvironmentMap map = make_environment_map(image);
    EnvironmentLight light{map.words};
    EXPECT_EQ(light.environment_radiance({0, 0, -1}).x, 2) << "the middle";
    EXPECT_EQ(light.environment_radiance({1, 0, 0}).x, 3) << "right of it";
    EXPECT_EQ(light.environment_radiance({0, 0, 1}).x, 0) << "both ends";
    EXPECT_EQ(light.environment_radiance({1e-6f, 0, 1}).x, 0);
    EXPECT_EQ(light.environment_radiance({-1e-6f, 0, 1}).x, 0);
    EXPECT_EQ(light.environment_radiance({-1, 0, 0}).x, 1) << "left";
    EXPECT_EQ(light.environment_radiance({0, 1, 0}).y, 9) << "above";
    EXPECT_EQ(light.environment_radiance({0, -1, 0}).z, 9) << "below";
    // And what they light faces them.
    EXPECT_GT(light.environment_ambient({0, 1, 0}).y, light.environment_ambient({0, -1, 0}).y);
    EXPECT_GT(light.environment_ambient({1, 0, 0}).x, light.environment_ambient({0, 0, 1}).x);
    EXPECT_GT(light.environment_reflection({1, 0, 0}, 0.5f).x, light.environment_reflection({0, 0, -1}, 0.5f).x);
    EXPECT_GT(light.environment_reflection({0, 0, -1}, 0.5f).x, light.environment_reflection({-1, 0, 0}, 0.5f).x);
}

TEST(Environment, AmbientIsTheCosineWeightedMean) {
    const EnvironmentMap map = make_environment_map(image_of_directions(128, 64, smooth));
    EnvironmentLight light{map.words};
    for (const vec3 n : kDirections) {
        const vec3 expected = mean_over_sphere(smooth, [&](vec3 d) { return double(std::max(dot(n, d), 0.0f)); });
        EXPECT_LE(length(light.environment_ambient(n) - expected), 2e-3f) << n.x << " " << n.y << " " << n.z;
    }
    // A small bright sun is more than nine harmonics hold; what they leave out is known to be small.
    const auto sunny = [](vec3 d) {
        return dot(d, normalize(vec3{1, 1, 0.5f})) > 0.98f ? vec3{40, 40, 40} : vec3{1, 1, 1};
    };
    const EnvironmentMap sun = make_environment_map(image_of_directions(256, 128, sunny));
    EnvironmentLight of_sun{sun.words};
    for (const vec3 n : kDirections) {
        const vec3 expected = mean_over_sphere(sunny, [&](vec3 d) { return double(std::max(dot(n, d), 0.0f)); });
        EXPECT_NEAR(of_sun.environment_ambient(n).x, expected.x, 0.2) << n.x << " " << n.y << " " << n.z;
    }
}

TEST(Environment, ReflectionIsTheMeanOverTheLobe) {
    const auto patches = [](vec3 d) { return vec3{d.x > 0.2f ? 3.0f : 0.5f, 1 + d.y, d.z * d.z}; };
    const EnvironmentMap map = make_environment_map(image_of_directions(512, 256, patches));
    EnvironmentLight light{map.words};
    for (const float roughness : {0.25f, 0.5f, 0.75f, 1.0f}) {
        const double a2 = std::pow(double(roughness), 4);
        for (const vec3 r : kDirections) {
            // Density of reflected directions seen along the middle of the lobe: D / 4, times the cosine.
            const vec3 expected = mean_over_sphere(patches, [&](vec3 d) {
                const double c = double(dot(r, d)), h2 = 0.5 * (1 + c), q = h2 * (a2 - 1) + 1;
                return c <= 0 ? 0.0 : c * a2 / (q * q);
            });
            EXPECT_LE(length(light.environment_reflection(r, roughness) - expected), 0.06f)
                << roughness << ": " << r.x << " " << r.y << " " << r.z;
        }
    }
}

TEST(Environment, SameWordsForAnyNumberOfWorkers) {
    const image::FloatPixels image = image_of_directions(64, 32, smooth);
    const EnvironmentMap one = make_environment_map(image, 1);
    for (const int workers : {2, 3, 8}) EXPECT_EQ(make_environment_map(image, workers).words, one.words) << workers;
}

TEST(Environment, WhatIsNegativeCountsAsNothingAndLargeImagesAreMadeSmaller) {
    const EnvironmentMap map = make_environment_map(image_of(kEnvironmentWidth + 2, 2, [](int x, int) {
        return vec3{x % 2 ? 2.0f : -5.0f, 1, 1};
    }));
    EXPECT_EQ(map.words[kEnvironmentLevels + 1], uint(kEnvironmentWidth));
    EnvironmentLight light{map.words};
    EXPECT_NEAR(light.environment_ambient({0, 1, 0}).x, 1, 1e-4);
    for (const vec3 d : kDirections) EXPECT_GE(light.environment_radiance(d).x, 0);
}

// A white object under a constant image looks exactly as bright, in both ways of the reference.
TEST(Environment, WhiteFurnaceOfTheReference) {
    const EnvironmentMap map = make_environment_map(image_of(8, 4, [](int, int) { return vec3{0.5f, 0.5f, 0.5f}; }));
    for (const float metallic : {0.0f, 1.0f}) {
        const ReferenceField ball{
            .distance = [](dvec3 p) { return std::sqrt(p.x * p.x + p.y * p.y + p.z * p.z) - 1; },
            .normal = {},
            .material =
                [=](dvec3) {
                    return Material{.base_color = {1, 1, 1}, .roughness = 0.5f, .metallic = metallic};
                },
            .bounds = {{-1, -1, -1}, {1, 1, 1}}};
        for (const int samples : {0, 256}) {
            const ReferencePicture picture =
                render_reference(ball, {}, sky_params(Environment{.intensity = 2, .file = "constant"}),
                                 Camera{.position = {0, 0, 3}, .target = {0, 0, 0}},
                                 {.width = 12, .height = 12, .samples = samples, .environment = &map});
            for (size_t i = 0; i < 144; ++i)
                EXPECT_NEAR(picture.rgba[4 * i], 1, 0.01 + 4 * picture.standard_error[i]) << samples << " " << metallic;
        }
    }
}
