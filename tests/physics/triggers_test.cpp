// SPDX-License-Identifier: MIT
// Starts threads.
#include "physics/triggers.h"
#include "physics/worlds.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

using namespace kiln;
using namespace kiln::physics;
using namespace kiln::physics::worlds;

namespace {

struct EachTrigger : Engines {};
KILN_EACH_ENGINE(EachTrigger);

std::shared_ptr<const SdfShape> ball(float radius) { return moving({edit(kiln::Sphere{.radius = radius})}); }

TEST_P(EachTrigger, TellsWhoComesAndGoesOnceEach) {
    for (const bool as_field : {false, true}) {
        Scene s(GetParam());
        s.ground({edit(Plane{})});
        Triggers triggers;
        const TriggerId gate = triggers.add(moving({edit(kiln::Box{.half_extents = {1, 0.25f, 1}})}), {{0, 3, 0}, {}});
        const Solid solid = solids()[0];
        const BodyId id = s.add({.shape = as_field ? solid.field() : solid.exact(), .pose = {{0, 6, 0}, {}}});
        std::vector<TriggerEvent> told;
        std::vector<float> heights;
        for (int i = 0; i < 180; ++i) {
            s.world->step(kStep);
            triggers.update(*s.world);
            for (const TriggerEvent& e : triggers.events()) {
                told.push_back(e);
                heights.push_back(s.world->state(id).pose.position.y);
            }
        }
        ASSERT_THAT(told, testing::ElementsAre(TriggerEvent{gate, id, true}, TriggerEvent{gate, id, false}))
            << as_field;
        // In from 3.75 down to 2.25, and a step of 0.13 m.
        EXPECT_GT(heights[0], 3.75f - 0.15f);
        EXPECT_LT(heights[0], 3.76f);
        EXPECT_LT(heights[1], 2.26f);
        EXPECT_GT(heights[1], 2.25f - 0.2f);
    }
}

TEST_P(EachTrigger, FindsBodiesThatAreLargerThanItSleepersAndKinematicOnesButNotWhatStands) {
    Scene s(GetParam());
    s.ground({edit(Plane{})});
    const BodyId large = s.add({.shape = ball(2), .pose = {{0, 2, 0}, {}}});
    const BodyId kinematic =
        s.add({.shape = Convex::box({0.5f, 0.5f, 0.5f}), .motion = Motion::Kinematic, .pose = {{8, 0.9f, 0}, {}}});
    Triggers triggers;
    const TriggerId inner = triggers.add(ball(0.2f), {{0, 2, 0}, {}});
    const TriggerId both = triggers.add(moving({edit(kiln::Box{.half_extents = {10, 0.5f, 1}})}), {});
    for (int i = 0; i < 300; ++i) {
        s.world->step(kStep);
        triggers.update(*s.world);
        if (i == 0) {
            EXPECT_THAT(triggers.events(),
                        testing::ElementsAre(TriggerEvent{inner, large, true}, TriggerEvent{both, large, true},
                                             TriggerEvent{both, kinematic, true}));
        } else {
            EXPECT_TRUE(triggers.events().empty()) << i;
        }
    }
    EXPECT_TRUE(s.world->state(large).asleep);
}

TEST_P(EachTrigger, LeaveIsToldWhenTheBodyOrTheTriggerIsNoMore) {
    Scene s(GetParam(), {0, 0, 0});
    Triggers triggers;
    const TriggerId first = triggers.add(ball(1), {}), second = triggers.add(ball(1), {});
    const BodyId a = s.add({.shape = Convex::sphere(0.2f)}),
                 b = s.add({.shape = Convex::sphere(0.2f), .pose = {{0.5f, 0, 0}, {}}});
    const auto step = [&] {
        s.world->step(kStep);
        triggers.update(*s.world);
        return std::vector<TriggerEvent>(triggers.events().begin(), triggers.events().end());
    };
    EXPECT_EQ(step().size(), 4u);
    s.world->remove(a);
    EXPECT_THAT(step(), testing::ElementsAre(TriggerEvent{first, a, false}, TriggerEvent{second, a, false}));
    triggers.remove(first);
    triggers.remove(first);  // twice does nothing
    EXPECT_THAT(step(), testing::ElementsAre(TriggerEvent{first, b, false}));
    // The place is used again under another id.
    const TriggerId third = triggers.add(ball(1), {});
    EXPECT_EQ(third.index, first.index);
    EXPECT_NE(third, first);
    EXPECT_THAT(step(), testing::ElementsAre(TriggerEvent{third, b, true}));
    EXPECT_TRUE(step().empty());
}

}  // namespace
