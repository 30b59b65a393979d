// SPDX-License-Identifier: MIT
// Starts threads.
// Ground that is meshed by regions where it has settled, beside the field that it is meshed from.
#include "physics/physics.h"
#include "physics/worlds.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

using namespace kiln;
using namespace kiln::physics;
using namespace kiln::physics::worlds;

namespace {

struct MeshedGround : Engines {};
KILN_EACH_ENGINE(MeshedGround);

constexpr float kCell = 0.1f;
constexpr float kSide = kCell * float(kRegionCells * field::kBrickVoxels);  // of a region
constexpr float kLanded = 1;  // seconds: settled, meshed and landed, with room

BodySettings ground_of(const std::vector<Edit>& edits, bool mesh, float friction = 0.5f) {
    return {
        .shape = fixed(edits, kCell), .motion = Motion::Static, .friction = friction, .mesh_voxel = mesh ? kCell : 0};
}
size_t meshed_regions(const Scene& s, BodyId ground) {
    const SdfShape* shape = solid_of(*s.world->shape(ground));
    return shape->regions() != nullptr ? shape->regions()->size() : 0;
}

TEST_P(MeshedGround, ThingsComeToRestWhereTheyDoOnTheField) {
    // Smooth: a plane and a basin. Sharp: on the edge of a block, half over it.
    const std::vector<Edit> edits{edit(Plane{}, {0, 0.03f, 0}),
                                  edit(kiln::Sphere{.radius = 3}, {-6, 2.5f, 0}, Op::Subtract, 0.2f),
                                  edit(kiln::Box{.half_extents = {1.53f, 0.52f, 1.5f}}, {6, 0, 0})};
    struct Drop {
        Solid solid;
        vec3 at;
        bool sharp;
    };
    std::vector<Drop> drops;
    for (const Solid& solid : solids()) {
        const float x = 1.5f * float(drops.size());
        drops.push_back({solid, {x - 4, 0.8f, 4.1f}, false});
    }
    drops.push_back({solids()[0], {-6, 0.4f, 0.1f}, false});
    drops.push_back({solids()[1], {6.1f, 1.1f, 0.1f}, true});
    drops.push_back({solids()[1], {7.2f, 1.1f, 1.2f}, true});
    std::vector<std::vector<vec3>> rests;
    for (const bool mesh : {false, true}) {
        Scene s(GetParam());
        const BodyId ground = s.add(ground_of(edits, mesh));
        std::vector<BodyId> ids;
        for (const Drop& d : drops) {
            const bool lies = d.solid.convex.kind == Convex::Kind::Capsule;
            ids.push_back(s.add({.shape = d.solid.exact(),
                                 .pose = {d.at, lies ? axis_angle({1, 0, 0}, kPi / 2) : quat{}},
                                 .linear_damping = 0.5f,
                                 .angular_damping = 0.5f}));
        }
        s.run(8);
        EXPECT_EQ(meshed_regions(s, ground) > 0, mesh);
        rests.emplace_back();
        for (const BodyId id : ids) rests.back().push_back(s.world->state(id).pose.position);
        EXPECT_EQ(s.world->lost(), 0);
    }
    for (size_t i = 0; i < drops.size(); ++i)
        EXPECT_LT(length(rests[0][i] - rests[1][i]), (drops[i].sharp ? 0.5f : 0.25f) * kCell)
            << drops[i].solid.name << " " << i;
}

TEST_P(MeshedGround, ASlideAcrossRegionsKeepsItsEnergyAndNeverKicks) {
    // 6 m/s along the border of two rows of regions, across those of four columns; in the end over ground that is not meshed yet.
    const Solid small{"small ball", Convex::sphere(0.15f), kiln::Sphere{.radius = 0.15f}};
    for (const Solid& solid : {solids()[0], small, solids()[1], solids()[2]}) {
        Scene s(GetParam());
        const BodyId ground = s.add(ground_of({edit(Plane{}, {0, 0.03f, 0})}, true, 0));
        // What lies here and there has the regions meshed ahead of it.
        std::vector<BodyId> scouts;
        for (float x = -2.5f * kSide; x < kSide; x += kSide)
            for (const float z : {-2.0f, 2.0f})
                scouts.push_back(s.add({.shape = Convex::sphere(0.3f), .pose = {{x, 0.4f, z}, {}}}));
        s.run(kLanded);
        ASSERT_GE(meshed_regions(s, ground), 8u);
        const bool lies = solid.convex.kind == Convex::Kind::Capsule;  // along its way
        // It comes down from 2 cm, and so a little into the ground.
        const float height = (lies ? solid.convex.size.x : half_extents(solid.convex).y) + 0.05f;
        const BodyId id =
            s.add({.shape = solid.exact(),
                   .pose = {{-2.6f * kSide, height, 0.01f}, lies ? axis_angle({0, 0, 1}, kPi / 2) : quat{}},
                   .friction = 0,
                   .linear_velocity = {6, 0, 0}});
        int kicks = 0;
        for (int i = 0; i < 420; ++i) {
            const vec3 before = s.world->state(id).linear_velocity;
            s.world->step(kStep);
            const vec3 change = s.world->state(id).linear_velocity - before;
            kicks += std::hypot(change.x, change.z) > 0.1f || (i > 20 && std::abs(change.y) > 0.3f);
        }
        EXPECT_EQ(kicks, 0) << solid.name;
        EXPECT_GT(s.world->state(id).pose.position.x, kSide) << "past what the scouts saw";
        const vec3 v = s.world->state(id).linear_velocity;
        EXPECT_NEAR(dot(v, v) / 36, 1, 0.01f) << solid.name;
    }
}

TEST_P(MeshedGround, ASlideOverAMeshedHillKeepsItsEnergyAndNeverKicks) {
    // Flat, over a hill of radius 30 m, and flat again, along the border of two rows of regions and across three.
    const std::vector<Edit> edits{edit(Plane{}, {0, 0.03f, 0}),
                                  edit(kiln::Sphere{.radius = 30}, {0, -29.8f, 0}, Op::Union, 3)};
    Scene s(GetParam());
    const BodyId ground = s.add(ground_of(edits, true, 0));
    for (const float x : {-1.5f * kSide, -0.5f * kSide, 0.5f * kSide})
        for (const float z : {-2.0f, 2.0f})
            s.add({.shape = Convex::box({0.2f, 0.2f, 0.2f}), .pose = {{x, 0.5f, z}, {}}});
    s.run(kLanded);
    ASSERT_GE(meshed_regions(s, ground), 6u);
    for (const Solid& solid : {solids()[0], solids()[1], solids()[2]}) {
        const bool lies = solid.convex.kind == Convex::Kind::Capsule;
        const float height = (lies ? solid.convex.size.x : half_extents(solid.convex).y) + 0.03f;
        const BodyId id = s.add({.shape = solid.exact(),
                                 .pose = {{-17, height, 0.01f}, lies ? axis_angle({0, 0, 1}, kPi / 2) : quat{}},
                                 .friction = 0,
                                 .linear_velocity = {6, 0, 0}});
        int kicks = 0;
        for (int i = 0; i < 340; ++i) {
            const float before = s.world->state(id).linear_velocity.y;
            s.world->step(kStep);
            kicks += std::abs(s.world->state(id).linear_velocity.y - before) > 0.3f;
        }
        EXPECT_EQ(kicks, 0) << solid.name;
        const BodyState state = s.world->state(id);
        EXPECT_GT(state.pose.position.x, 10) << solid.name;
        const float energy =
            dot(state.linear_velocity, state.linear_velocity) / 2 + kGravity * (state.pose.position.y - height);
        EXPECT_NEAR(energy / 18, 1, 0.01f) << solid.name;
        s.world->remove(id);
    }
}

TEST_P(MeshedGround, ABallRollsDownAMeshedSlopeAsTheFormulaSays) {
    const float degrees = 20;
    Scene s(GetParam());
    s.add(ground_of({inclined_plane(degrees)}, true, 1));
    // At rest until the region is meshed: held by a peg that is then taken away.
    const BodyId peg = s.add(
        {.shape = Convex::box({0.1f, 1, 1}),
         .motion = Motion::Static,
         .pose = {out_of(degrees) * 0.5f + downhill(degrees) * 0.61f, axis_angle({0, 0, 1}, -degrees * kPi / 180)},
         .friction = 0});
    const BodyId id = s.add({.shape = Convex::sphere(0.5f), .pose = {out_of(degrees) * 0.5f, {}}, .friction = 1});
    s.run(kLanded);
    s.world->remove(peg);
    const float before = dot(s.world->state(id).linear_velocity, downhill(degrees));
    s.run(2);
    const float a = (dot(s.world->state(id).linear_velocity, downhill(degrees)) - before) / 2;
    EXPECT_NEAR(a / (5.0f / 7 * kGravity * std::sin(degrees * kPi / 180)), 1, 0.01f);
}

TEST_P(MeshedGround, DiggingUnderASleeperLetsItFallOnTheNextStepAndTheHoleIsMeshedInTime) {
    Scene s(GetParam());
    const std::vector<Edit> before{edit(kiln::Box{.half_extents = {20, 1, 20}}, {0, -1, 0})};
    std::vector<Edit> after = before;
    after.push_back(edit(kiln::Sphere{.radius = 1.2f}, {2, 0, 2}, Op::Subtract));
    const BodyId ground = s.add(ground_of(before, true));
    const BodyId id = s.add({.shape = Convex::box({0.5f, 0.5f, 0.5f}), .pose = {{2, 0.5f, 2}, {}}});
    const BodyId far = s.add({.shape = Convex::box({0.5f, 0.5f, 0.5f}), .pose = {{8, 0.5f, 2}, {}}});
    int ended = 0;
    const auto run = [&](int steps) {
        for (int i = 0; i < steps; ++i) {
            s.world->step(kStep);
            for (const ContactEvent& e : s.world->events()) ended += !e.began;
        }
    };
    run(240);
    ASSERT_TRUE(s.world->state(id).asleep && s.world->state(far).asleep);
    const size_t meshed = meshed_regions(s, ground);
    ASSERT_GT(meshed, 0u);
    EXPECT_EQ(ended, 0) << "landing a mesh under a body is no event";
    s.world->set_field(ground, worlds::fixed(after), {{0.8f, -1.2f, 0.8f}, {3.2f, 1.2f, 3.2f}});
    EXPECT_LT(meshed_regions(s, ground), meshed) << "it is a field again, at once";
    run(1);
    EXPECT_NEAR(s.world->state(id).linear_velocity.y, -kGravity / 60, 0.01f * kGravity / 60);
    EXPECT_TRUE(s.world->state(far).asleep);
    run(180);
    EXPECT_EQ(meshed_regions(s, ground), meshed);
    EXPECT_LT(s.world->state(id).pose.position.y, -0.3f);
    EXPECT_GT(s.world->state(id).pose.position.y, -0.75f);
    EXPECT_EQ(s.world->state(far).pose.position.y, s.world->state(far).pose.position.y);
}

TEST_P(MeshedGround, MeshesLandInAStepThatSimulatedTimeAloneSays) {
    // Whoever did the work, and however long it took: by the step after settling and meshing time, and not a step before.
    for (const int threads : {1, 2}) {
        auto world = make_world(GetParam(), {.threads = threads});
        ASSERT_TRUE(world);
        const BodyId ground = *(*world)->add(ground_of({edit(Plane{}, {0, 0.03f, 0})}, true));
        (void)*(*world)->add({.shape = Convex::sphere(0.5f), .pose = {{2, 0.6f, 2}, {}}});
        const auto regions = [&] { return solid_of(*(*world)->shape(ground))->regions()->size(); };
        // Seen in the first step, at its beginning; the first half second ends with step 30, the meshing time with step 42.
        for (int i = 1; i <= 60; ++i) {
            (*world)->step(kStep);
            EXPECT_EQ(regions() > 0, i >= 42) << i;
        }
    }
}

TEST_P(MeshedGround, TheSameStepsGiveTheSameBytesForAnyNumberOfThreadsAndAnyLoad) {
    std::vector<std::vector<Pose>> all;
    for (const int threads : {1, 2}) {
        auto world = make_world(GetParam(), {.threads = threads});
        ASSERT_TRUE(world);
        const std::vector<Edit> edits{edit(Plane{}), edit(kiln::Sphere{.radius = 1}, {0, 0, 0}, Op::Union, 0.3f)};
        const BodyId ground = *(*world)->add(ground_of(edits, true));
        const auto torus = moving({edit(kiln::Torus{.major_radius = 0.4f, .minor_radius = 0.15f})});
        std::vector<BodyId> ids;
        for (int i = 0; i < 24; ++i) {
            const BodyShape shape = i % 4 == 3 ? BodyShape(torus) : solids()[size_t(i) % 4].exact();
            ids.push_back(*(*world)->add(
                {.shape = shape, .pose = {{0.1f * float(i % 5), 2 + 0.5f * float(i), 0.1f * float(i % 3)}, {}}}));
        }
        for (int i = 0; i < 140; ++i) {
            if (i == 80) {
                std::vector<Edit> dug = edits;
                dug.push_back(edit(kiln::Sphere{.radius = 0.8f}, {0.5f, 0, 0}, Op::Subtract));
                (*world)->set_field(ground, worlds::fixed(dug, kCell), {{-0.3f, -0.8f, -0.8f}, {1.3f, 0.8f, 0.8f}});
            }
            (*world)->step(kStep);
        }
        all.emplace_back();
        for (const BodyId id : ids) all.back().push_back((*world)->state(id).pose);
    }
    EXPECT_EQ(all[0], all[1]);
}

TEST_P(MeshedGround, ABulletStopsAtAThinWallAndABuriedBodyComesOut) {
    Scene s(GetParam(), {0, 0, 0});
    s.add(ground_of({edit(kiln::Box{.half_extents = {0.05f, 5, 5}})}, true));
    s.add({.shape = Convex::sphere(0.05f), .pose = {{-1, 0.2f, 0.1f}, {}}});
    s.run(kLanded);
    const BodyId id = s.add({.shape = Convex::sphere(0.05f),
                             .pose = {{-7.3f, 0.4f, 0.1f}, {}},
                             .continuous = true,
                             .linear_velocity = {1000, 0, 0}});
    s.run(0.5f);
    EXPECT_NEAR(s.world->state(id).pose.position.x, -0.1f, 0.05f);
    Scene deep(GetParam());
    deep.add(ground_of({edit(Plane{}, {0, 2, 0})}, true));
    const BodyId scout = deep.add({.pose = {{3, 2.5f, 2}, {}}});
    deep.run(kLanded);
    const BodyId buried = deep.add({.pose = {{5, 1.2f, 2}, {}}});  // no triangle is as near
    deep.run(5);
    EXPECT_NEAR(deep.world->state(buried).pose.position.y, 2.5f, 0.1f);
    EXPECT_NEAR(deep.world->state(scout).pose.position.y, 2.5f, 0.02f);
    EXPECT_EQ(deep.world->lost(), 0);
}

TEST_P(MeshedGround, OnlyStaticFieldsHaveIt) {
    Scene s(GetParam());
    const auto refused = [&](BodySettings b) {
        auto id = s.world->add(b);
        return id ? std::string("taken") : id.error().message;
    };
    EXPECT_THAT(refused({.mesh_voxel = 0.1f}), testing::HasSubstr("static fields"));
    EXPECT_THAT(refused({.shape = fixed({edit(Plane{})}), .motion = Motion::Static, .mesh_voxel = -1}),
                testing::HasSubstr("static fields"));
}

}  // namespace
