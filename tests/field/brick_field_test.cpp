// SPDX-License-Identifier: MIT
// Starts threads.
#include "field/brick_field.h"

#include "base/parallel_for.h"
#include "worlds.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <random>

using namespace kiln;
using namespace kiln::field;
using worlds::compiled;
using worlds::edit;

namespace {

std::vector<Edit> hills() {
    std::vector<Edit> out{edit(Plane{})};
    std::mt19937 rng(7);
    const auto uniform = [&](float a, float b) { return std::uniform_real_distribution<float>(a, b)(rng); };
    for (int i = 0; i < 40; ++i)
        out.push_back(edit(Sphere{.radius = uniform(0.4f, 1.5f)},
                           {uniform(-5, 5), uniform(-0.5f, 0.5f), uniform(-5, 5)},
                           i % 4 == 0 ? Op::Subtract : Op::Union, 0.3f));
    return out;
}
std::shared_ptr<const ProgramField> exact_of(const std::vector<Edit>& edits) {
    return std::make_shared<const ProgramField>(compiled(edits));
}
std::vector<vec3> some_points(int count, float reach, uint32_t seed) {
    std::mt19937 rng(seed);
    const auto uniform = [&](float a, float b) { return std::uniform_real_distribution<float>(a, b)(rng); };
    std::vector<vec3> out;
    for (int i = 0; i < count; ++i) out.push_back({uniform(-reach, reach), uniform(-2, 2), uniform(-reach, reach)});
    return out;
}
std::vector<uint32_t> bits_of(const BrickField& field, const std::vector<vec3>& points) {
    std::vector<uint32_t> out;
    for (const vec3 p : points) {
        vec3 g;
        const float d = field.distance(p, g);
        for (const float v : {d, g.x, g.y, g.z}) out.push_back(std::bit_cast<uint32_t>(v));
    }
    return out;
}

TEST(BrickField, IsTheExactFieldAtTexelsAndNearItBetween) {
    const auto exact = exact_of(hills());
    const BrickField bricks(exact, {.voxel_size = 0.1f, .near = 0.5f});
    for (const vec3 p : some_points(4000, 6, 1)) {
        const vec3 texel{std::round(p.x * 10) * 0.1f, std::round(p.y * 10) * 0.1f, std::round(p.z * 10) * 0.1f};
        EXPECT_NEAR(bricks.distance(texel), exact->distance(texel), 2e-5f);
        // A trilinear interpolant of a 1-Lipschitz field is off by at most the mean distance to its corners.
        EXPECT_NEAR(bricks.distance(p), exact->distance(p), 0.08661f);
        vec3 g;
        const float h = 1e-3f, d = bricks.distance(p, g);
        const vec3 ahead{p.x + h, p.y, p.z};
        // The gradient is the interpolant's own, but for steps into another voxel.
        if (std::floor(p.x * 10) == std::floor(ahead.x * 10) && std::abs(d) < 0.4f) {
            EXPECT_NEAR((bricks.distance(ahead) - d) / h, g.x, 2e-2f);
        }
    }
    EXPECT_GT(bricks.brick_count(), 100u);
}

TEST(BrickField, FarFromTheSurfaceAndTheOriginItIsTheExactField) {
    const auto exact = exact_of(hills());
    const BrickField bricks(exact, {.voxel_size = 0.05f, .near = 0.1f});
    for (const vec3 p : {vec3{0, 40, 0}, vec3{3, -30, 2}, vec3{2000, 0.01f, 0}, vec3{-1e6f, 3, 9}})
        EXPECT_EQ(bricks.distance(p), exact->distance(p));
}

TEST(BrickField, AnswersDoNotDependOnOrderThreadsOrRoom) {
    const auto exact = exact_of(hills());
    const BrickFieldOptions options{.voxel_size = 0.1f, .near = 0.3f};
    const std::vector<vec3> points = some_points(3000, 6, 2);
    const BrickField first(exact, options);
    const std::vector<uint32_t> expected = bits_of(first, points);
    std::vector<vec3> backwards(points.rbegin(), points.rend());
    const BrickField second(exact, options);
    (void)bits_of(second, backwards);
    EXPECT_EQ(bits_of(second, points), expected);
    BrickFieldOptions few = options;
    few.most_bricks = 5;
    const BrickField crowded(exact, few);
    EXPECT_EQ(bits_of(crowded, points), expected);
    EXPECT_LE(crowded.brick_count(), 6u);
    const BrickField shared(exact, options);
    std::vector<std::vector<uint32_t>> each(4);
    parallel_for(4, 4, [&](int i) { each[size_t(i)] = bits_of(shared, i % 2 == 0 ? points : backwards); });
    EXPECT_EQ(each[0], expected);
    EXPECT_EQ(each[2], expected);
    EXPECT_EQ(each[1], each[3]);
}

TEST(BrickField, AfterAnEditItIsTheFieldMadeFromNothingAndKeepsWhatStays) {
    std::vector<Edit> edits = hills();
    const BrickFieldOptions options{.voxel_size = 0.1f, .near = 0.3f};
    auto field = std::make_shared<const BrickField>(exact_of(edits), options);
    const std::vector<vec3> points = some_points(3000, 6, 3);
    for (int round = 0; round < 4; ++round) {
        (void)bits_of(*field, points);
        const vec3 at = some_points(1, 4, 50 + uint32_t(round))[0];
        edits.push_back(edit(Sphere{.radius = 0.6f}, at, round % 2 == 0 ? Op::Subtract : Op::Union, 0.1f));
        const Box3 changed = Box3{at, at}.inflated(0.6f + 0.1f);
        field = field->after(exact_of(edits), changed);
        EXPECT_EQ(field->brick_count(), 0u) << "nothing is copied";
        EXPECT_EQ(bits_of(*field, points), bits_of(BrickField(exact_of(edits), options), points)) << round;
        EXPECT_GT(field->taken_over(), field->brick_count() / 3);
        EXPECT_LT(field->taken_over(), field->brick_count());
    }
}

TEST(BrickField, WhatNobodyAskedForBetweenEditsIsTakenOverFromBeforeThemAndNotForEver) {
    std::vector<Edit> edits = hills();
    const BrickFieldOptions options{.voxel_size = 0.1f, .near = 0.3f};
    auto field = std::make_shared<const BrickField>(exact_of(edits), options);
    const std::vector<vec3> points = some_points(3000, 6, 3);
    (void)bits_of(*field, points);
    // Far apart, so that each reaches a few cells; seven hide what the first reached if any does.
    for (int round = 0; round < 7; ++round) {
        const vec3 at{1.5f * float(round) - 4.5f, 0, 3};
        edits.push_back(edit(Sphere{.radius = 0.3f}, at, Op::Subtract));
        field = field->after(exact_of(edits), Box3{at, at}.inflated(0.3f));
    }
    EXPECT_EQ(bits_of(*field, points), bits_of(BrickField(exact_of(edits), options), points));
    EXPECT_GT(field->taken_over(), field->brick_count() / 4);
    // Nobody asks for long: then nothing is left of it.
    for (int round = 0; round < 9; ++round) field = field->after(exact_of(edits), {});
    (void)bits_of(*field, points);
    EXPECT_EQ(field->taken_over(), 0u);
}

TEST(BrickField, WhatWasNotAskedForLatelyMakesRoom) {
    BrickFieldOptions options{.voxel_size = 0.1f, .near = 0.3f, .most_bricks = 64};
    std::shared_ptr<const SdfField> field = std::make_shared<const BrickField>(exact_of(hills()), options);
    EXPECT_EQ(field->renewed(), nullptr);
    for (const vec3 p : some_points(500, 6, 4)) (void)field->distance(p);
    const auto next = field->renewed();
    ASSERT_NE(next, nullptr);
    const auto& kept = static_cast<const BrickField&>(*next);
    EXPECT_EQ(kept.brick_count(), 64u) << "all were asked for in this round";
    (void)kept.distance({0, 0, 0});
    (void)kept.renewed();
    const auto third = next->renewed();
    ASSERT_NE(third, nullptr);
    EXPECT_LT(static_cast<const BrickField&>(*third).brick_count(), 2u);
}

TEST(BrickField, ASmallTableAfterAnEditGrowsBetweenStepsAndSaysTheSame) {
    const auto exact = exact_of(hills());
    const BrickFieldOptions options{.voxel_size = 0.02f, .near = 0.05f};
    const BrickField first(exact, options);
    auto field = std::static_pointer_cast<const SdfField>(first.after(exact, {}));
    const std::vector<vec3> points = some_points(12000, 5, 9);
    const std::vector<uint32_t> expected = bits_of(first, points);
    int grown = 0;
    for (int step = 0; step < 6; ++step) {
        EXPECT_EQ(bits_of(static_cast<const BrickField&>(*field), points), expected);
        if (auto next = field->renewed()) field = std::move(next), ++grown;
    }
    EXPECT_GE(grown, 1);
    EXPECT_EQ(static_cast<const BrickField&>(*field).brick_count(), first.brick_count());
}

TEST(BrickField, MeasuresWithTheBitsOfTheExactFieldEverywhere) {
    const auto exact = exact_of(hills());
    const BrickField bricks(exact, {.voxel_size = 0.07f, .near = 0.3f});
    // Near the surface and far from it, also beyond where stencils are floats.
    for (const float reach : {6.0f, 60.0f}) {
        const std::vector<vec3> points = some_points(3000, reach, 4);
        std::vector<float> d(points.size()), e(points.size());
        std::vector<vec3> g(points.size()), h(points.size());
        SdfField::Trail trail;
        bricks.measure(points, d.data(), g.data(), trail);
        exact->distances(points, e.data(), h.data());
        for (size_t i = 0; i < points.size(); ++i) {
            ASSERT_EQ(d[i], e[i]) << i;
            ASSERT_EQ(g[i], h[i]) << i;
        }
    }
}

}  // namespace
