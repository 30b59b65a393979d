// SPDX-License-Identifier: MIT
#include "physics/character.h"
#include "physics/worlds.h"

#include <gtest/gtest.h>

#include <cmath>

using namespace kiln;
using namespace kiln::physics;
using namespace kiln::physics::worlds;

namespace {

struct EachCharacter : Engines {};
KILN_EACH_ENGINE(EachCharacter);

constexpr float kFeet = 0.85f;  // of the capsule's centre above them

struct Walk {
    Scene s;
    std::optional<Character> c;
    explicit Walk(const std::string& engine, const std::vector<Edit>& ground, vec3 position = {0, kFeet + 0.01f, 0})
        : s(engine) {
        s.ground(ground);
        start(position);
    }
    void start(vec3 position) {
        auto made = Character::make(*s.world, {}, position);
        EXPECT_TRUE(made) << (made ? "" : made.error().message);
        c = *made;
    }
    void run(float seconds, vec3 walk, float jump = 0) {
        for (int i = 0; i < int(std::lround(seconds / kStep)); ++i) {
            c->move(walk, i == 0 ? jump : 0, kStep);
            s.world->step(kStep);
        }
    }
    vec3 at() const { return c->position(); }
};

TEST_P(EachCharacter, WalksOnTheFlatAtTheSpeedThatIsAskedFor) {
    Walk w(GetParam(), {edit(Plane{})});
    w.run(0.2f, {});
    EXPECT_TRUE(w.c->on_floor());
    const vec3 from = w.at();
    w.run(2, {1.5f, 0, 0.5f});
    EXPECT_NEAR(w.at().x - from.x, 3, 0.01f);
    EXPECT_NEAR(w.at().z - from.z, 1, 0.01f);
    EXPECT_NEAR(w.at().y, kFeet, 0.02f);
    EXPECT_TRUE(w.c->on_floor());
    // Its body is where it is.
    EXPECT_LT(length(w.s.world->state(w.c->body()).pose.position - w.at()), 0.01f);
}

TEST_P(EachCharacter, FallsAsAnythingDoesAndJumpsAsHighAsTheFormulaSays) {
    Walk w(GetParam(), {edit(Plane{})}, {0, kFeet + 5, 0});
    w.run(0.5f, {});
    // Symplectic Euler: g t (t + dt) / 2.
    EXPECT_NEAR(w.at().y, kFeet + 5 - kGravity * 0.5f * (0.5f + kStep) / 2, 0.01f);
    EXPECT_FALSE(w.c->on_floor());
    w.run(1, {});
    EXPECT_TRUE(w.c->on_floor());
    float top = 0;
    w.c->move({}, 4, kStep);
    for (int i = 0; i < 60; ++i) {
        top = std::max(top, w.at().y);
        w.s.world->step(kStep);
        w.c->move({}, 0, kStep);
    }
    EXPECT_NEAR(top - kFeet, 4 * 4 / (2 * kGravity), 0.06f);
    EXPECT_TRUE(w.c->on_floor());
}

TEST_P(EachCharacter, StopsAtAWallAndSlidesAlongIt) {
    Walk w(GetParam(), {edit(Plane{}), edit(kiln::Box{.half_extents = {0.5f, 3, 20}}, {2, 3, 0})});
    w.run(3, {2, 0, 1});
    EXPECT_NEAR(w.at().x, 1.5f - 0.3f, 0.03f);
    EXPECT_NEAR(w.at().z, 3, 0.1f);
    EXPECT_NEAR(w.at().y, kFeet, 0.03f) << "it does not climb";
    // Into a corner it stands.
    Walk corner(GetParam(), {edit(Plane{}), edit(kiln::Box{.half_extents = {0.5f, 3, 20}}, {2, 3, 0}),
                             edit(kiln::Box{.half_extents = {20, 3, 0.5f}}, {0, 3, 2})});
    corner.run(3, {2, 0, 1.5f});
    EXPECT_NEAR(corner.at().x, 1.2f, 0.03f);
    EXPECT_NEAR(corner.at().z, 1.2f, 0.03f);
}

TEST_P(EachCharacter, StepsOntoWhatIsLowAndNotOntoWhatIsHigh) {
    Walk w(GetParam(), {edit(Plane{}), edit(kiln::Box{.half_extents = {1, 0.25f, 2}}, {2, 0, 0}),
                        edit(kiln::Box{.half_extents = {1, 0.7f, 2}}, {4, 0, 0})});
    w.run(3, {1.5f, 0, 0});
    EXPECT_NEAR(w.at().y, kFeet + 0.25f, 0.03f);
    EXPECT_NEAR(w.at().x, 3 - 0.3f, 0.05f);
    // Down again it keeps to the floor.
    for (int i = 0; i < 120; ++i) {
        w.run(kStep, {-1.5f, 0, 0});
        EXPECT_TRUE(w.c->on_floor()) << i;
    }
    EXPECT_NEAR(w.at().y, kFeet, 0.03f);
}

TEST_P(EachCharacter, WalksUpASlopeThatIsNotTooSteepAndNotOneThatIs) {
    for (const float degrees : {30.0f, 65.0f}) {
        Edit ramp = edit(kiln::Box{.half_extents = {6, 1, 3}}, {5, 0, 0});
        ramp.node.transform.rotation = axis_angle({0, 0, 1}, degrees * kPi / 180);
        Walk w(GetParam(), {edit(Plane{}), ramp});
        w.run(3, {1.5f, 0, 0});
        if (degrees < 50) {
            EXPECT_GT(w.at().y, kFeet + 0.8f);
            EXPECT_TRUE(w.c->on_floor());
        } else {
            EXPECT_LT(w.at().y, kFeet + 0.35f);
        }
    }
}

TEST_P(EachCharacter, RidesWhatMovesAndStandsOnBodies) {
    Walk w(GetParam(), {edit(Plane{})}, {0, kFeet + 1.01f, 0});
    const BodyId lift = w.s.add({.shape = Convex::box({1, 0.5f, 1}),
                                 .motion = Motion::Kinematic,
                                 .pose = {{0, 0.5f, 0}, {}},
                                 .linear_velocity = {0.5f, 0.4f, 0}});
    w.run(2, {});
    EXPECT_EQ(w.c->floor(), lift);
    EXPECT_NEAR(w.at().x, 1, 0.05f);
    EXPECT_NEAR(w.at().y, kFeet + 1 + 0.8f, 0.06f);
    w.s.world->set_velocity(lift, {0, -0.4f, 0}, {0, 0.5f, 0});
    w.run(1, {});
    EXPECT_TRUE(w.c->on_floor());
    EXPECT_NEAR(w.at().y, kFeet + 1 + 0.4f, 0.06f);
    // A crate lying on the ground.
    Walk on_crate(GetParam(), {edit(Plane{})}, {0, kFeet + 1.05f, 0});
    const BodyId crate = on_crate.s.add({.shape = Convex::box({0.5f, 0.5f, 0.5f}), .pose = {{0, 0.5f, 0}, {}}});
    on_crate.run(3, {});
    EXPECT_EQ(on_crate.c->floor(), crate);
    EXPECT_NEAR(on_crate.s.world->state(crate).pose.position.y, 0.5f, 0.02f) << "it is not pushed into the ground";
}

TEST_P(EachCharacter, SurvivesItsFloorBeingDugAndBuiltOver) {
    Scene s(GetParam());
    const std::vector<Edit> before{edit(kiln::Box{.half_extents = {10, 1, 10}}, {0, -1, 0}), edit(Plane{}, {0, -4, 0})};
    std::vector<Edit> dug = before, built = before;
    dug.push_back(edit(kiln::Cylinder{.half_height = 3, .radius = 1}, {}, Op::Subtract));
    built.push_back(edit(kiln::Sphere{.radius = 1}, {0.2f, 0, 0}));
    const BodyId ground = s.ground(before);
    auto c = Character::make(*s.world, {}, {0, kFeet + 0.01f, 0});
    ASSERT_TRUE(c);
    const auto run = [&](int steps) {
        float fastest = 0;
        for (int i = 0; i < steps; ++i) {
            c->move({}, 0, kStep);
            s.world->step(kStep);
            fastest = std::max(fastest, length(c->velocity()));
        }
        return fastest;
    };
    run(30);
    ASSERT_TRUE(c->on_floor());
    s.world->set_field(ground, fixed(built), {{-1, -1, -1}, {1.2f, 1, 1}});
    EXPECT_LT(run(120), 7);
    EXPECT_GT(c->position().y, kFeet + 0.5f) << "it stands on what was built";
    s.world->set_field(ground, fixed(dug), {{-1, -4, -1}, {1.2f, 1, 1}});
    run(1);
    EXPECT_NEAR(c->velocity().y, -kGravity / 60, 0.02f * kGravity / 60);
    run(180);
    EXPECT_NEAR(c->position().y, kFeet - 4, 0.05f);
    EXPECT_TRUE(c->on_floor());
    EXPECT_EQ(s.world->lost(), 0);
}

TEST(CharactersAgree, OnEveryEngineToTheMillimetre) {
    std::vector<std::vector<vec3>> ways;
    for (const std::string& engine : engines()) {
        Walk w(engine, {edit(Plane{}), edit(kiln::Sphere{.radius = 2}, {3, -1.2f, 0.3f}, Op::Union, 0.4f),
                        edit(kiln::Box{.half_extents = {0.4f, 0.2f, 3}}, {-2, 0, 0})});
        ways.emplace_back();
        for (int i = 0; i < 8; ++i) {
            w.run(0.5f, {i < 6 ? 1.5f : -2.0f, 0, 0.4f * float(i % 3)}, i == 4 ? 3.0f : 0.0f);
            ways.back().push_back(w.at());
        }
    }
    for (size_t e = 1; e < ways.size(); ++e)
        for (size_t i = 0; i < ways[0].size(); ++i) EXPECT_LT(length(ways[e][i] - ways[0][i]), 1e-3f) << i;
}

}  // namespace
