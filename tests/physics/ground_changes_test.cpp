// SPDX-License-Identifier: MIT
// Starts threads.
// Ground that is dug away or built while bodies lie on it, on every engine that runs here.
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

struct ChangedGround : Engines {};
KILN_EACH_ENGINE(ChangedGround);

TEST_P(ChangedGround, GroundTakenAwayUnderASleeperLetsItFallOnTheNextStep) {
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

TEST_P(ChangedGround, DiggingUnderASleeperLetsItFallOnTheNextStepAndOnlyThere) {
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
        s.world->set_field(ground, worlds::fixed(after), {{-1.2f, -1.2f, -1.2f}, {1.2f, 1.2f, 1.2f}});
        s.world->step(kStep);
        EXPECT_NEAR(s.world->state(id).linear_velocity.y, -kGravity / 60, 0.01f * kGravity / 60) << as_field;
        EXPECT_TRUE(s.world->state(far).asleep);
        s.run(3);
        EXPECT_LT(s.world->state(id).pose.position.y, -0.3f) << as_field;
        EXPECT_GT(s.world->state(id).pose.position.y, -0.75f) << as_field;
        EXPECT_NEAR(s.world->state(far).pose.position.y, 0.5f, 0.01f);
    }
}

TEST_P(ChangedGround, BuildingInsideASleeperPushesItOutWithoutAShot) {
    for (const bool as_field : {false, true}) {
        Scene s(GetParam());
        const std::vector<Edit> before{edit(Plane{})};
        std::vector<Edit> after = before;
        after.push_back(edit(kiln::Sphere{.radius = 1}, {0.1f, 0, 0}));
        const BodyId ground = s.ground(before);
        const BodyId id =
            s.add({.shape = as_field ? BodyShape(moving({edit(kiln::Box{.half_extents = {0.4f, 0.4f, 0.4f}})}))
                                     : Convex::box({0.4f, 0.4f, 0.4f}),
                   .pose = {{0, 0.4f, 0}, {}}});
        s.run(3);
        const auto field = field_of(after);
        s.world->set_field(ground, SdfShape::fixed(field), {{-1, -1, -1}, {1.2f, 1, 1}});
        float fastest = 0;
        for (int i = 0; i < 240; ++i) {
            s.world->step(kStep);
            fastest = std::max(fastest, length(s.world->state(id).linear_velocity));
        }
        EXPECT_LT(fastest, 8) << as_field;
        EXPECT_GT(field->distance(s.world->state(id).pose.position), 0.35f) << as_field;
        EXPECT_EQ(s.world->lost(), 0);
    }
}

}  // namespace
