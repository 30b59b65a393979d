// SPDX-License-Identifier: MIT
// Scenes with known answers, on every engine that runs here.
#include "physics/physics.h"
#include "physics/sdf_collision.h"
#include "physics/worlds.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <tuple>

using namespace kiln;
using namespace kiln::physics;
using worlds::edit;
using worlds::engines;
using worlds::field_of;
using worlds::moving;

namespace {

constexpr float kStep = 1.0f / 60;
constexpr float kGravity = 9.81f;
constexpr float kPi = std::numbers::pi_v<float>;

struct Scene {
    std::unique_ptr<World> world;
    explicit Scene(const std::string& engine, vec3 gravity = {0, -kGravity, 0}) {
        auto made = make_world(engine, {.gravity = gravity});
        EXPECT_TRUE(made) << (made ? "" : made.error().message);
        world = std::move(*made);
    }
    BodyId add(const BodySettings& s) {
        auto id = world->add(s);
        EXPECT_TRUE(id) << (id ? "" : id.error().message);
        return id ? *id : BodyId{};
    }
    BodyId ground(const std::vector<Edit>& edits, float friction = 0.5f, float restitution = 0) {
        return add({.shape = SdfShape::fixed(field_of(edits)),
                    .motion = Motion::Static,
                    .friction = friction,
                    .restitution = restitution});
    }
    void run(float seconds) {
        for (int i = 0; i < int(std::lround(seconds / kStep)); ++i) world->step(kStep);
    }
    float deepest() const {
        float out = 0;
        for (const World::Touch& t : world->touches()) out = std::max(out, t.depth);
        return out;
    }
};

struct EachEngine : testing::TestWithParam<std::string> {};
INSTANTIATE_TEST_SUITE_P(Engines, EachEngine, testing::ValuesIn(engines()), [](const auto& i) { return i.param; });

// The same convex solid as an exact shape and as a field.
struct Solid {
    std::string name;
    Convex convex;
    kiln::Shape shape;
    BodyShape exact() const { return convex; }
    BodyShape field() const { return moving({edit(shape)}); }
};
std::vector<Solid> solids() {
    return {{"sphere", Convex::sphere(0.5f), kiln::Sphere{.radius = 0.5f}},
            {"box", Convex::box({0.5f, 0.5f, 0.5f}), kiln::Box{.half_extents = {0.5f, 0.5f, 0.5f}}},
            {"capsule", Convex::capsule(0.5f, 0.3f), kiln::Capsule{.half_height = 0.5f, .radius = 0.3f}},
            {"cylinder", Convex::cylinder(0.3f, 0.4f), kiln::Cylinder{.half_height = 0.3f, .radius = 0.4f}}};
}

Edit inclined_plane(float degrees) {
    // Falls towards +X.
    Edit e = edit(Plane{});
    e.node.transform.rotation = axis_angle({0, 0, 1}, -degrees * kPi / 180);
    return e;
}

// How far along the slope, and how fast.
vec3 downhill(float degrees) { return {std::cos(degrees * kPi / 180), -std::sin(degrees * kPi / 180), 0}; }
vec3 out_of(float degrees) { return {std::sin(degrees * kPi / 180), std::cos(degrees * kPi / 180), 0}; }

TEST_P(EachEngine, ABallRollsDownASlopeAtFiveSeventhsOfItsPull) {
    for (const bool as_field : {false, true}) {
        for (const float degrees : {10.0f, 20.0f, 30.0f}) {
            Scene s(GetParam());
            s.ground({inclined_plane(degrees)}, 1);
            const Solid ball = solids()[0];
            const BodyId id = s.add(
                {.shape = as_field ? ball.field() : ball.exact(), .pose = {out_of(degrees) * 0.5f, {}}, .friction = 1});
            s.run(2);
            const float expected = 5.0f / 7 * kGravity * std::sin(degrees * kPi / 180);
            const BodyState state = s.world->state(id);
            // Symplectic Euler: v = a t exactly.
            EXPECT_NEAR(dot(state.linear_velocity, downhill(degrees)) / 2 / expected, 1, as_field ? 0.01 : 0.005)
                << degrees << as_field;
            EXPECT_NEAR(dot(state.pose.position, out_of(degrees)), 0.5f, as_field ? 0.004f : 0.001f)
                << degrees << as_field;
        }
    }
}

TEST_P(EachEngine, ACylinderRollsDownASlopeAtTwoThirdsAndACapsuleLikeIt) {
    const float degrees = 20;
    for (const Solid& solid : {solids()[2], solids()[3]}) {
        Scene s(GetParam());
        s.ground({inclined_plane(degrees)}, 1);
        const float r = solid.convex.size.x;
        // Lying across the slope.
        const BodyId id = s.add(
            {.shape = solid.exact(), .pose = {out_of(degrees) * r, axis_angle({1, 0, 0}, kPi / 2)}, .friction = 1});
        s.run(1.5f);
        const double k = moments(solid.convex).y / double(r * r);
        const float expected = kGravity * std::sin(degrees * kPi / 180) / float(1 + k);
        EXPECT_NEAR(dot(s.world->state(id).linear_velocity, downhill(degrees)) / 1.5f / expected, 1, 0.01)
            << solid.name;
    }
}

TEST_P(EachEngine, ABoxStaysBelowTheAngleOfFrictionAndSlidesAbove) {
    for (const bool as_field : {false, true}) {
        for (const float ratio : {0.98f, 1.02f}) {
            const float mu = 0.5f, degrees = std::atan(mu * ratio) * 180 / kPi;
            Scene s(GetParam());
            s.ground({inclined_plane(degrees)}, mu);
            // Low, so that it does not tip.
            const Convex plate = Convex::box({0.5f, 0.2f, 0.5f});
            const BodyShape shape =
                as_field ? BodyShape(moving({edit(kiln::Box{.half_extents = plate.size})})) : BodyShape(plate);
            const BodyId id = s.add({.shape = shape,
                                     .pose = {out_of(degrees) * 0.2f, axis_angle({0, 0, 1}, -degrees * kPi / 180)},
                                     .friction = mu});
            s.run(4);
            const float way = dot(s.world->state(id).pose.position, downhill(degrees));
            if (ratio < 1) {
                EXPECT_LT(way, 0.01f) << as_field;
            } else {
                // a = g (sin - mu cos), a small difference of large numbers.
                const float a = kGravity * (std::sin(degrees * kPi / 180) - mu * std::cos(degrees * kPi / 180));
                EXPECT_GT(way, 0.5f * 0.5f * a * 16) << as_field;
            }
        }
    }
}

TEST_P(EachEngine, FrictionOfAPairIsTheGeometricMeanAndBounceTheLarger) {
    for (const float ratio : {0.97f, 1.03f}) {
        const float degrees = std::atan(0.4f * ratio) * 180 / kPi;
        Scene s(GetParam());
        s.ground({inclined_plane(degrees)}, 0.2f);
        const BodyId id = s.add({.shape = Convex::box({0.5f, 0.2f, 0.5f}),
                                 .pose = {out_of(degrees) * 0.2f, axis_angle({0, 0, 1}, -degrees * kPi / 180)},
                                 .friction = 0.8f});
        s.run(4);
        EXPECT_EQ(dot(s.world->state(id).pose.position, downhill(degrees)) > 0.1f, ratio > 1) << ratio;
    }
    Scene s(GetParam());
    s.ground({edit(Plane{})}, 0.5f, 0.8f);
    const BodyId id = s.add({.shape = Convex::sphere(0.5f), .pose = {{0, 3, 0}, {}}, .restitution = 0.1f});
    s.run(0.9f);
    EXPECT_NEAR(s.world->state(id).linear_velocity.y,
                0.8f * std::sqrt(2 * kGravity * 2.5f) - kGravity * (0.9f - std::sqrt(5 / kGravity)), 0.3f);
}

TEST_P(EachEngine, AFieldBodyWithANotchComesToRestAndSleeps) {
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

TEST_P(EachEngine, ThingsComeToRestOnAPlaneWithoutSinkingDriftingOrJitter) {
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

TEST_P(EachEngine, ABoxRestsOnTopOfABallAndOnABox) {
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

TEST_P(EachEngine, AStackOfTenBoxesStands) {
    Scene s(GetParam());
    s.ground({edit(Plane{})});
    std::vector<BodyId> boxes;
    for (int i = 0; i < 10; ++i)
        boxes.push_back(s.add({.shape = Convex::box({0.5f, 0.5f, 0.5f}), .pose = {{0, 0.5f + float(i), 0}, {}}}));
    s.run(10);
    for (const BodyId id : boxes) {
        const BodyState state = s.world->state(id);
        EXPECT_LT(std::hypot(state.pose.position.x, state.pose.position.z), 0.05f);
        EXPECT_TRUE(state.asleep);
    }
    EXPECT_GT(s.world->state(boxes.back()).pose.position.y, 9.4f);
}

TEST_P(EachEngine, ABulletStopsAtAThinWallAtAThousandMetresASecond) {
    for (const float speed : {50.0f, 200.0f, 1000.0f}) {
        Scene s(GetParam(), {0, 0, 0});
        s.ground({edit(kiln::Box{.half_extents = {0.05f, 5, 5}})});
        const BodyId id = s.add({.shape = Convex::sphere(0.05f),
                                 .pose = {{-7.3f, 0.2f, 0.1f}, {}},
                                 .continuous = true,
                                 .linear_velocity = {speed, 0, 0}});
        s.run(0.5f);
        const BodyState state = s.world->state(id);
        EXPECT_NEAR(state.pose.position.x, -0.1f, 0.02f) << speed;
    }
}

TEST_P(EachEngine, AFrictionlessBallInABowlKeepsItsEnergy) {
    // A hollow ball of radius 4, open at the top. A step takes the part of the velocity that points out of the bowl after it, at most
    // (v t / r)² of the energy: the engines may lose that, not more.
    Scene b(GetParam());
    b.ground(
        {edit(kiln::Box{.half_extents = {6, 3, 6}}, {0, -3, 0}), edit(kiln::Sphere{.radius = 4}, {}, Op::Subtract)}, 0);
    const float r = 0.3f, arm = 4 - r;
    const BodyId id = b.add(
        {.shape = Convex::sphere(r), .pose = {{arm * std::sin(0.65f), -arm * std::cos(0.65f), 0}, {}}, .friction = 0});
    const auto energy = [&] {
        const BodyState state = b.world->state(id);
        return kGravity * (state.pose.position.y + arm) + 0.5f * dot(state.linear_velocity, state.linear_velocity);
    };
    const float before = energy();
    float most = before;
    for (int i = 0; i < 600; ++i) {
        b.world->step(kStep);
        most = std::max(most, energy());
        // It stays on the bowl.
        EXPECT_NEAR(length(b.world->state(id).pose.position), arm, 0.05f);
    }
    EXPECT_LT(most, before * 1.015f);
    EXPECT_GT(energy(), before * 0.92f);
}

TEST_P(EachEngine, GroundTakenAwayUnderASleeperLetsItFallOnTheNextStep) {
    for (const bool as_field : {false, true}) {
        Scene s(GetParam());
        const BodyId ground = s.ground({edit(Plane{})});
        const Solid ball = solids()[0];
        const BodyId id = s.add({.shape = as_field ? ball.field() : ball.exact(), .pose = {{0, 0.5f, 0}, {}}});
        s.run(3);
        ASSERT_TRUE(s.world->state(id).asleep);
        s.world->set_velocity(id, {}, {});
        s.run(2);
        ASSERT_TRUE(s.world->state(id).asleep);
        s.world->remove(ground);
        s.world->step(kStep);
        EXPECT_NEAR(s.world->state(id).linear_velocity.y, -kGravity / 60, 0.01f * kGravity / 60) << as_field;
        // And the contact's end is told.
        const auto events = s.world->events();
        ASSERT_EQ(events.size(), 1u);
        EXPECT_FALSE(events[0].began);
        EXPECT_EQ(events[0].a, ground);
        EXPECT_EQ(events[0].b, id);
    }
}

TEST_P(EachEngine, DiggingUnderASleeperLetsItFallOnTheNextStepAndOnlyThere) {
    for (const bool as_field : {false, true}) {
        Scene s(GetParam());
        const std::vector<Edit> before{edit(kiln::Box{.half_extents = {20, 1, 20}}, {0, -1, 0})};
        std::vector<Edit> after = before;
        after.push_back(edit(kiln::Sphere{.radius = 1.2f}, {}, Op::Subtract));
        const BodyId ground = s.ground(before);
        const Solid box = solids()[1];
        const BodyId id = s.add({.shape = as_field ? box.field() : box.exact(), .pose = {{0, 0.5f, 0}, {}}});
        const BodyId far = s.add({.shape = box.exact(), .pose = {{8, 0.5f, 0}, {}}});
        s.run(3);
        ASSERT_TRUE(s.world->state(id).asleep && s.world->state(far).asleep);
        s.world->set_field(ground, SdfShape::fixed(field_of(after)), {{-1.2f, -1.2f, -1.2f}, {1.2f, 1.2f, 1.2f}});
        s.world->step(kStep);
        EXPECT_NEAR(s.world->state(id).linear_velocity.y, -kGravity / 60, 0.01f * kGravity / 60) << as_field;
        EXPECT_TRUE(s.world->state(far).asleep);
        s.run(3);
        EXPECT_LT(s.world->state(id).pose.position.y, -0.3f) << as_field;
        EXPECT_GT(s.world->state(id).pose.position.y, -0.75f) << as_field;
        EXPECT_NEAR(s.world->state(far).pose.position.y, 0.5f, 0.01f);
    }
}

TEST_P(EachEngine, BuildingInsideASleeperPushesItOutWithoutAShot) {
    Scene s(GetParam());
    const std::vector<Edit> before{edit(Plane{})};
    std::vector<Edit> after = before;
    after.push_back(edit(kiln::Sphere{.radius = 1}, {0.1f, 0, 0}));
    const BodyId ground = s.ground(before);
    const BodyId id = s.add({.shape = Convex::box({0.4f, 0.4f, 0.4f}), .pose = {{0, 0.4f, 0}, {}}});
    s.run(3);
    const auto field = field_of(after);
    s.world->set_field(ground, SdfShape::fixed(field), {{-1, -1, -1}, {1.2f, 1, 1}});
    float fastest = 0;
    for (int i = 0; i < 240; ++i) {
        s.world->step(kStep);
        fastest = std::max(fastest, length(s.world->state(id).linear_velocity));
    }
    EXPECT_LT(fastest, 8);
    EXPECT_GT(field->distance(s.world->state(id).pose.position), 0.35f);
    EXPECT_EQ(s.world->lost(), 0);
}

TEST_P(EachEngine, EightSecondsOverTerrainLoseNobody) {
    Scene s(GetParam());
    std::vector<Edit> edits{edit(Plane{})};
    std::mt19937 rng(3);
    const auto uniform = [&](float a, float b) { return std::uniform_real_distribution<float>(a, b)(rng); };
    for (int i = 0; i < 30; ++i)
        edits.push_back(edit(kiln::Sphere{.radius = uniform(0.5f, 1.5f)},
                             {uniform(-6, 6), uniform(-0.8f, 0), uniform(-6, 6)}, i % 3 == 0 ? Op::Subtract : Op::Union,
                             0.3f));
    const auto field = field_of(edits);
    s.add({.shape = SdfShape::fixed(field), .motion = Motion::Static});
    std::vector<BodyId> ids;
    const std::vector<Solid> kinds = solids();
    for (int i = 0; i < 60; ++i)
        ids.push_back(s.add(
            {.shape = kinds[size_t(i) % 4].exact(),
             .pose = {{uniform(-5, 5), 3 + 0.3f * float(i), uniform(-5, 5)}, axis_angle({0, 0, 1}, uniform(0, 3))}}));
    s.run(8);
    for (const BodyId id : ids) {
        const BodyState state = s.world->state(id);
        EXPECT_GT(field->distance(state.pose.position), 0.1f);
        EXPECT_LT(state.pose.position.y, 20);
    }
    EXPECT_EQ(s.world->lost(), 0);
}

TEST_P(EachEngine, FiveFieldToriStack) {
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

TEST_P(EachEngine, ATorusSlidesDownARampFlat) {
    Scene s(GetParam());
    const float degrees = 15;
    s.ground({inclined_plane(degrees)}, 0.1f);
    const auto torus = moving({edit(kiln::Torus{.major_radius = 0.5f, .minor_radius = 0.2f})});
    const BodyId id = s.add({.shape = torus,
                             .pose = {out_of(degrees) * 0.2f, axis_angle({0, 0, 1}, -degrees * kPi / 180)},
                             .friction = 0.1f});
    s.run(2);
    const float a = kGravity * (std::sin(degrees * kPi / 180) - 0.1f * std::cos(degrees * kPi / 180));
    EXPECT_NEAR(dot(s.world->state(id).linear_velocity, downhill(degrees)) / 2 / a, 1, 0.03f);
    EXPECT_NEAR(dot(s.world->state(id).pose.position, out_of(degrees)), 0.2f, 0.02f);
}

TEST_P(EachEngine, ABoxFallsThroughARing) {
    Scene s(GetParam());
    // The ring lies held in the air; a box that fits falls through its hole, a larger one does not.
    s.add({.shape = moving({edit(kiln::Torus{.major_radius = 1, .minor_radius = 0.2f})}),
           .motion = Motion::Kinematic,
           .pose = {{0, 2, 0}, {}}});
    const BodyId small = s.add({.shape = Convex::box({0.3f, 0.3f, 0.3f}), .pose = {{0.05f, 4, 0}, {}}});
    const BodyId large = s.add({.shape = Convex::box({0.9f, 0.3f, 0.9f}), .pose = {{0, 7, 0}, {}}});
    s.run(3);
    EXPECT_LT(s.world->state(small).pose.position.y, 0);
    EXPECT_NEAR(s.world->state(large).pose.position.y, 2.5f, 0.1f);
}

TEST_P(EachEngine, AFrictionlessSlideKeepsItsSpeedAndNeverKicks) {
    for (const Solid& solid : {solids()[0], solids()[1], solids()[2]}) {
        Scene s(GetParam());
        s.ground({edit(Plane{})}, 0);
        const float height = half_extents(solid.convex).y;
        const BodyId id = s.add(
            {.shape = solid.exact(), .pose = {{-20, height, 0}, {}}, .friction = 0, .linear_velocity = {6, 0, 0}});
        for (int i = 0; i < 320; ++i) {
            const float before = s.world->state(id).linear_velocity.y;
            s.world->step(kStep);
            EXPECT_LT(std::abs(s.world->state(id).linear_velocity.y - before), 0.3f) << solid.name << i;
        }
        EXPECT_NEAR(s.world->state(id).linear_velocity.x, 6, 0.03f) << solid.name;
    }
}

TEST_P(EachEngine, QuestionsSeeConvexBodiesAndFields) {
    Scene s(GetParam());
    const BodyId ground = s.ground({edit(Plane{})});
    const BodyId box =
        s.add({.shape = Convex::box({0.5f, 0.5f, 0.5f}), .motion = Motion::Static, .pose = {{4, 0.5f, 0}, {}}});
    const BodyId ring = s.add({.shape = moving({edit(kiln::Torus{.major_radius = 1, .minor_radius = 0.2f})}),
                               .motion = Motion::Kinematic,
                               .pose = {{-4, 2, 0}, {}}});
    s.world->step(kStep);
    const auto down = [&](float x) { return s.world->cast_ray({x, 10, 0}, {0, -20, 0}); };
    ASSERT_TRUE(down(0) && down(4) && down(-4) && down(-3));
    EXPECT_EQ(down(0)->body, ground);
    EXPECT_NEAR(down(0)->fraction, 0.5f, 1e-3f);
    EXPECT_EQ(down(4)->body, box);
    EXPECT_NEAR(down(4)->position.y, 1, 1e-3f);
    EXPECT_EQ(down(-4)->body, ground) << "through the hole";
    EXPECT_EQ(down(-3)->body, ring);
    const auto ball = s.world->sweep(Convex::sphere(0.9f), {{-4, 10, 0}, {}}, {0, -20, 0});
    ASSERT_TRUE(ball);
    EXPECT_EQ(ball->body, ring);
    EXPECT_THAT(s.world->overlap(Convex::sphere(0.3f), {{4, 1.2f, 0}, {}}), testing::ElementsAre(box));
    EXPECT_THAT(s.world->overlap(Convex::sphere(0.3f), {{-4, 2, 0}, {}}), testing::IsEmpty());
}

TEST_P(EachEngine, BadBodiesAreRefusedAndNoneStopsTheWorld) {
    Scene s(GetParam());
    s.ground({edit(Plane{})});
    const BodySettings good{.pose = {{0, 2, 0}, {}}};
    BodySettings bad = good;
    const auto refused = [&](const char* why) {
        auto id = s.world->add(bad);
        EXPECT_FALSE(id) << why;
        if (!id) {
            EXPECT_THAT(id.error().message, testing::HasSubstr(why));
        }
        bad = good;
    };
    bad.pose.position.x = std::numeric_limits<float>::quiet_NaN(), refused("finite");
    bad.pose.rotation = {0, 0, 0, 0}, refused("unit length");
    bad.shape = Convex::box({1, 0, 1}), refused("no volume");
    bad.density = 0, refused("density");
    bad.linear_velocity.y = std::numeric_limits<float>::infinity(), refused("velocity");
    bad.shape = SdfShape::fixed(field_of({edit(Plane{})})), refused("cannot move");
    const BodyId id = s.add(good);
    // One deep inside the ground is brought out without a shot.
    const BodyId buried = s.add({.pose = {{5, -0.4f, 0}, {}}});
    float fastest = 0;
    for (int i = 0; i < 240; ++i) {
        s.world->step(kStep);
        fastest = std::max(fastest, length(s.world->state(buried).linear_velocity));
    }
    EXPECT_NEAR(s.world->state(id).pose.position.y, 0.5f, 0.02f);
    EXPECT_NEAR(s.world->state(buried).pose.position.y, 0.5f, 0.1f);
    EXPECT_LT(fastest, 6);
    EXPECT_EQ(s.world->lost(), 0);
}

TEST_P(EachEngine, TheSameStepsGiveTheSameBytesForAnyNumberOfThreads) {
    std::vector<std::vector<BodyState>> all;
    for (const int threads : {1, 2, 1}) {
        auto world = make_world(GetParam(), {.threads = threads});
        ASSERT_TRUE(world);
        ASSERT_TRUE((*world)->add({.shape = SdfShape::fixed(field_of({edit(Plane{}), edit(kiln::Sphere{.radius = 1})})),
                                   .motion = Motion::Static}));
        const auto torus = moving({edit(kiln::Torus{.major_radius = 0.4f, .minor_radius = 0.15f})});
        std::vector<BodyId> ids;
        for (int i = 0; i < 40; ++i) {
            const BodyShape shape = i % 4 == 3 ? BodyShape(torus) : solids()[size_t(i) % 4].exact();
            ids.push_back(*(*world)->add(
                {.shape = shape, .pose = {{0.1f * float(i % 5), 2 + 0.5f * float(i), 0.1f * float(i % 3)}, {}}}));
        }
        for (int i = 0; i < 200; ++i) (*world)->step(kStep);
        std::vector<BodyState> states;
        for (const BodyId id : ids) states.push_back((*world)->state(id));
        all.push_back(std::move(states));
    }
    for (size_t i = 0; i < all[0].size(); ++i) {
        EXPECT_EQ(all[0][i].pose, all[1][i].pose) << i;
        EXPECT_EQ(all[0][i].pose, all[2][i].pose) << i;
        EXPECT_EQ(all[0][i].linear_velocity, all[1][i].linear_velocity) << i;
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
            for (const Solid& solid : {solids()[0], solids()[1], solids()[3]}) {
                Scene s(engine);
                s.ground({edit(Plane{}), edit(kiln::Box{.half_extents = {2, 0.5f, 2}})});
                const BodyId id =
                    s.add({.shape = as_field ? solid.field() : solid.exact(), .pose = {{0.2f, 1.1f, 0.1f}, {}}});
                s.run(4);
                // A ball has no one place on a plane.
                vec3 rest = s.world->state(id).pose.position;
                if (solid.convex.kind == Convex::Kind::Sphere) rest.x = rest.z = 0;
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

TEST_P(EachEngine, EventsTellWhenBodiesMeetAndPartAlsoOfSleepers) {
    Scene s(GetParam());
    const BodyId ground = s.ground({edit(Plane{})});
    const BodyId id = s.add({.shape = Convex::box({0.5f, 0.5f, 0.5f}), .pose = {{0, 0.7f, 0}, {}}});
    int began = 0, ended = 0;
    for (int i = 0; i < 300; ++i) {
        s.world->step(kStep);
        for (const ContactEvent& e : s.world->events()) {
            EXPECT_EQ(e.a, ground);
            EXPECT_EQ(e.b, id);
            (e.began ? began : ended)++;
        }
    }
    EXPECT_TRUE(s.world->state(id).asleep);
    EXPECT_EQ(began, 1);
    EXPECT_EQ(ended, 0);
    ASSERT_EQ(s.world->touches().size(), 1u);
    s.world->set_velocity(id, {0, 5, 0}, {});
    s.run(0.3f);
    EXPECT_TRUE(s.world->touches().empty());
    s.world->remove(id);
    EXPECT_FALSE(s.world->contains(id));
    // The place is used again under another id, and the old one reaches nothing.
    const BodyId next = s.add({.pose = {{0, 3, 0}, {}}});
    EXPECT_EQ(next.index, id.index);
    EXPECT_NE(next, id);
    EXPECT_FALSE(s.world->contains(id));
}

TEST_P(EachEngine, DampingIsARateWhateverTheStep) {
    for (const float step : {1.0f / 60, 1.0f / 240}) {
        Scene s(GetParam(), {0, 0, 0});
        const BodyId id = s.add({.linear_damping = 0.7f,
                                 .angular_damping = 1.2f,
                                 .linear_velocity = {3, 0, 0},
                                 .angular_velocity = {0, 2, 0}});
        for (int i = 0; i < int(std::lround(1 / step)); ++i) s.world->step(step);
        EXPECT_NEAR(s.world->state(id).linear_velocity.x, 3 * std::exp(-0.7f), 1e-3f);
        EXPECT_NEAR(s.world->state(id).angular_velocity.y, 2 * std::exp(-1.2f), 1e-3f);
    }
}

TEST_P(EachEngine, AFieldBodySpinsAboutItsOwnPrincipalAxes) {
    // Free of forces its angular momentum stays; about the largest moment the spin itself does.
    Scene s(GetParam(), {0, 0, 0});
    Edit torus = edit(kiln::Torus{.major_radius = 0.5f, .minor_radius = 0.15f}, {0.4f, 0, 0.2f});
    torus.node.transform.rotation = axis_angle(normalize(vec3{1, 2, 3}), 1);
    const vec3 axis = rotate(torus.node.transform.rotation, {0, 1, 0});
    const BodyId id = s.add({.shape = moving({torus}), .angular_velocity = axis * 3.0f});
    const vec3 center = s.world->center_of_mass(id);
    EXPECT_LT(length(center - vec3{0.4f, 0, 0.2f}), 1e-3f);
    s.run(3);
    const BodyState state = s.world->state(id);
    EXPECT_LT(length(state.angular_velocity - axis * 3.0f), 0.03f);
    EXPECT_LT(length(state.pose * center - center), 0.01f) << "it turns about its centre of mass";
    EXPECT_GT(dot(rotate(state.pose.rotation, axis), axis), 0.999f);
}

TEST_P(EachEngine, AKinematicFloorCarriesWhatStandsOnIt) {
    Scene s(GetParam());
    s.add({.shape = Convex::box({3, 0.5f, 3}),
           .motion = Motion::Kinematic,
           .pose = {{0, -0.5f, 0}, {}},
           .friction = 1,
           .linear_velocity = {0.5f, 0, 0}});
    const BodyId id = s.add({.shape = Convex::box({0.3f, 0.3f, 0.3f}), .pose = {{0, 0.3f, 0}, {}}, .friction = 1});
    s.run(2);
    EXPECT_NEAR(s.world->state(id).linear_velocity.x, 0.5f, 0.02f);
    EXPECT_NEAR(s.world->state(id).pose.position.y, 0.3f, 0.02f);
}

TEST(SlowPhysics, APileOfFortyFieldToriSettlesWithoutSinkingIn) {
    for (const std::string& engine : engines()) {
        Scene s(engine);
        s.ground({edit(Plane{})});
        const auto torus = moving({edit(kiln::Torus{.major_radius = 0.35f, .minor_radius = 0.12f})});
        std::mt19937 rng(5);
        const auto uniform = [&](float a, float b) { return std::uniform_real_distribution<float>(a, b)(rng); };
        std::vector<BodyId> ids;
        for (int i = 0; i < 40; ++i) {
            const vec3 at{float(i % 2) - 0.5f + uniform(-0.05f, 0.05f), 0.6f + 0.5f * float(i / 4),
                          float(i / 2 % 2) - 0.5f};
            ids.push_back(s.add({.shape = torus, .pose = {at, axis_angle({1, 0, 0}, uniform(-0.4f, 0.4f))}}));
        }
        s.run(6);
        float deepest = 0;
        for (int i = 0; i < 60; ++i) {
            s.world->step(kStep);
            deepest = std::max(deepest, s.deepest());
        }
        EXPECT_LT(deepest, 0.04f) << engine;
        for (const BodyId id : ids) {
            const float y = s.world->state(id).pose.position.y;
            EXPECT_GT(y, 0.05f) << engine;
            EXPECT_LT(y, 4) << engine;
        }
    }
}

}  // namespace
