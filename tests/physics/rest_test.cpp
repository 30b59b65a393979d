// SPDX-License-Identifier: MIT
// Starts threads.
// What comes to rest, alone, in stacks and in piles, on every engine that runs here.
#include "physics/physics.h"
#include "physics/sdf_collision.h"
#include "physics/worlds.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>
#include <tuple>

using namespace kiln;
using namespace kiln::physics;
using namespace kiln::physics::worlds;

namespace {

struct AtRest : Engines {};
KILN_EACH_ENGINE(AtRest);

TEST_P(AtRest, AFieldBodyWithANotchComesToRestAndSleeps) {
    Scene s(GetParam());
    s.ground({edit(Plane{})});
    const BodyId id =
        s.add({.shape = moving({edit(kiln::Torus{.major_radius = 0.6f, .minor_radius = 0.15f}),
                                edit(kiln::Box{.half_extents = {0.2f, 0.5f, 0.2f}}, {0.6f, 0, 0}, Op::Subtract)}),
               .pose = {{0, 0.5f, 0}, axis_angle({0, 0, 1}, 0.2f)}});
    s.run(2.5f);
    float fastest = 0;
    for (int i = 0; i < 30; ++i) {
        s.world->step(kStep);
        fastest = std::max(fastest, length(s.world->state(id).angular_velocity));
    }
    EXPECT_LT(fastest, 0.05f) << "it trembles";
    s.run(2);
    EXPECT_TRUE(s.world->state(id).asleep);
    EXPECT_NEAR(s.world->state(id).pose.position.y, 0.15f, 0.02f);
}

TEST_P(AtRest, ThingsComeToRestOnAPlaneWithoutSinkingDriftingOrJitter) {
    for (const bool as_field : {false, true}) {
        for (const Solid& solid : solids()) {
            Scene s(GetParam());
            s.ground({edit(Plane{})});
            // A capsule lies; standing it would fall.
            const bool lies = solid.convex.kind == Convex::Kind::Capsule;
            const float height = lies ? solid.convex.size.x : half_extents(solid.convex).y;
            const quat rotation = lies ? axis_angle({1, 0, 0}, kPi / 2) : quat{};
            const BodyId id = s.add(
                {.shape = as_field ? solid.field() : solid.exact(), .pose = {{0.3f, height + 0.01f, -0.2f}, rotation}});
            s.run(2);
            const BodyState early = s.world->state(id);
            EXPECT_TRUE(early.asleep) << solid.name << as_field;
            s.run(10);
            const BodyState late = s.world->state(id);
            EXPECT_NEAR(late.pose.position.y, height, 0.02f) << solid.name << as_field;
            EXPECT_LT(length(late.pose.position - early.pose.position), 1e-3f) << solid.name << as_field;
            EXPECT_LT(length(late.linear_velocity), 0.02f) << solid.name << as_field;
        }
    }
}

TEST_P(AtRest, ABoxRestsOnTopOfABallAndOnABox) {
    for (const bool as_field : {false, true}) {
        for (const Edit& below :
             {edit(kiln::Sphere{.radius = 2}, {0, -2, 0}), edit(kiln::Box{.half_extents = {1, 1, 1}}, {0, -1, 0})}) {
            Scene s(GetParam());
            s.ground({below}, 1);
            const Solid box = solids()[1];
            const BodyId id =
                s.add({.shape = as_field ? box.field() : box.exact(), .pose = {{0, 0.505f, 0}, {}}, .friction = 1});
            s.run(4);
            EXPECT_NEAR(s.world->state(id).pose.position.y, 0.5f, 0.03f) << as_field;
            EXPECT_LT(std::abs(s.world->state(id).pose.position.x), 0.03f) << as_field;
        }
    }
}

TEST_P(AtRest, OnBricksItIsWhereItIsOnTheExactFieldWithinAQuarterVoxel) {
    std::vector<Edit> edits{edit(Plane{})};
    std::mt19937 rng(11);
    const auto uniform = [&](float a, float b) { return std::uniform_real_distribution<float>(a, b)(rng); };
    // Basins, so that there is one place to come to.
    for (int i = 0; i < 6; ++i)
        edits.push_back(
            edit(kiln::Sphere{.radius = 0.8f}, {3 * float(i) + uniform(-0.3f, 0.3f), 0.3f, 0}, Op::Subtract, 0.1f));
    const auto exact = field_of(edits);
    std::vector<std::vector<vec3>> rests;
    for (const float voxel : {0.0f, 0.1f}) {  // an eighth of a basin's radius
        Scene s(GetParam());
        s.add({.shape = voxel > 0 ? fixed(edits, voxel) : SdfShape::fixed(exact), .motion = Motion::Static});
        std::vector<BodyId> ids;
        for (int i = 0; i < 6; ++i)
            ids.push_back(s.add({.shape = i % 2 == 0 ? solids()[0].exact() : solids()[0].field(),
                                 .pose = {{3 * float(i) + 0.1f, 0.7f, 0.1f}, {}},
                                 .linear_damping = 1,
                                 .angular_damping = 1}));
        s.run(8);
        rests.emplace_back();
        for (const BodyId id : ids) rests.back().push_back(s.world->state(id).pose.position);
    }
    for (size_t i = 0; i < rests[0].size(); ++i) EXPECT_LT(length(rests[1][i] - rests[0][i]), 0.025f) << i;
}

TEST_P(AtRest, AStackOfTenBoxesStands) {
    for (const bool as_field : {false, true}) {
        Scene s(GetParam());
        s.ground({edit(Plane{})});
        const Solid box = solids()[1];
        const BodyShape shape = as_field ? box.field() : box.exact();
        std::vector<BodyId> boxes;
        for (int i = 0; i < 10; ++i) boxes.push_back(s.add({.shape = shape, .pose = {{0, 0.5f + float(i), 0}, {}}}));
        s.run(10);
        for (const BodyId id : boxes) {
            const BodyState state = s.world->state(id);
            EXPECT_LT(std::hypot(state.pose.position.x, state.pose.position.z), 0.05f) << as_field;
            EXPECT_TRUE(state.asleep) << as_field;
        }
        EXPECT_GT(s.world->state(boxes.back()).pose.position.y, 9.4f) << as_field;
    }
}

TEST_P(AtRest, EightSecondsOverTerrainLoseNobody) {
    for (const bool as_field : {false, true}) {
        Scene s(GetParam());
        std::vector<Edit> edits{edit(Plane{})};
        std::mt19937 rng(3);
        const auto uniform = [&](float a, float b) { return std::uniform_real_distribution<float>(a, b)(rng); };
        for (int i = 0; i < 30; ++i)
            edits.push_back(edit(kiln::Sphere{.radius = uniform(0.5f, 1.5f)},
                                 {uniform(-6, 6), uniform(-0.8f, 0), uniform(-6, 6)},
                                 i % 3 == 0 ? Op::Subtract : Op::Union, 0.3f));
        const auto field = field_of(edits);
        s.add({.shape = SdfShape::fixed(field), .motion = Motion::Static});
        std::vector<BodyId> ids;
        const std::vector<Solid> kinds = solids();
        std::vector<BodyShape> shapes;
        for (const Solid& kind : kinds) shapes.push_back(as_field ? kind.field() : kind.exact());
        for (int i = 0; i < 60; ++i)
            ids.push_back(s.add({.shape = shapes[size_t(i) % 4],
                                 .pose = {{uniform(-5, 5), 3 + 0.3f * float(i), uniform(-5, 5)},
                                          axis_angle({0, 0, 1}, uniform(0, 3))}}));
        s.run(8);
        EXPECT_LT(s.deepest(), 0.02f) << as_field;
        for (size_t i = 0; i < ids.size(); ++i) {
            const vec3 at = s.world->state(ids[i]).pose.position;
            EXPECT_GT(field->distance(at), 0) << i << as_field;
            EXPECT_LT(at.y, 20) << i << as_field;
            if (kinds[i % 4].convex.kind != Convex::Kind::Sphere) continue;
            // None of a ball is in the solid. (How far the middle is from it is not known: distances of blends are bounds.)
            for (int k = 0; k < 300; ++k) {
                const vec3 out = normalize(vec3{uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)});
                EXPECT_GT(field->distance(at + out * (kinds[i % 4].convex.size.x - 0.02f)), 0) << i << as_field;
            }
        }
        EXPECT_EQ(s.world->lost(), 0);
    }
}

TEST_P(AtRest, FiveFieldToriStack) {
    Scene s(GetParam());
    s.ground({edit(Plane{})});
    const auto torus = moving({edit(kiln::Torus{.major_radius = 0.5f, .minor_radius = 0.2f})});
    std::vector<BodyId> ids;
    for (int i = 0; i < 5; ++i)
        ids.push_back(s.add({.shape = torus, .pose = {{0, 0.2f + 0.4f * float(i) + 0.002f, 0}, {}}}));
    s.run(8);
    for (size_t i = 0; i < ids.size(); ++i) {
        const BodyState state = s.world->state(ids[i]);
        EXPECT_NEAR(state.pose.position.y, 0.2f + 0.4f * float(i), 0.05f) << i;
        EXPECT_LT(std::hypot(state.pose.position.x, state.pose.position.z), 0.1f) << i;
        EXPECT_TRUE(state.asleep) << i;
    }
}

TEST_P(AtRest, RodsThatBeginAcrossEachOtherComeApart) {
    // Neither has its middle in the other, and what each has on the other's two sides is pushed both ways.
    const auto rod = moving({edit(kiln::Capsule{.half_height = 0.5f, .radius = 0.3f})});
    for (const float off : {0.35f, 0.55f}) {
        Scene s(GetParam());
        s.ground({edit(Plane{})}, 1);
        const BodyId low = s.add({.shape = rod, .pose = {{0, 0.3f, 0}, axis_angle({1, 0, 0}, kPi / 2)}}),
                     high = s.add({.shape = rod, .pose = {{off, 0.35f, 0.35f}, axis_angle({0, 0, 1}, kPi / 2)}});
        float fastest = 0;
        for (int i = 0; i < 240; ++i) {
            s.world->step(kStep);
            for (const BodyId id : {low, high}) fastest = std::max(fastest, length(s.world->state(id).linear_velocity));
        }
        EXPECT_LT(s.deepest(), 0.02f) << off;
        EXPECT_LT(fastest, 6) << off << ": without a shot";
        EXPECT_EQ(s.world->lost(), 0);
    }
}

// What comes to rest on its own does so at one place on every engine.
TEST(EnginesAgree, OnRestAndOnTheSlope) {
    const std::vector<std::string> all = engines();
    std::vector<std::vector<vec3>> rests;
    std::vector<std::vector<float>> speeds;
    for (const std::string& engine : all) {
        rests.emplace_back();
        speeds.emplace_back();
        for (const bool as_field : {false, true}) {
            for (const Solid& solid : solids()) {
                Scene s(engine);
                s.ground({edit(Plane{}), edit(kiln::Box{.half_extents = {2, 0.5f, 2}})});
                // A ball has no one place on a plane, nor has a capsule, which lies, across its length.
                const bool lies = solid.convex.kind == Convex::Kind::Capsule;
                const BodyId id = s.add({.shape = as_field ? solid.field() : solid.exact(),
                                         .pose = {{0.2f, 1.1f, 0.1f}, lies ? axis_angle({1, 0, 0}, kPi / 2) : quat{}}});
                s.run(4);
                vec3 rest = s.world->state(id).pose.position;
                if (lies || solid.convex.kind == Convex::Kind::Sphere) rest.x = 0;
                if (solid.convex.kind == Convex::Kind::Sphere) rest.z = 0;
                rests.back().push_back(rest);
            }
        }
        Scene stack(engine);
        stack.ground({edit(Plane{})});
        BodyId top;
        for (int i = 0; i < 10; ++i)
            top = stack.add({.shape = Convex::box({0.5f, 0.5f, 0.5f}), .pose = {{0, 0.5f + float(i), 0}, {}}});
        stack.run(10);
        rests.back().push_back({0, stack.world->state(top).pose.position.y, 0});
        for (const float degrees : {10.0f, 30.0f}) {
            Scene s(engine);
            s.ground({inclined_plane(degrees)}, 1);
            const BodyId id =
                s.add({.shape = Convex::sphere(0.5f), .pose = {out_of(degrees) * 0.5f, {}}, .friction = 1});
            s.run(2);
            speeds.back().push_back(dot(s.world->state(id).linear_velocity, downhill(degrees)));
        }
    }
    for (size_t e = 1; e < all.size(); ++e) {
        for (size_t i = 0; i < rests[0].size(); ++i)
            EXPECT_LT(length(rests[e][i] - rests[0][i]), 0.005f) << all[e] << " against " << all[0] << ", rest " << i;
        for (size_t i = 0; i < speeds[0].size(); ++i)
            EXPECT_NEAR(speeds[e][i] / speeds[0][i], 1, 0.002f) << all[e] << " against " << all[0] << ", slope " << i;
    }
}

TEST_P(AtRest, RingsThatFallOnEachOtherAreMetBeforeTheyAreDeep) {
    // From 3 m: 7.7 m/s, 13 cm a step, which is the thickness of half a ring.
    Scene s(GetParam());
    s.ground({edit(Plane{})});
    const auto torus = moving({edit(kiln::Torus{.major_radius = 0.35f, .minor_radius = 0.12f})});
    std::mt19937 rng(5);
    const auto uniform = [&](float a, float b) { return std::uniform_real_distribution<float>(a, b)(rng); };
    for (int i = 0; i < 8; ++i)
        s.add({.shape = torus,
               .pose = {
                   {float(i % 2), i < 4 ? 0.13f + 0.25f * float(i / 2) : 2.5f + 0.5f * float(i), uniform(-0.1f, 0.1f)},
                   axis_angle({1, 0, 0}, i < 4 ? 0 : uniform(-0.4f, 0.4f))}});
    float deepest = 0;
    for (int i = 0; i < 120; ++i) {
        s.world->step(kStep);
        deepest = std::max(deepest, s.deepest());
    }
    EXPECT_LT(deepest, 0.04f);
}

TEST_P(AtRest, RingsThatTumbleAreHeldWhereverTheyTouchTheGround) {
    // A ring that has come down on one side lays itself down all around within a few steps.
    Scene s(GetParam());
    s.ground({edit(Plane{})});
    const auto torus = moving({edit(kiln::Torus{.major_radius = 0.35f, .minor_radius = 0.12f})});
    std::mt19937 rng(5);
    const auto uniform = [&](float a, float b) { return std::uniform_real_distribution<float>(a, b)(rng); };
    for (int i = 0; i < 36; ++i)
        s.add({.shape = torus,
               .pose = {{4 * float(i % 6), 1.5f, 4 * float(i / 6)}, axis_angle({1, 0, 0}, uniform(-1, 1))},
               .linear_velocity = {uniform(-1, 1), -2, uniform(-1, 1)},
               .angular_velocity = {uniform(-9, 9), 0, uniform(-9, 9)}});
    float deepest = 0;
    for (int i = 0; i < 75; ++i) {
        s.world->step(kStep);
        deepest = std::max(deepest, s.deepest());
    }
    EXPECT_GT(deepest, 0);
    EXPECT_LT(deepest, 0.02f);
}

// As `bench physics/bodies.1000` has it, and a quarter of them as fields.
struct SlowTerrain : Engines {};
KILN_EACH_ENGINE(SlowTerrain);

TEST_P(SlowTerrain, AThousandMixedBodiesNeverFallThrough) {
    for (const bool as_field : {false, true}) {
        Scene s(GetParam());
        std::mt19937 rng(5);
        const auto uniform = [&](float a, float b) { return std::uniform_real_distribution<float>(a, b)(rng); };
        std::vector<Edit> edits{edit(Plane{})};
        for (int i = 0; i < 200; ++i) {
            const float radius = uniform(4, 10), rise = uniform(0.3f, 1.5f), x = uniform(-32, 32), z = uniform(-32, 32);
            const bool hollow = i % 3 == 0;
            edits.push_back(edit(kiln::Sphere{.radius = radius}, {x, hollow ? radius - rise : rise - radius, z},
                                 hollow ? Op::Subtract : Op::Union, 1));
        }
        s.ground(edits);
        const auto exact = field_of(edits);
        std::vector<BodyShape> shapes;
        for (const Solid& kind : solids()) shapes.push_back(as_field ? kind.field() : kind.exact());
        std::vector<BodyId> ids;
        const float half = as_field ? 13 : 27;
        for (size_t i = 0; i < (as_field ? 250u : 1000u); ++i)
            ids.push_back(s.add({.shape = shapes[i % 4],
                                 .pose = {{uniform(-half, half), uniform(3, 5), uniform(-half, half)},
                                          axis_angle({0, 0, 1}, uniform(0, 3))}}));
        s.run(4);
        for (size_t i = 0; i < ids.size(); ++i)
            EXPECT_GT(exact->distance(s.world->state(ids[i]).pose.position), 0) << i << as_field;
        EXPECT_LT(s.deepest(), 0.05f) << as_field;
        EXPECT_EQ(s.world->lost(), 0) << as_field;
    }
}

// As `bench physics/tori.100` has it, at every moment of its fall and after.
struct SlowPile : testing::TestWithParam<std::tuple<std::string, unsigned>> {};
INSTANTIATE_TEST_SUITE_P(Engines, SlowPile, testing::Combine(testing::ValuesIn(engines()), testing::Values(5, 6, 7, 8)),
                         [](const auto& i) {
                             return std::get<0>(i.param) + "Seed" + std::to_string(std::get<1>(i.param));
                         });

TEST_P(SlowPile, OfAHundredFieldToriNeverSinksIn) {
    Scene s(std::get<0>(GetParam()));
    s.ground({edit(Plane{})});
    const auto torus = moving({edit(kiln::Torus{.major_radius = 0.35f, .minor_radius = 0.12f})});
    std::mt19937 rng(std::get<1>(GetParam()));
    const auto uniform = [&](float a, float b) { return std::uniform_real_distribution<float>(a, b)(rng); };
    std::vector<BodyId> ids;
    for (int i = 0; i < 100; ++i) {
        const vec3 at{float(i % 3) - 1 + uniform(-0.05f, 0.05f), 0.6f + 0.5f * float(i / 9),
                      float(i / 3 % 3) - 1 + uniform(-0.05f, 0.05f)};
        ids.push_back(s.add({.shape = torus, .pose = {at, axis_angle({1, 0, 0}, uniform(-0.4f, 0.4f))}}));
    }
    float first = 0, deepest = 0, last = 0;
    for (int i = 0; i < 480; ++i) {
        s.world->step(kStep);
        float& at_this_time = i < 20 ? first : i < 420 ? deepest : last;
        at_this_time = std::max(at_this_time, s.deepest());
    }
    EXPECT_LE(first, 0.04f) << "some begin in each other";
    EXPECT_LE(deepest, 0.04f);
    EXPECT_LE(last, 0.015f) << "at rest";
    for (const BodyId id : ids) EXPECT_GT(s.world->state(id).pose.position.y, 0.05f);
    EXPECT_EQ(s.world->lost(), 0);
}

}  // namespace
