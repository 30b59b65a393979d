// SPDX-License-Identifier: MIT
// Starts threads.

#include "physics/rolling.h"

#include "physics/worlds.h"

#include <tuple>

namespace kiln::physics {
namespace {

using namespace worlds;

class Rolling : public testing::TestWithParam<std::tuple<std::string, bool>> {
protected:
    std::string engine() const { return std::get<0>(GetParam()); }
    BodyId ground(Scene& s, const Edit& e, float rolling_friction) const {
        return s.add({.shape = fixed({e}),
                      .motion = Motion::Static,
                      .friction = 1,
                      .mesh_voxel = std::get<1>(GetParam()) ? kVoxel : 0,
                      .rolling_friction = rolling_friction});
    }
};

TEST_P(Rolling, ABallOnTheFlatLosesFiveSeventhsOfItTimesGravity) {
    for (const float rolling : {0.02f, 0.1f}) {
        Scene s(engine());
        ground(s, edit(Plane{}), rolling);
        const BodyId id = s.add({.shape = Convex::sphere(0.5f),
                                 .pose = {{0, 0.5f, 0}, {}},
                                 .friction = 1,
                                 .linear_velocity = {4, 0, 0},
                                 .angular_velocity = {0, 0, -8}});
        s.run(0.5f);
        const float before = s.world->state(id).linear_velocity.x;
        s.run(1);
        const float lost = before - s.world->state(id).linear_velocity.x;
        // Triangles of a plane are uneven by a thousandth of a degree or two, which is worth as much.
        EXPECT_NEAR(lost / (5.0f / 7 * rolling * kGravity), 1, std::get<1>(GetParam()) ? 0.08f : 0.04f) << rolling;
    }
}

TEST_P(Rolling, ABallStaysOnASlopeUpToItAndRollsOnASteeperOne) {
    constexpr float kDegrees = 8;
    const float slope = std::tan(kDegrees * kPi / 180), sine = std::sin(kDegrees * kPi / 180);
    for (const bool as_field : {false, true}) {
        for (const float part : {0.5f, 0.9f, 1.1f}) {
            Scene s(engine());
            ground(s, inclined_plane(kDegrees), 0);
            const Solid ball = solids().front();
            const BodyId id = s.add({.shape = as_field ? ball.field() : ball.exact(),
                                     .pose = {out_of(kDegrees) * 0.5f, {}},
                                     .friction = 1,
                                     .rolling_friction = slope / part});
            s.run(1);
            const vec3 early = s.world->state(id).pose.position;
            s.run(3);
            const BodyState end = s.world->state(id);
            const float way = dot(end.pose.position - early, downhill(kDegrees));
            if (part < 1) {
                EXPECT_LT(std::abs(way), 1e-3f) << part << as_field;
                EXPECT_TRUE(end.asleep) << part << as_field;
            } else {
                // a = 5/7 g (sin - rolling cos)
                const float a = 5.0f / 7 * kGravity * sine * (1 - 1 / part);
                // The first step, before anything was felt, is worth eleven of the others.
                EXPECT_NEAR(dot(end.linear_velocity, downhill(kDegrees)) / (a * 4), 1, 0.1f) << part << as_field;
            }
        }
    }
}

TEST_P(Rolling, ASpunBallAndARockingEggComeToRest) {
    Scene s(engine());
    ground(s, edit(Plane{}), 0.1f);
    const BodyId spun =
        s.add({.shape = Convex::sphere(0.3f), .pose = {{0, 0.3f, 0}, {}}, .angular_velocity = {0, 6, 0}});
    const BodyId egg = s.add({.shape = moving({edit(Ellipsoid{.radii = {0.35f, 0.25f, 0.3f}})}),
                              .pose = {{3, 0.3f, 0}, axis_angle({0, 0, 1}, 0.4f)}});
    s.run(5);
    for (const BodyId id : {spun, egg}) EXPECT_TRUE(s.world->state(id).asleep) << (id == egg);
    // The egg's lowest pose, within what the resistance holds.
    EXPECT_NEAR(s.world->state(egg).pose.position.y, 0.25f, 0.02f);
}

TEST_P(Rolling, WithoutItNothingIsTaken) {
    Scene s(engine());
    ground(s, edit(Plane{}), 0);
    const BodyId id = s.add({.shape = Convex::sphere(0.5f),
                             .pose = {{0, 0.5f, 0}, {}},
                             .friction = 1,
                             .linear_velocity = {2, 0, 0},
                             .angular_velocity = {0, 0, -4}});
    s.run(3);
    EXPECT_NEAR(s.world->state(id).linear_velocity.x, 2, 0.01f);
}

INSTANTIATE_TEST_SUITE_P(Engines, Rolling, testing::Combine(testing::ValuesIn(engines()), testing::Bool()),
                         [](const auto& i) {
                             return std::get<0>(i.param) + (std::get<1>(i.param) ? "Meshed" : "Field");
                         });

TEST(ResistRolling, ShortensWhatGravityWouldMakeAndNeverTurnsItRound) {
    const MassProperties ball{.mass = 2, .moments = {0.2, 0.2, 0.2}};  // radius 0.5
    const Support flat{
        .point = {0, -0.5f, 0}, .normal = {0, 1, 0}, .rolling_friction = 0.1f, .impulse = 2 * 9.81f / 60};
    const vec3 g{0, -9.81f, 0};
    const Velocities rolling{{2, 0, 0}, {0, 0, -4}};
    const Velocities after = resist_rolling(ball, {}, rolling, flat, g, 1.0f / 60);
    EXPECT_NEAR(rolling.linear.x - after.linear.x, 5.0f / 7 * 0.1f * 9.81f / 60, 1e-5f);
    EXPECT_NEAR(after.linear.x + after.angular.z * 0.5f, 0, 1e-5f) << "it still rolls";
    const Velocities slow = resist_rolling(ball, {}, {{1e-3f, 0, 0}, {0, 0, -2e-3f}}, flat, g, 1.0f / 60);
    EXPECT_NEAR(length(slow.linear) + length(slow.angular), 0, 1e-6f);
    const Velocities sliding = resist_rolling(ball, {}, {{2, 0, 0}, {0, 0, 4}}, flat, g, 1.0f / 60);
    EXPECT_EQ(sliding.linear, (vec3{2, 0, 0})) << "what slips is friction's";
    EXPECT_LT(sliding.angular.z, 4);
    EXPECT_EQ(resist_rolling(ball, {}, rolling, {}, g, 1.0f / 60).linear, rolling.linear) << "in the air";
}

}  // namespace
}  // namespace kiln::physics
