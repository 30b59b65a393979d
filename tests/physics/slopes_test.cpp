// SPDX-License-Identifier: MIT
// Starts threads.
// Bodies on inclines, where closed forms say what they do, on every engine that runs here.
#include "physics/physics.h"
#include "physics/sdf_collision.h"
#include "physics/worlds.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

using namespace kiln;
using namespace kiln::physics;
using namespace kiln::physics::worlds;

namespace {

struct OnSlopes : Engines {};
KILN_EACH_ENGINE(OnSlopes);

TEST_P(OnSlopes, ABallRollsDownASlopeAtFiveSeventhsOfItsPull) {
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
            EXPECT_NEAR(dot(state.linear_velocity, downhill(degrees)) / 2 / expected, 1, 0.002) << degrees << as_field;
            EXPECT_NEAR(dot(state.pose.position, out_of(degrees)), 0.5f, 0.001f) << degrees << as_field;
        }
    }
}

TEST_P(OnSlopes, ACylinderRollsDownASlopeAtTwoThirdsAndACapsuleLikeIt) {
    const float degrees = 20;
    for (const bool as_field : {false, true}) {
        for (const Solid& solid : {solids()[2], solids()[3]}) {
            Scene s(GetParam());
            s.ground({inclined_plane(degrees)}, 1);
            const float r = solid.convex.size.x;
            // Lying across the slope.
            const BodyId id = s.add({.shape = as_field ? solid.field() : solid.exact(),
                                     .pose = {out_of(degrees) * r, axis_angle({1, 0, 0}, kPi / 2)},
                                     .friction = 1});
            s.run(1.5f);
            const double k = moments(solid.convex).y / double(r * r);
            const float expected = kGravity * std::sin(degrees * kPi / 180) / float(1 + k);
            EXPECT_NEAR(dot(s.world->state(id).linear_velocity, downhill(degrees)) / 1.5f / expected, 1,
                        as_field ? 0.02 : 0.01)
                << solid.name << as_field;
        }
    }
}

TEST_P(OnSlopes, ABallRollsWhereFrictionIsTwoSeventhsOfTheSlopeAndSlipsBelow) {
    const float degrees = 30, sine = std::sin(degrees * kPi / 180), cosine = std::cos(degrees * kPi / 180);
    for (const bool as_field : {false, true}) {
        for (const float ratio : {0.98f, 1.02f}) {
            const float mu = ratio * 2 / 7 * sine / cosine;
            Scene s(GetParam());
            s.ground({inclined_plane(degrees)}, mu);
            const Solid ball = solids()[0];
            const BodyId id = s.add({.shape = as_field ? ball.field() : ball.exact(),
                                     .pose = {out_of(degrees) * 0.5f, {}},
                                     .friction = mu});
            s.run(2);
            const BodyState state = s.world->state(id);
            // Of the place it touches: v - ω r. Where it slips, g t (sin - 7/2 mu cos), a small difference of large numbers.
            const float slip = dot(state.linear_velocity, downhill(degrees)) + 0.5f * state.angular_velocity.z;
            const float expected = std::max(2 * kGravity * sine * (1 - ratio), 0.0f);
            EXPECT_NEAR(slip, expected, 0.01f + 0.3f * expected) << ratio << as_field;
        }
    }
}

TEST_P(OnSlopes, ABoxStaysBelowTheAngleOfFrictionAndSlidesAbove) {
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

TEST_P(OnSlopes, FrictionHoldsAsMuchWhicheverWayABoxSlides) {
    const float mu = 0.5f, speed = 4;
    for (const float degrees : {0.0f, 20.0f, 45.0f, 70.0f}) {
        Scene s(GetParam());
        s.ground({edit(Plane{})}, mu);
        const vec3 ahead{std::cos(degrees * kPi / 180), 0, std::sin(degrees * kPi / 180)};
        const BodyId id = s.add({.shape = Convex::box({0.5f, 0.2f, 0.5f}),
                                 .pose = {{0, 0.2f, 0}, {}},
                                 .friction = mu,
                                 .linear_velocity = ahead * speed});
        s.run(2);
        const vec3 way = s.world->state(id).pose.position;
        // A step's way late, as each step moves with the velocity at its end.
        const float expected = speed * speed / (2 * mu * kGravity);
        EXPECT_NEAR(dot(way, ahead), expected, 0.5f * speed * kStep + 0.01f * expected) << degrees;
        EXPECT_LT(length(cross(way, ahead) - cross(vec3{0, 0.2f, 0}, ahead)), 0.02f) << degrees;
    }
}

TEST_P(OnSlopes, FrictionOfAPairIsTheGeometricMeanAndBounceTheLarger) {
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

TEST_P(OnSlopes, ATorusSlidesDownARampFlat) {
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

TEST_P(OnSlopes, AFrictionlessSlideKeepsItsSpeedAndNeverKicks) {
    for (const bool as_field : {false, true}) {
        for (const Solid& solid : {solids()[0], solids()[1], solids()[2]}) {
            Scene s(GetParam());
            s.ground({edit(Plane{})}, 0);
            const bool lies = solid.convex.kind == Convex::Kind::Capsule;
            const float height = lies ? solid.convex.size.x : half_extents(solid.convex).y;
            const BodyId id = s.add({.shape = as_field ? solid.field() : solid.exact(),
                                     .pose = {{-20, height, 0}, lies ? axis_angle({0, 0, 1}, kPi / 2) : quat{}},
                                     .friction = 0,
                                     .linear_velocity = {6, 0, 0}});
            for (int i = 0; i < 320; ++i) {
                const float before = s.world->state(id).linear_velocity.y;
                s.world->step(kStep);
                EXPECT_LT(std::abs(s.world->state(id).linear_velocity.y - before), 0.3f) << solid.name << as_field << i;
            }
            EXPECT_NEAR(s.world->state(id).linear_velocity.x, 6, 0.03f) << solid.name << as_field;
        }
    }
}

TEST_P(OnSlopes, AFrictionlessBallInABowlKeepsItsEnergy) {
    for (const bool as_field : {false, true}) {
        // A hollow ball of radius 4, open at the top. A step takes the part of the velocity that points out of the bowl after it, at most
        // (v t / r)² of the energy: the engines may lose that, not more. Shorter steps lose less.
        for (const int part : {1, 4}) {
            Scene b(GetParam());
            b.ground({edit(kiln::Box{.half_extents = {6, 3, 6}}, {0, -3, 0}),
                      edit(kiln::Sphere{.radius = 4}, {}, Op::Subtract)},
                     0);
            const float r = 0.3f, arm = 4 - r;
            const BodyId id =
                b.add({.shape = as_field ? BodyShape(moving({edit(kiln::Sphere{.radius = r})})) : Convex::sphere(r),
                       .pose = {{arm * std::sin(0.65f), -arm * std::cos(0.65f), 0}, {}},
                       .friction = 0});
            const auto energy = [&] {
                const BodyState state = b.world->state(id);
                return kGravity * (state.pose.position.y + arm) +
                       0.5f * dot(state.linear_velocity, state.linear_velocity);
            };
            const float before = energy();
            float most = before;
            for (int i = 0; i < 600 * part; ++i) {
                b.world->step(kStep / float(part));
                most = std::max(most, energy());
                // It stays on the bowl.
                EXPECT_NEAR(length(b.world->state(id).pose.position), arm, 0.05f) << as_field;
            }
            EXPECT_LT(most, before * 1.005f) << part << as_field;
            EXPECT_GT(energy(), before * (part == 1 ? 0.92f : 0.96f)) << part << as_field;
        }
    }
}

TEST_P(OnSlopes, AFrictionlessBallInARingsTroughKeepsItsEnergy) {
    // The lower half of a hollow ring, R 4 and r 2: the ball swings across the tube while it goes round.
    for (const bool as_field : {false, true}) {
        for (const int part : {1, 4}) {
            Scene b(GetParam());
            b.ground(ring_trough(), 0);
            const float r = 0.3f, arm = 2 - r, angle = 0.4f;
            const BodyId id =
                b.add({.shape = as_field ? BodyShape(moving({edit(kiln::Sphere{.radius = r})})) : Convex::sphere(r),
                       .pose = {{4 + arm * std::sin(angle), -arm * std::cos(angle), 0}, {}},
                       .friction = 0,
                       .linear_velocity = {0, 0, 1}});
            const auto energy = [&] {
                const BodyState state = b.world->state(id);
                return kGravity * (state.pose.position.y + arm) +
                       0.5f * dot(state.linear_velocity, state.linear_velocity);
            };
            const float before = energy();
            float most = before, round = 0;
            for (int i = 0; i < 600 * part; ++i) {
                b.world->step(kStep / float(part));
                most = std::max(most, energy());
                const vec3 at = b.world->state(id).pose.position;
                EXPECT_NEAR(std::hypot(std::hypot(at.x, at.z) - 4, at.y), arm, 0.05f) << as_field;
                round = std::max(round, std::abs(at.z));
            }
            EXPECT_GT(round, 3) << "it goes round";
            EXPECT_LT(most, before * 1.005f) << part << as_field;
            EXPECT_GT(energy(), before * (part == 1 ? 0.92f : 0.96f)) << part << as_field;
        }
    }
}

}  // namespace
