// SPDX-License-Identifier: MIT
// Starts threads.
#include "field/loose.h"

#include "worlds.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

using namespace kiln;
using namespace kiln::field;
using worlds::compiled;
using worlds::edit;

namespace {

constexpr float kVoxel = 0.05f;

std::shared_ptr<const ProgramField> field_of(const std::vector<Edit>& edits) {
    return std::make_shared<const ProgramField>(compiled(edits));
}
std::vector<LoosePart> cut(std::vector<Edit> before, const Edit& by, const Box3& box, LooseOptions options = {}) {
    std::vector<Edit> after = before;
    after.push_back(by);
    options.voxel_size = kVoxel;
    return loose_parts(*field_of(before), *field_of(after), box, options);
}
Edit slab(vec3 at, vec3 half) { return edit(kiln::Box{.half_extents = half}, at, Op::Subtract); }
Box3 around(vec3 at, vec3 half) { return {at - half, at + half}; }

const std::vector<Edit> kPillar{edit(Plane{}), edit(kiln::Box{.half_extents = {0.3f, 2, 0.3f}}, {0, 1.5f, 0})};

TEST(LooseParts, ThePartOfAPillarAboveACutIsLooseAndTheRestStays) {
    const vec3 at{0, 2, 0}, half{1, 0.1f, 1};
    const auto parts = cut(kPillar, slab(at, half), around(at, half));
    ASSERT_EQ(parts.size(), 1u);
    EXPECT_NEAR(parts[0].box.min.y, 2.1f, 2 * kVoxel);
    EXPECT_NEAR(parts[0].box.max.y, 3.5f, 2 * kVoxel);
    EXPECT_NEAR(double(parts[0].points) * std::pow(double(kVoxel), 3), 0.6 * 0.6 * 1.4, 0.12);
}

TEST(LooseParts, AnyNumberOfWorkersFindsTheSamePoints) {
    const vec3 at{0, 2, 0}, half{1, 0.1f, 1};
    const auto one = cut(kPillar, slab(at, half), around(at, half), {.workers = 1});
    ASSERT_EQ(one.size(), 1u);
    for (const int workers : {2, 3, 8}) {
        const auto many = cut(kPillar, slab(at, half), around(at, half), {.workers = workers});
        ASSERT_EQ(many.size(), 1u) << workers;
        EXPECT_EQ(many[0].region.inside, one[0].region.inside) << workers;
    }
}

TEST(LooseParts, ANotchThatDoesNotGoThroughCutsNothingLoose) {
    const vec3 at{0.4f, 2, 0}, half{0.5f, 0.1f, 1};
    EXPECT_TRUE(cut(kPillar, slab(at, half), around(at, half)).empty());
}

TEST(LooseParts, WhatNeverHungTogetherIsNotLoose) {
    // One bite out of two floating balls.
    const std::vector<Edit> balls{edit(kiln::Sphere{.radius = 0.5f}, {-0.6f, 3, 0}),
                                  edit(kiln::Sphere{.radius = 0.4f}, {0.6f, 3, 0})};
    const vec3 at{0, 3, 0}, half{0.4f, 0.4f, 0.4f};
    EXPECT_TRUE(cut(balls, slab(at, half), around(at, half)).empty());
}

TEST(LooseParts, ABeamCutAtBothEndsFallsAndItsPillarsStay) {
    const std::vector<Edit> gate{edit(Plane{}), edit(kiln::Box{.half_extents = {0.2f, 1, 0.2f}}, {-1, 1, 0}),
                                 edit(kiln::Box{.half_extents = {0.2f, 1, 0.2f}}, {1, 1, 0}),
                                 edit(kiln::Box{.half_extents = {1.2f, 0.2f, 0.2f}}, {0, 2.2f, 0})};
    // One cut through both.
    const vec3 at{0, 1.9f, 0}, half{2, 0.08f, 1};
    const auto parts = cut(gate, slab(at, half), around(at, half));
    ASSERT_EQ(parts.size(), 1u);
    EXPECT_NEAR(parts[0].box.max.x, 1.2f, 2 * kVoxel);
    EXPECT_NEAR(parts[0].box.min.x, -1.2f, 2 * kVoxel);
    // A cut through one: it hangs on the other.
    const vec3 one{1, 1.5f, 0}, small{0.5f, 0.1f, 0.5f};
    EXPECT_TRUE(cut(gate, slab(one, small), around(one, small)).empty());
}

TEST(LooseParts, OfAFloatingBarTheLargerHalfStays) {
    const std::vector<Edit> bar{edit(kiln::Box{.half_extents = {1, 0.2f, 0.2f}}, {0, 3, 0})};
    const vec3 at{0.3f, 3, 0}, half{0.1f, 0.5f, 0.5f};
    const auto parts = cut(bar, slab(at, half), around(at, half));
    ASSERT_EQ(parts.size(), 1u);
    EXPECT_GT(parts[0].box.min.x, 0.3f);
}

TEST(LooseParts, CrumbsAndWorldsAreNotParts) {
    const vec3 at{0, 2, 0}, half{1, 0.1f, 1};
    EXPECT_TRUE(cut(kPillar, slab(at, half), around(at, half), {.most_points = 100}).empty());
    EXPECT_TRUE(cut(kPillar, slab(at, half), around(at, half), {.least_points = 1 << 16}).empty());
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    EXPECT_TRUE(cut(kPillar, slab(at, half), {{-kInfinity, 0, 0}, {0, 3, 0}}).empty());
}

TEST(LooseParts, PartAndRestAreTheSolidOnceWithTheSurfaceItHad) {
    const vec3 at{0, 2, 0}, half{1, 0.1f, 1};
    std::vector<Edit> edits = kPillar;
    edits.push_back(slab(at, half));
    const auto whole = field_of(edits);
    const auto parts = cut(kPillar, slab(at, half), around(at, half));
    ASSERT_EQ(parts.size(), 1u);
    const RegionField region(parts[0].region);
    const auto part = [&](vec3 p) { return std::max(whole->distance(p), region.distance(p)); };
    const auto rest = [&](vec3 p) { return std::max(whole->distance(p), -region.distance(p)); };
    std::mt19937 rng(3);
    const auto uniform = [&](float a, float b) { return std::uniform_real_distribution<float>(a, b)(rng); };
    int in_part = 0;
    for (int i = 0; i < 20000; ++i) {
        const vec3 p{uniform(-0.6f, 0.6f), uniform(-0.5f, 4), uniform(-0.6f, 0.6f)};
        const float d = whole->distance(p);
        const bool solid = d <= 0, of_part = part(p) <= 0, of_rest = rest(p) <= 0;
        EXPECT_EQ(solid, of_part || of_rest) << p.x << " " << p.y << " " << p.z;
        EXPECT_FALSE(of_part && of_rest);
        in_part += of_part;
        // Where the part's surface is, its values are the solid's own.
        if (of_part && d > -0.04f) {
            EXPECT_EQ(part(p), d);
        }
        // No value says more than the distance to the surface.
        const vec3 q{p.x + uniform(-0.1f, 0.1f), p.y + uniform(-0.1f, 0.1f), p.z + uniform(-0.1f, 0.1f)};
        EXPECT_LE(std::abs(rest(p) - rest(q)), length(p - q) * 1.001f + 1e-5f);
        EXPECT_LE(std::abs(part(p) - part(q)), length(p - q) * 1.001f + 1e-5f);
    }
    EXPECT_GT(in_part, 500);
}

}  // namespace
