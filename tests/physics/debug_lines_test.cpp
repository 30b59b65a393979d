// SPDX-License-Identifier: MIT
// Starts threads.
#include "physics/debug_lines.h"

#include "physics/worlds.h"

#include <gtest/gtest.h>

#include <algorithm>

using namespace kiln;
using namespace kiln::physics;
using namespace kiln::physics::worlds;

namespace {

struct EachPicture : Engines {};
KILN_EACH_ENGINE(EachPicture);

TEST_P(EachPicture, ShowsShapesHowTheyMoveAndWhereTheyTouch) {
    Scene s(GetParam());
    const BodyId ground = s.ground({edit(Plane{})});
    std::vector<BodyId> ids{ground};
    for (const Solid& solid : solids()) {
        const float x = 3 * float(ids.size());
        ids.push_back(s.add({.shape = solid.exact(), .pose = {{x, half_extents(solid.convex).y, 0}, {}}}));
        ids.push_back(s.add({.shape = solid.field(), .pose = {{x, half_extents(solid.convex).y, 4}, {}}}));
    }
    const BodyId lift = s.add({.motion = Motion::Kinematic, .pose = {{-5, 4, 0}, {}}});
    ids.push_back(lift);
    s.world->step(kStep);
    const auto of = [&](vec3 color) {
        std::vector<Line> out;
        for (const Line& l : lines(*s.world, ids))
            if (l.color == color) out.push_back(l);
        return out;
    };
    EXPECT_TRUE(of(kStanding).empty()) << "a ground without end has no box";
    EXPECT_FALSE(of(kKinematic).empty());
    EXPECT_FALSE(of(kAwake).empty());
    EXPECT_TRUE(of(kAsleep).empty());
    // Every line of a shape lies on it, or on the box around a field.
    for (const Line& l : lines(*s.world, std::span(&ids[3], 1), {.contacts = false}))
        for (const dvec3 p : {l.a, l.b}) EXPECT_NEAR(p.y > 0.5 ? p.y - 1 : p.y, 0, 1e-3);
    for (const Line& l : of(kContact)) {
        EXPECT_NEAR(l.a.y, 0, 0.02) << "on the ground";
        EXPECT_NEAR(l.b.y - l.a.y, 0.2, 0.01) << "normals out of it";
    }
    EXPECT_GE(of(kContact).size(), 4u * 2 + 6);
    s.run(8);
    EXPECT_FALSE(of(kAsleep).empty());
    s.world->remove(lift);
    EXPECT_TRUE(of(kKinematic).empty());
}

}  // namespace
