// SPDX-License-Identifier: MIT
// Starts threads.
// Bodies in motion, questions about them, and what is refused, on every engine that runs here.
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

struct EachEngine : Engines {};
KILN_EACH_ENGINE(EachEngine);

TEST_P(EachEngine, ABulletStopsAtAThinWallUpToAThousandMetresASecond) {
    for (const bool as_field : {false, true}) {
        for (const float speed : {50.0f, 200.0f, 1000.0f}) {
            Scene s(GetParam(), {0, 0, 0});
            s.ground({edit(kiln::Box{.half_extents = {0.05f, 5, 5}})});
            const BodyId id = s.add({.shape = as_field ? BodyShape(moving({edit(kiln::Sphere{.radius = 0.05f})}))
                                                       : BodyShape(Convex::sphere(0.05f)),
                                     .pose = {{-7.3f, 0.2f, 0.1f}, {}},
                                     .continuous = true,
                                     .linear_velocity = {speed, 0, 0}});
            s.run(0.5f);
            const BodyState state = s.world->state(id);
            EXPECT_NEAR(state.pose.position.x, -0.1f, 0.02f) << speed << as_field;
        }
    }
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

TEST_P(EachEngine, AFieldOfManyPartsMeetsEverythingWithAllOfThem) {
    // Two blocks on a rod: it lies on both, on a field, on a box, and on one of its own kind across.
    const kiln::Box block{.half_extents = {0.4f, 0.4f, 0.4f}};
    const auto dumbbell =
        moving({edit(block, {-1, 0, 0}), edit(block, {1, 0, 0}), edit(kiln::Box{.half_extents = {1, 0.1f, 0.1f}})});
    Scene s(GetParam());
    s.ground({edit(Plane{})}, 1);
    s.add({.shape = Convex::box({1.5f, 0.5f, 0.5f}),
           .motion = Motion::Static,
           .pose = {{6, 0.5f, 0}, {}},
           .friction = 1});
    const BodyId low = s.add({.shape = dumbbell, .pose = {{0, 0.45f, 0}, {}}, .friction = 1, .angular_damping = 1});
    const BodyId boxed = s.add({.shape = dumbbell, .pose = {{6, 1.45f, 0}, {}}, .friction = 1, .angular_damping = 1});
    const BodyId across = s.add({.shape = dumbbell,
                                 .pose = {{0, 0.75f, 0}, axis_angle({0, 1, 0}, kPi / 2)},
                                 .friction = 1,
                                 .angular_damping = 1});
    s.run(4);
    EXPECT_NEAR(s.world->state(low).pose.position.y, 0.4f, 0.02f);
    EXPECT_NEAR(s.world->state(boxed).pose.position.y, 1.4f, 0.02f);
    EXPECT_NEAR(s.world->state(across).pose.position.y, 0.6f, 0.03f) << "rod on rod";
    for (const BodyId id : {low, boxed, across}) EXPECT_EQ(s.world->lost(), 0) << id.index;
    // A box swept at it stops at the near block; a ray goes between the blocks above the rod.
    const auto hit = s.world->sweep(Convex::box({0.2f, 0.2f, 0.2f}), {{-5, 0.4f, 0}, {}}, {4, 0, 0});
    ASSERT_TRUE(hit);
    EXPECT_EQ(hit->body, low);
    EXPECT_NEAR(hit->fraction * 4, 5 - 1.4f - 0.2f, 0.01f);
    EXPECT_FALSE(s.world->cast_ray({6, 1.7f, -2}, {0, 0, 4}));
    EXPECT_TRUE(s.world->cast_ray({7, 1.7f, -2}, {0, 0, 4}));
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
    EXPECT_THAT(s.world->overlap(Convex::box({0.3f, 0.3f, 0.3f}), {{-5, 2.4f, 0}, {}}), testing::ElementsAre(ring));
    EXPECT_THAT(s.world->overlap(Convex::capsule(1, 0.3f), {{3.3f, 1.2f, 0}, {}}), testing::ElementsAre(ground, box));
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
    bad.density = 3e38f, bad.shape = Convex::sphere(10), refused("a mass of");
    bad.density = 1e-36f, refused("a mass of");
    bad.shape = Convex::sphere(1e-12f), refused("a mass of");
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

TEST_P(EachEngine, ABodyWhoseStateIsNotFiniteGoesBackAndRestsAndTheOthersGoOn) {
    Scene s(GetParam());
    s.ground({edit(Plane{})});
    // Of finite numbers whose product is none: it bounces faster than a float can tell.
    const BodyId id = s.add({.pose = {{0, 2, 0}, {}}, .restitution = 3e38f}), other = s.add({.pose = {{5, 2, 0}, {}}});
    vec3 before = s.world->state(id).pose.position;
    for (int i = 0; i < 60 && s.world->lost() == 0; ++i) {
        before = s.world->state(id).pose.position;
        s.world->step(kStep);
    }
    ASSERT_EQ(s.world->lost(), 1);
    const BodyState state = s.world->state(id);
    EXPECT_LT(length(state.pose.position - before), 1e-6f);
    EXPECT_EQ(state.pose.rotation, quat());
    EXPECT_EQ(state.linear_velocity, vec3());
    EXPECT_EQ(state.angular_velocity, vec3());
    // Nor is it gone: it falls from there, and bounces again.
    s.run(3);
    EXPECT_GT(s.world->lost(), 1);
    EXPECT_NEAR(s.world->state(id).pose.position.y, 0.5f, 0.1f);
    EXPECT_NEAR(s.world->state(other).pose.position.y, 0.5f, 0.02f);
    EXPECT_TRUE(s.world->state(other).asleep);
    // Faster than anything, and finite all the same.
    s.world->set_velocity(id, {3e38f, 3e38f, 0}, {0, 3e38f, 0});
    for (int i = 0; i < 240; ++i) {
        s.world->step(kStep);
        const BodyState now = s.world->state(id);
        for (const float v : {now.pose.position.x, now.pose.position.y, now.pose.rotation.w, now.linear_velocity.x,
                              now.angular_velocity.y})
            ASSERT_TRUE(std::isfinite(v)) << i;
    }
    EXPECT_NEAR(s.world->state(other).pose.position.y, 0.5f, 0.02f);
}

struct SlowEngine : Engines {};
KILN_EACH_ENGINE(SlowEngine);

TEST_P(SlowEngine, OneBodyMoreThanThereMayBeIsRefusedAndTheOthersGoOn) {
    Scene s(GetParam());
    s.ground({edit(Plane{})});
    const auto place = [](uint32_t i) { return Pose{{2 * float(i % 256), 0.5f, 2 * float(i / 256)}, {}}; };
    std::vector<BodyId> ids;
    for (uint32_t i = 1; i < World::kMostBodies; ++i) ids.push_back(s.add({.pose = place(i)}));
    EXPECT_EQ(s.world->body_count(), World::kMostBodies);
    const auto refused = s.world->add({.pose = place(0)});
    ASSERT_FALSE(refused);
    EXPECT_THAT(refused.error().message, testing::HasSubstr("more than 65536 bodies"));
    s.world->step(kStep);
    for (const uint32_t i : {0u, 1000u, World::kMostBodies - 2})
        EXPECT_NEAR(s.world->state(ids[i]).pose.position.y, 0.5f, 0.01f) << i;
    s.world->remove(ids[1000]);
    EXPECT_TRUE(s.world->add({.pose = place(1001)}));
    EXPECT_EQ(s.world->lost(), 0);
}

// A plane that in places is no number at all.
class Torn final : public field::SdfField {
public:
    explicit Torn(float value) : value_(value) {}
    float distance(vec3 p) const override { return p.x > 3 ? value_ : p.y; }
    float distance(vec3 p, vec3& gradient) const override {
        gradient = p.x > 3 ? vec3{value_, value_, value_} : vec3{0, 1, 0};
        return distance(p);
    }
    void distances(const sdf::Points& points, float* out) const override {
        for (int i = 0; i < points.count; ++i) out[i] = distance({points.x[i], points.y[i], points.z[i]});
    }
    Box3 bounds() const override { return {{-100, -100, -100}, {100, 0, 100}}; }

private:
    float value_;
};

TEST_P(EachEngine, GroundThatIsNoNumberSpoilsNobodysState) {
    for (const float value : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(),
                              -std::numeric_limits<float>::infinity()}) {
        for (const bool bricks : {false, true}) {
            Scene s(GetParam());
            const auto torn = std::make_shared<Torn>(value);
            s.add({.shape = bricks ? SdfShape::fixed(
                                         torn, std::make_shared<field::BrickField>(
                                                   torn, field::BrickFieldOptions{.voxel_size = kVoxel, .near = 0.5f}))
                                   : SdfShape::fixed(torn),
                   .motion = Motion::Static});
            std::vector<BodyId> ids;
            for (const float x : {0.0f, 2.9f, 6.0f})
                for (const Solid& solid : solids())
                    for (const bool as_field : {false, true})
                        ids.push_back(s.add({.shape = as_field ? solid.field() : solid.exact(),
                                             .pose = {{x, 1, 3 * float(ids.size() % 8)}, {}}}));
            for (int i = 0; i < 90; ++i) s.world->step(kStep);
            for (size_t i = 0; i < ids.size(); ++i) {
                const BodyState state = s.world->state(ids[i]);
                for (const float v : {state.pose.position.x, state.pose.position.y, state.pose.position.z,
                                      state.pose.rotation.w, state.linear_velocity.y, state.angular_velocity.x})
                    EXPECT_TRUE(std::isfinite(v)) << i << " " << value << bricks;
                if (i < 8) {
                    EXPECT_NEAR(state.pose.position.y, 0.5f, 0.35f) << i << " " << value << bricks;
                }
            }
            EXPECT_EQ(s.world->lost(), 0) << value << bricks;
        }
    }
}

TEST_P(EachEngine, TheSameStepsGiveTheSameBytesForAnyNumberOfThreads) {
    std::vector<std::vector<BodyState>> all;
    for (const int threads : {1, 2}) {
        auto world = make_world(GetParam(), {.threads = threads});
        ASSERT_TRUE(world);
        ASSERT_TRUE((*world)->add({.shape = worlds::fixed({edit(Plane{}), edit(kiln::Sphere{.radius = 1})}),
                                   .motion = Motion::Static,
                                   .rolling_friction = 0.2f}));
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
        EXPECT_EQ(all[0][i].linear_velocity, all[1][i].linear_velocity) << i;
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
    for (const bool as_field : {false, true}) {
        Scene s(GetParam());
        s.add({.shape = Convex::box({3, 0.5f, 3}),
               .motion = Motion::Kinematic,
               .pose = {{0, -0.5f, 0}, {}},
               .friction = 1,
               .linear_velocity = {0.5f, 0, 0}});
        const BodyId id =
            s.add({.shape = as_field ? BodyShape(moving({edit(kiln::Box{.half_extents = {0.3f, 0.3f, 0.3f}})}))
                                     : Convex::box({0.3f, 0.3f, 0.3f}),
                   .pose = {{0, 0.3f, 0}, {}},
                   .friction = 1});
        s.run(2);
        EXPECT_NEAR(s.world->state(id).linear_velocity.x, 0.5f, 0.02f) << as_field;
        EXPECT_NEAR(s.world->state(id).pose.position.y, 0.3f, 0.02f) << as_field;
    }
}

TEST_P(EachEngine, AKinematicFloorThatBeginsToMoveTakesAlongWhatHasLainOnItForLong) {
    Scene s(GetParam());
    const BodyId floor = s.add({.shape = Convex::box({3, 0.5f, 3}), .motion = Motion::Kinematic, .friction = 1});
    const BodyId box = s.add({.shape = Convex::box({0.3f, 0.3f, 0.3f}), .pose = {{0, 0.8f, 0}, {}}, .friction = 1});
    s.run(4);
    s.world->set_velocity(floor, {0, 0.5f, 0}, {});
    s.run(1);
    EXPECT_NEAR(s.world->state(box).pose.position.y, 1.3f, 0.03f);
    EXPECT_NEAR(s.world->state(floor).pose.position.y, 0.5f, 0.01f);
}

}  // namespace
