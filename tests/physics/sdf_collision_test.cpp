// SPDX-License-Identifier: MIT
// Starts threads.
#include "physics/sdf_collision.h"

#include "physics/convex_field.h"
#include "physics/physics.h"
#include "physics/worlds.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <numbers>
#include <random>

using namespace kiln;
using namespace kiln::physics;
using worlds::edit;
using worlds::field_of;

namespace {

std::mt19937 rng(7);
float uniform(float low, float high) { return std::uniform_real_distribution<float>(low, high)(rng); }
vec3 uniform3(float size) { return {uniform(-size, size), uniform(-size, size), uniform(-size, size)}; }
quat any_rotation() {
    const vec3 axis = uniform3(1);
    return length(axis) > 0.01f ? axis_angle(normalize(axis), uniform(-3, 3)) : quat{};
}

const Convex kConvexes[] = {Convex::sphere(0.4f), Convex::box({0.5f, 0.3f, 0.7f}), Convex::capsule(0.5f, 0.25f),
                            Convex::cylinder(0.35f, 0.45f)};

float deepest(const std::vector<FieldContact>& contacts) {
    float out = -1e30f;
    for (const FieldContact& c : contacts) out = std::max(out, c.depth);
    return out;
}

// The lowest point of the solid, by many points of it.
float lowest_of(const field::SdfField& field, const Convex& body, const Pose& pose) {
    float best = 1e30f;
    const vec3 h = half_extents(body);
    for (int i = 0; i < 8000; ++i) {
        const vec3 p = project(body, {uniform(-h.x, h.x) * 1.5f, uniform(-h.y, h.y) * 1.5f, uniform(-h.z, h.z) * 1.5f});
        best = std::min(best, field.distance(pose * p));
    }
    return best;
}

TEST(SdfCollision, TheDeepestContactIsTheLowestPointOfTheBody) {
    const auto plane = field_of({edit(Plane{})});
    const auto ball = field_of({edit(kiln::Sphere{.radius = 0.6f})});
    const auto ground = field_of({edit(Plane{}), edit(kiln::Sphere{.radius = 0.5f}, {0.6f, 0, 0}, Op::Union, 0.2f)});
    for (const auto& field : {plane, ball, ground}) {
        for (const Convex& body : kConvexes) {
            for (int i = 0; i < 6; ++i) {
                // In touch, a centimetre deep at the deepest of what sampling finds.
                Pose pose{uniform3(0.7f), any_rotation()};
                pose.position.y += 1.5f;
                std::vector<FieldContact> contacts;
                for (int step = 0; step < 60; ++step) {
                    const float gap = lowest_of(*field, body, pose);
                    if (gap < 0) break;
                    pose.position.y -= std::max(0.8f * gap, 0.004f);
                }
                const float sampled = -lowest_of(*field, body, pose);
                collide(*field, body, pose, 0.02f, contacts);
                ASSERT_FALSE(contacts.empty());
                // Sampling finds no deeper point (within what it resolves), and the descent none that is not there.
                EXPECT_GT(deepest(contacts), std::min(sampled, kMostDepth) - 0.004f) << int(body.kind) << " " << i;
                for (const FieldContact& c : contacts) {
                    if (c.depth < kMostDepth) {
                        EXPECT_NEAR(field->distance(c.point), -c.depth, 0.02f + 0.5f * std::abs(c.depth));
                    }
                    const vec3 local = inverse(pose) * c.point;
                    EXPECT_LT(length(project(body, local) - local), 1e-4f) << "the point is not of the body";
                    EXPECT_NEAR(length(c.normal), 1, 1e-4f);
                }
            }
        }
    }
}

TEST(SdfCollision, ABoxOnAPlaneHasItsFourCorners) {
    const auto plane = field_of({edit(Plane{})});
    std::vector<FieldContact> contacts;
    collide(*plane, Convex::box({0.5f, 0.5f, 0.5f}), {{3, 0.499f, -2}, axis_angle({0, 1, 0}, 0.3f)}, 0.02f, contacts);
    int corners = 0;
    for (const FieldContact& c : contacts) {
        EXPECT_NEAR(c.depth, 0.001f, 1e-5f);
        EXPECT_NEAR(c.normal.y, 1, 1e-5f);
        const vec3 away = c.point - vec3{3, c.point.y, -2};
        corners += std::abs(length(away) - std::sqrt(0.5f)) < 1e-4f;
    }
    EXPECT_EQ(corners, 4);
}

TEST(SdfCollision, ABoxOverAnEdgeIsHeldAtTheEdge) {
    // A block that ends at x = 0 under a box whose middle stands 0.1 m inside.
    const auto block = field_of({edit(kiln::Box{.half_extents = {2, 0.5f, 2}}, {-2, -0.5f, 0})});
    std::vector<FieldContact> contacts;
    collide(*block, Convex::box({0.5f, 0.5f, 0.5f}), {{-0.1f, 0.4995f, 0}, {}}, 0.01f, contacts);
    float farthest = -1;
    for (const FieldContact& c : contacts) farthest = std::max(farthest, c.point.x);
    EXPECT_NEAR(farthest, 0, 0.03f);
}

TEST(SdfCollision, ABallOnTheAxisOfARingTouchesIt) {
    // Straight down from the centre the field has a saddle: the ring is nearest on a circle around.
    const auto ring = field_of({edit(kiln::Torus{.major_radius = 1, .minor_radius = 0.2f})});
    std::vector<FieldContact> contacts;
    for (const float gap : {0.005f, -0.005f}) {
        const float r = 0.9f, height = std::sqrt((r + 0.2f + gap) * (r + 0.2f + gap) - 1);
        collide(*ring, Convex::sphere(r), {{0, height, 0}, {}}, 0.02f, contacts);
        ASSERT_GE(contacts.size(), 3u) << gap;
        for (const FieldContact& c : contacts) EXPECT_NEAR(c.depth, -gap, 1e-3f);
        vec3 push;
        for (const FieldContact& c : contacts) push = push + c.normal;
        EXPECT_LT(std::hypot(push.x, push.z), 0.3f * push.y) << "they hold it from all sides";
    }
}

TEST(SdfCollision, ABuriedBodyIsToldToRiseOnlySoFar) {
    const auto plane = field_of({edit(Plane{})});
    std::vector<FieldContact> contacts;
    for (const Convex& body : kConvexes) {
        collide(*plane, body, {{0, -3, 0}, {}}, 0.02f, contacts);
        ASSERT_FALSE(contacts.empty());
        EXPECT_EQ(deepest(contacts), kMostDepth);
        for (const FieldContact& c : contacts) EXPECT_NEAR(c.normal.y, 1, 1e-3f);
    }
}

TEST(SdfCollision, ASweepStopsWhereTheBodyTouches) {
    const auto wall = field_of({edit(kiln::Box{.half_extents = {0.05f, 5, 5}})});
    for (const Convex& body : kConvexes) {
        for (int i = 0; i < 20; ++i) {
            const Pose start{{-20, uniform(-1, 1), uniform(-1, 1)}, any_rotation()};
            const auto hit = sweep(*wall, body, start, {40, 0, 0});
            ASSERT_TRUE(hit);
            Pose there = start;
            there.position.x += 40 * hit->fraction;
            EXPECT_NEAR(lowest_of(*wall, body, there), 0, 0.012f);
            EXPECT_NEAR(hit->point.x, -0.05f, 1e-3f);
            EXPECT_NEAR(hit->normal.x, -1, 1e-3f);
            EXPECT_FALSE(sweep(*wall, body, start, {-40, 0, 0}));
            EXPECT_FALSE(sweep(*wall, body, start, {0, 0, 40}));
        }
    }
}

TEST(SdfCollision, ARayHitsWhatTheFormulaSays) {
    const auto ball = field_of({edit(kiln::Sphere{.radius = 1})});
    const ConvexField same(Convex::sphere(1));
    for (int i = 0; i < 200; ++i) {
        const vec3 origin = normalize(uniform3(1)) * 5.0f, way = uniform3(9);
        const double a = double(dot(way, way)), b = double(dot(origin, way)), c = 24, root = b * b - a * c;
        const auto hit = cast_ray(*ball, origin, way), hit2 = cast_ray(same, origin, way);
        if (std::abs(root) < 0.01 * a) continue;
        const double t = root > 0 ? (-b - std::sqrt(root)) / a : -1;
        const bool expected = t >= 0 && t <= 1;
        ASSERT_EQ(hit.has_value(), expected);
        ASSERT_EQ(hit2.has_value(), expected);
        if (!expected) continue;
        EXPECT_NEAR(double(hit->fraction), t, 1e-3);
        EXPECT_NEAR(double(hit2->fraction), t, 1e-3);
        EXPECT_NEAR(double(dot(hit->normal, hit->point)), 1, 1e-3);
    }
}

TEST(ConvexField, IsTheDistanceOfTheSameShapeAsEdits) {
    const struct {
        Convex convex;
        kiln::Shape shape;
    } cases[] = {{kConvexes[0], kiln::Sphere{.radius = 0.4f}},
                 {kConvexes[1], kiln::Box{.half_extents = {0.5f, 0.3f, 0.7f}}},
                 {kConvexes[2], kiln::Capsule{.half_height = 0.5f, .radius = 0.25f}},
                 {kConvexes[3], kiln::Cylinder{.half_height = 0.35f, .radius = 0.45f}}};
    for (const auto& c : cases) {
        const auto field = field_of({edit(c.shape)});
        const ConvexField closed(c.convex);
        for (int i = 0; i < 500; ++i) {
            const vec3 p = uniform3(1.2f);
            vec3 g, h;
            EXPECT_NEAR(closed.distance(p, g), field->distance(p, h), 2e-5f) << int(c.convex.kind);
            if (length(h) > 0.999f) {
                EXPECT_GT(dot(g, h), 0.98f) << int(c.convex.kind);
            }
        }
    }
}

TEST(SdfShape, MassCentreAndMomentsAreThoseOfTheFormulas) {
    for (const Convex& convex : kConvexes) {
        const auto made = SdfShape::moving(std::make_shared<ConvexField>(convex));
        ASSERT_TRUE(made) << made.error().message;
        const MassProperties& m = (*made)->mass();
        EXPECT_NEAR(m.mass / volume(convex), 1, 0.003) << int(convex.kind);
        EXPECT_LT(length(m.center), 1e-3f);
        const dvec3 expected = moments(convex);
        double mine[3] = {m.moments.x / m.mass, m.moments.y / m.mass, m.moments.z / m.mass};
        double theirs[3] = {expected.x, expected.y, expected.z};
        std::sort(mine, mine + 3), std::sort(theirs, theirs + 3);
        for (int i = 0; i < 3; ++i) EXPECT_NEAR(mine[i] / theirs[i], 1, 0.005) << int(convex.kind);
    }
    // A torus of volume 2 pi² R r², moved and turned: its axis has the largest moment, m (R² + 3/4 r²).
    Edit torus = edit(kiln::Torus{.major_radius = 0.5f, .minor_radius = 0.15f}, {3, 1, -2});
    torus.node.transform.rotation = axis_angle(normalize(vec3{1, 2, 3}), 1);
    const auto made = SdfShape::moving(field_of({torus}));
    ASSERT_TRUE(made) << made.error().message;
    const MassProperties& m = (*made)->mass();
    const double pi = std::numbers::pi;
    EXPECT_NEAR(m.mass / (2 * pi * pi * 0.5 * 0.15 * 0.15), 1, 0.003);
    EXPECT_LT(length(m.center - vec3{3, 1, -2}), 1e-3f);
    const double most = std::max({m.moments.x, m.moments.y, m.moments.z});
    EXPECT_NEAR(most / m.mass / (0.25 + 0.75 * 0.0225), 1, 0.005);
    const vec3 axis = rotate(torus.node.transform.rotation, {0, 1, 0});
    const vec3 principal = most == m.moments.x   ? rotate(m.axes, {1, 0, 0})
                           : most == m.moments.y ? rotate(m.axes, {0, 1, 0})
                                                 : rotate(m.axes, {0, 0, 1});
    EXPECT_GT(std::abs(dot(axis, principal)), 0.9999f);
}

// One that counts what it is asked, so that what is deep or far is not asked for cell by cell.
class Counted final : public field::SdfField {
public:
    explicit Counted(std::shared_ptr<const field::SdfField> field) : field_(std::move(field)) {}
    float distance(vec3 p) const override { return ++asked_, field_->distance(p); }
    float distance(vec3 p, vec3& gradient) const override { return ++asked_, field_->distance(p, gradient); }
    void distances(const sdf::Points& points, float* out) const override {
        asked_ += points.count;
        field_->distances(points, out);
    }
    Box3 bounds() const override { return field_->bounds(); }
    int asked() const { return asked_; }

private:
    std::shared_ptr<const field::SdfField> field_;
    mutable std::atomic<int> asked_ = 0;
};

TEST(SdfShape, DepthIsThatOfTheDeepestCellAndFewCellsAreAsked) {
    // A block with a dent, whose deepest place is neither its middle nor anyone's centre of mass; and two balls, of which one is the deeper.
    const std::vector<std::vector<Edit>> solids{
        {edit(kiln::Box{.half_extents = {1, 0.8f, 0.9f}}),
         edit(kiln::Sphere{.radius = 0.7f}, {0, 0.8f, 0}, Op::Subtract)},
        {edit(kiln::Sphere{.radius = 0.3f}, {-1, 0, 0}), edit(kiln::Sphere{.radius = 0.4f}, {1, 0.2f, 0})}};
    for (const std::vector<Edit>& edits : solids) {
        const auto counted = std::make_shared<Counted>(field_of(edits));
        const auto made = SdfShape::moving(counted);
        ASSERT_TRUE(made) << made.error().message;
        const Box3 box = counted->bounds();
        const vec3 size = box.max - box.min;
        const float cell = std::max({size.x, size.y, size.z}) / 96;
        EXPECT_LT(counted->asked(), 0.5f * size.x * size.y * size.z / (cell * cell * cell));
        // Looked for on a lattice as fine that lies otherwise.
        float depth = 0;
        for (float z = box.min.z; z < box.max.z; z += cell)
            for (float y = box.min.y; y < box.max.y; y += cell)
                for (float x = box.min.x; x < box.max.x; x += cell)
                    depth = std::max(depth, -counted->distance({x, y, z}));
        EXPECT_NEAR((*made)->inner_radius(), depth, cell);
    }
}

TEST(SdfShape, SurfacePointsLieOnTheSurfaceAndCoverIt) {
    const auto field = field_of({edit(kiln::Torus{.major_radius = 0.5f, .minor_radius = 0.15f})});
    const auto made = SdfShape::moving(field);
    ASSERT_TRUE(made) << made.error().message;
    const SdfShape& s = **made;
    EXPECT_GT(s.point_count(), 400);
    EXPECT_LT(s.point_count(), 2500);
    for (int i = 0; i < s.point_count(); ++i) EXPECT_LT(std::abs(field->distance(s.point(i))), 2e-3f * s.spacing());
    for (int i = 0; i < 300; ++i) {
        const float a = uniform(0, 6.3f), b = uniform(0, 6.3f), across = 0.5f + 0.15f * std::cos(b);
        const vec3 p{across * std::cos(a), 0.15f * std::sin(b), across * std::sin(a)};
        float nearest = 1e30f;
        for (int k = 0; k < s.point_count(); ++k) nearest = std::min(nearest, length(s.point(k) - p));
        EXPECT_LT(nearest, 1.5f * s.spacing());
    }
    for (const SdfShape::Group& g : s.groups())
        for (int i = g.first; i < g.first + g.count; ++i) EXPECT_LE(length(s.point(i) - g.center), g.radius * 1.0001f);
}

TEST(SdfShape, ABodyWithoutVolumeOrEndIsRefused) {
    const auto message = [](std::vector<Edit> edits) {
        const auto made = SdfShape::moving(field_of(std::move(edits)));
        return made ? std::string("made") : made.error().message;
    };
    EXPECT_THAT(message({}), testing::HasSubstr("no volume"));
    EXPECT_THAT(message({edit(Plane{})}), testing::HasSubstr("without end"));
    EXPECT_THAT(message({edit(kiln::Sphere{.radius = 0.2f}), edit(kiln::Sphere{.radius = 0.3f}, {}, Op::Subtract)}),
                testing::HasSubstr("no volume"));
}

}  // namespace
