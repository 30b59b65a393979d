// SPDX-License-Identifier: MIT
// Starts threads.
// Longer motions whose end is known: a top, a bridge, a slide over hills, and piles that engines must agree on.
#include "physics/physics.h"
#include "physics/worlds.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

using namespace kiln;
using namespace kiln::physics;
using namespace kiln::physics::worlds;

namespace {

struct InMotion : Engines {};
KILN_EACH_ENGINE(InMotion);

TEST_P(InMotion, ASpinningTopStaysUpAndPrecessesAndAStillOneFalls) {
    const auto top = moving({edit(kiln::Sphere{.radius = 0.04f}, {0, 0.04f, 0}),
                             edit(kiln::Cylinder{.half_height = 0.2f, .radius = 0.04f}, {0, 0.24f, 0}),
                             edit(kiln::Cylinder{.half_height = 0.05f, .radius = 0.4f}, {0, 0.45f, 0})});
    const float tilt = 10 * kPi / 180, spin = 60, step = 1.0f / 960,
                seconds = 1.5f;  // engines turn bodies by straight steps
    const quat leaning = axis_angle({0, 0, 1}, -tilt);
    const vec3 axis = rotate(leaning, {0, 1, 0});
    for (const bool spins : {true, false}) {
        Scene s(GetParam());
        // Without friction its centre of mass stays, and its tip goes round.
        s.ground({edit(Plane{})}, 0);
        const MassProperties& m = top->mass();
        // About its axis: the moment that the others do not share.
        const double moments[3] = {m.moments.x, m.moments.y, m.moments.z};
        const double own = *std::max_element(moments, moments + 3), arm = double(m.center.y) - 0.04;
        const double across = std::min({moments[0], moments[1], moments[2]});
        // Steady precession about the centre of mass, rad/s: (own - across) cos(tilt) turn² + own · spin · turn = pull.
        const double pull = m.mass * double(kGravity) * arm, a = (own - across) * std::cos(double(tilt)),
                     b = own * double(spin);
        const float turn = float((std::sqrt(b * b + 4 * a * pull) - b) / (2 * a));
        BodySettings body{.shape = top, .pose = {{0, 0, 0}, leaning}, .friction = 0};
        body.pose.position.y = 0.04f - 0.04f * std::cos(tilt);
        if (spins) body.angular_velocity = axis * spin + vec3{0, turn, 0};
        const BodyId id = s.add(body);
        double swept = 0, before = 0;  // of the way its axis leans, about the vertical
        float most = 0;
        const int steps = int(seconds / step);
        for (int i = 0; i < steps; ++i) {
            s.world->step(step);
            const vec3 up = rotate(s.world->state(id).pose.rotation, {0, 1, 0});
            const double angle = std::atan2(double(-up.z), double(up.x));
            swept += std::remainder(angle - before, 2 * std::numbers::pi);
            before = angle;
            most = std::max(most, std::acos(std::min(up.y, 1.0f)));
        }
        if (spins) {
            EXPECT_LT(most, 1.2f * tilt) << "it stays up";
            EXPECT_NEAR(swept / double(seconds * turn), 1, 0.006);
        } else {
            EXPECT_GT(most, 0.7f) << "it falls over";
        }
    }
}

TEST_P(InMotion, ABridgeOfTenPlanksCarriesABallAcross) {
    Scene s(GetParam());
    // Two beams over a gorge; the planks lie across them.
    s.ground({edit(kiln::Box{.half_extents = {6, 0.5f, 0.2f}}, {4.5f, -0.6f, 0.8f}),
              edit(kiln::Box{.half_extents = {6, 0.5f, 0.2f}}, {4.5f, -0.6f, -0.8f})});
    std::vector<BodyId> planks;
    for (int i = 0; i < 10; ++i)
        planks.push_back(
            s.add({.shape = i % 2 == 0 ? BodyShape(Convex::box({0.498f, 0.05f, 1.2f}))
                                       : BodyShape(moving({edit(kiln::Box{.half_extents = {0.498f, 0.05f, 1.2f}})})),
                   .pose = {{float(i), -0.05f, 0}, {}}}));
    s.run(1);
    const BodyId ball = s.add({.shape = Convex::sphere(0.4f),
                               .pose = {{0, 0.4f, 0}, {}},
                               .density = 2000,
                               .linear_velocity = {3, 0, 0},
                               .angular_velocity = {0, 0, -3 / 0.4f}});
    float lowest = 1;
    for (int i = 0; i < 240 && s.world->state(ball).pose.position.x < 9; ++i) {
        s.world->step(kStep);
        lowest = std::min(lowest, s.world->state(ball).pose.position.y);
    }
    EXPECT_GT(s.world->state(ball).pose.position.x, 9) << "it gets across";
    EXPECT_GT(lowest, 0.37f);
    for (size_t i = 0; i < planks.size(); ++i) {
        const Pose pose = s.world->state(planks[i]).pose;
        EXPECT_NEAR(pose.position.y, -0.05f, 0.02f) << i;
        EXPECT_GT(rotate(pose.rotation, {0, 1, 0}).y, 0.999f) << i;
    }
}

TEST_P(InMotion, ASlideOverAHillAcrossBricksKeepsItsEnergyAndNeverKicks) {
    for (const bool as_field : {false, true}) {
        // Flat, over a hill of radius 20 m, and flat again; 57 bricks of 0.7 m.
        for (const Solid& solid : {solids()[0], solids()[1], solids()[2]}) {
            Scene s(GetParam());
            s.ground({edit(Plane{}), edit(kiln::Sphere{.radius = 20}, {0, -19.7f, 0}, Op::Union, 3)}, 0);
            const bool lies = solid.convex.kind == Convex::Kind::Capsule;
            const float height = lies ? solid.convex.size.x : half_extents(solid.convex).y;
            const BodyId id = s.add({.shape = as_field ? solid.field() : solid.exact(),
                                     .pose = {{-15, height, 0}, lies ? axis_angle({0, 0, 1}, kPi / 2) : quat{}},
                                     .friction = 0,
                                     .linear_velocity = {6, 0, 0}});
            int kicks = 0;
            for (int i = 0; i < 320; ++i) {
                const float before = s.world->state(id).linear_velocity.y;
                s.world->step(kStep);
                kicks += std::abs(s.world->state(id).linear_velocity.y - before) > 0.3f;
            }
            EXPECT_EQ(kicks, 0) << solid.name << as_field;
            const BodyState state = s.world->state(id);
            EXPECT_GT(state.pose.position.x, 12) << solid.name << as_field;
            const float energy =
                dot(state.linear_velocity, state.linear_velocity) / 2 + kGravity * (state.pose.position.y - height);
            EXPECT_NEAR(energy / 18, 1, 0.01f) << solid.name << as_field;
        }
    }
}

TEST(SlowPhysics, EnginesAgreeOnHowHighPilesAre) {
    // Walled pits, so that nobody rolls away. Where each body comes to lie is chance: a mean of 3600 bodies has a spread of about half a
    // hundredth.
    std::vector<double> means;
    for (const std::string& engine : engines()) {
        double sum = 0;
        for (unsigned seed = 17; seed < 77; ++seed) {
            Scene s(engine);
            s.ground({edit(kiln::Box{.half_extents = {4, 8, 4}}),
                      edit(kiln::Box{.half_extents = {0.8f, 8, 0.8f}}, {0, 4, 0}, Op::Subtract)});
            std::mt19937 rng(seed);
            const auto uniform = [&](float a, float b) { return std::uniform_real_distribution<float>(a, b)(rng); };
            std::vector<BodyId> ids;
            for (int i = 0; i < 60; ++i) {
                const Convex convex = i % 3 == 0   ? Convex::sphere(0.25f)
                                      : i % 3 == 1 ? Convex::box({0.25f, 0.2f, 0.2f})
                                                   : Convex::cylinder(0.2f, 0.22f);
                const vec3 at{((i & 1) != 0 ? 0.38f : -0.38f) + uniform(-0.05f, 0.05f), -3.5f + 0.62f * float(i / 4),
                              ((i & 2) != 0 ? 0.38f : -0.38f) + uniform(-0.05f, 0.05f)};
                ids.push_back(s.add(
                    {.shape = convex, .pose = {at, axis_angle({0, 0, 1}, uniform(0, 3))}, .angular_damping = 0.5f}));
            }
            s.run(6);
            for (const BodyId id : ids) {
                const vec3 p = s.world->state(id).pose.position;
                EXPECT_GT(p.y, -4) << engine;
                EXPECT_LT(std::max(std::abs(p.x), std::abs(p.z)), 0.8f) << engine;
                sum += double(p.y) + 4;
            }
            EXPECT_EQ(s.world->lost(), 0) << engine;
        }
        means.push_back(sum / 3600);
    }
    for (const double mean : means) EXPECT_NEAR(mean / means[0], 1, 0.02);
}

}  // namespace
