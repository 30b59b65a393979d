// SPDX-License-Identifier: MIT
// Starts threads.
// Ground as triangles, beside the field that they are the surface of.
#include "field/host_bricks.h"
#include "field/meshing.h"
#include "physics/mesh_mass.h"
#include "physics/physics.h"
#include "physics/worlds.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

using namespace kiln;
using namespace kiln::physics;
using namespace kiln::physics::worlds;

namespace {

struct OnTriangles : Engines {};
KILN_EACH_ENGINE(OnTriangles);

constexpr float kGroundCell = 0.2f;

std::shared_ptr<const Triangles> meshed(const std::vector<Edit>& edits, float reach) {
    const auto exact = field_of(edits);
    auto program = sdf::compile({edits, {}, {}});
    const auto host =
        field::HostBricks::build(std::make_shared<const sdf::Program>(std::move(*program)),
                                 {.voxel_size = kGroundCell, .bounds = {{-reach, -3, -reach}, {reach, 3, reach}}});
    EXPECT_TRUE(host);
    field::Mesh mesh;
    field::mesh_smooth(field::MeshBricks(*host), mesh);
    Triangles out;
    out.vertices.assign(mesh.positions.data(), mesh.positions.data() + mesh.positions.size());
    out.indices.assign(mesh.triangles.data(), mesh.triangles.data() + mesh.triangles.size());
    out.solid = SdfShape::fixed(exact);
    return std::make_shared<const Triangles>(std::move(out));
}

TEST_P(OnTriangles, ThingsComeToRestWhereTheyDoOnTheField) {
    const std::vector<Edit> edits{edit(Plane{}, {0, 0.05f, 0}),
                                  edit(kiln::Box{.half_extents = {1.5f, 0.5f, 1.5f}}, {4, 0, 0})};
    const auto mesh = meshed(edits, 8);
    for (const bool as_field : {false, true}) {
        for (const Solid& solid : solids()) {
            // A capsule lies; one on the block may roll, on triangles, and then falls off.
            const bool lies = solid.convex.kind == Convex::Kind::Capsule;
            std::vector<std::vector<vec3>> rests;
            for (const bool on_mesh : {false, true}) {
                Scene s(GetParam());
                s.add({.shape = on_mesh ? BodyShape(mesh) : BodyShape(fixed(edits, kGroundCell)),
                       .motion = Motion::Static});
                rests.emplace_back();
                std::vector<BodyId> ids;
                for (const vec3 at : {vec3{0.1f, 0.7f, 0.13f}, vec3{4.1f, 1.2f, 0.1f}})
                    ids.push_back(s.add({.shape = as_field ? solid.field() : solid.exact(),
                                         .pose = {at, lies ? axis_angle({1, 0, 0}, kPi / 2) : quat{}}}));
                s.run(4);
                for (const BodyId id : ids) rests.back().push_back(s.world->state(id).pose.position);
            }
            for (size_t i = 0; i < (lies ? 1u : 2u); ++i)
                EXPECT_NEAR(rests[0][i].y, rests[1][i].y, 0.25f * kGroundCell) << solid.name << as_field << i;
        }
    }
}

TEST_P(OnTriangles, ASlideAcrossThemKeepsItsEnergyAndNeverKicks) {
    Scene s(GetParam());
    s.add({.shape = meshed({edit(Plane{}, {0, 0.03f, 0})}, 22), .motion = Motion::Static, .friction = 0});
    for (const Solid& solid : {solids()[0], solids()[1], solids()[2]}) {
        const bool lies = solid.convex.kind == Convex::Kind::Capsule;  // along its way
        const float height = (lies ? solid.convex.size.x : half_extents(solid.convex).y) + 0.03f;
        const BodyId id = s.add({.shape = solid.exact(),
                                 .pose = {{-18, height, 0.07f}, lies ? axis_angle({0, 0, 1}, kPi / 2) : quat{}},
                                 .friction = 0,
                                 .linear_velocity = {6, 0, 0}});
        int kicks = 0;
        for (int i = 0; i < 320; ++i) {
            const float before = s.world->state(id).linear_velocity.y;
            s.world->step(kStep);
            kicks += std::abs(s.world->state(id).linear_velocity.y - before) > 0.3f;
        }
        EXPECT_EQ(kicks, 0) << solid.name;
        const vec3 v = s.world->state(id).linear_velocity;
        EXPECT_NEAR(dot(v, v) / 36, 1, 0.01f) << solid.name;
        s.world->remove(id);
    }
}

TEST_P(OnTriangles, BowlsOfThemCostABallMoreEnergyThanTheField) {
    const std::vector<Edit> bowl{edit(kiln::Box{.half_extents = {4.5f, 2, 4.5f}}, {0, -2.5f, 0}),
                                 edit(kiln::Sphere{.radius = 4}, {}, Op::Subtract)};
    const float r = 0.3f;
    struct Swing {
        std::vector<Edit> edits;
        float reach, arm, middle, angle, along;
    };
    for (const Swing& w : {Swing{bowl, 5, 4 - r, 0, 0.65f, 0}, Swing{ring_trough(), 7, 2 - r, 4, 0.4f, 1}}) {
        const auto mesh = meshed(w.edits, w.reach);
        float left[2];
        for (const bool on_mesh : {false, true}) {
            Scene s(GetParam());
            s.add({.shape = on_mesh ? BodyShape(mesh) : BodyShape(fixed(w.edits, kGroundCell)),
                   .motion = Motion::Static,
                   .friction = 0});
            const BodyId id =
                s.add({.shape = Convex::sphere(r),
                       .pose = {{w.middle + w.arm * std::sin(w.angle), -w.arm * std::cos(w.angle), 0}, {}},
                       .friction = 0,
                       .linear_velocity = {0, 0, w.along}});
            const auto energy = [&] {
                const BodyState b = s.world->state(id);
                return kGravity * (b.pose.position.y + w.arm) + 0.5f * dot(b.linear_velocity, b.linear_velocity);
            };
            const float before = energy();
            s.run(10);
            left[on_mesh] = energy() / before;
        }
        EXPECT_GT(left[0], 0.92f) << w.middle;
        EXPECT_LT(left[1], left[0]) << w.middle;
    }
}

TEST_P(OnTriangles, AFieldTorusSlidesDownARampOfThem) {
    Scene s(GetParam());
    const float degrees = 15;
    s.add({.shape = meshed({inclined_plane(degrees)}, 8), .motion = Motion::Static, .friction = 0.1f});
    const auto torus = moving({edit(kiln::Torus{.major_radius = 0.5f, .minor_radius = 0.2f})});
    const BodyId id = s.add({.shape = torus,
                             .pose = {out_of(degrees) * 0.2f, axis_angle({0, 0, 1}, -degrees * kPi / 180)},
                             .friction = 0.1f});
    s.run(2);
    const float a = kGravity * (std::sin(degrees * kPi / 180) - 0.1f * std::cos(degrees * kPi / 180));
    EXPECT_NEAR(dot(s.world->state(id).linear_velocity, downhill(degrees)) / 2 / a, 1, 0.03f);
}

TEST_P(OnTriangles, QuestionsAreAnsweredFromTheirSolidAndBadOnesAreRefused) {
    Scene s(GetParam());
    const auto mesh = meshed({edit(Plane{})}, 4);
    const BodyId ground = s.add({.shape = mesh, .motion = Motion::Static});
    const auto hit = s.world->cast_ray({0, 2, 0}, {0, -4, 0});
    ASSERT_TRUE(hit);
    EXPECT_EQ(hit->body, ground);
    EXPECT_NEAR(hit->position.y, 0, 1e-3f);
    const auto refused = [&](Triangles t, Motion motion = Motion::Static) {
        auto id = s.world->add({.shape = std::make_shared<const Triangles>(std::move(t)), .motion = motion});
        return id ? std::string("taken") : id.error().message;
    };
    EXPECT_THAT(refused(*mesh, Motion::Dynamic), testing::HasSubstr("static"));  // a plane moves no more as triangles
    Triangles bad = *mesh;
    bad.indices.push_back(0);
    EXPECT_THAT(refused(bad), testing::HasSubstr("no triangles"));
    bad = *mesh;
    bad.indices[0] = uint32_t(bad.vertices.size());
    EXPECT_THAT(refused(bad), testing::HasSubstr("vertex"));
    bad = *mesh;
    bad.vertices[0].x = std::numeric_limits<float>::quiet_NaN();
    EXPECT_THAT(refused(bad), testing::HasSubstr("finite"));
}

// An octahedron with corners on the axes, and as a field the same solid.
Triangles octahedron(vec3 arms) {
    Triangles out;
    for (const vec3 axis : {vec3{arms.x, 0, 0}, vec3{0, arms.y, 0}, vec3{0, 0, arms.z}}) {
        out.vertices.push_back(axis);
        out.vertices.push_back(-axis);
    }
    for (uint32_t k = 0; k < 8; ++k) {
        const uint32_t x = k & 1, y = 2 + (k >> 1 & 1), z = 4 + (k >> 2);
        // Anticlockwise from outside: turned where an odd number of signs is.
        if ((std::popcount(k) & 1) == 0) {
            out.indices.insert(out.indices.end(), {x, y, z});
        } else {
            out.indices.insert(out.indices.end(), {x, z, y});
        }
    }
    return out;
}
std::shared_ptr<const Triangles> with_solid(Triangles t, const std::vector<Edit>& edits) {
    t.solid = moving(edits);
    return std::make_shared<const Triangles>(std::move(t));
}

// A box of triangles.
Triangles boxed(vec3 half, vec3 middle) {
    Triangles out;
    for (uint32_t c = 0; c < 8; ++c)
        out.vertices.push_back(middle + vec3{(c & 1) != 0 ? half.x : -half.x, (c & 2) != 0 ? half.y : -half.y,
                                             (c & 4) != 0 ? half.z : -half.z});
    constexpr uint32_t kFaces[6][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4},
                                       {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
    for (const auto& f : kFaces) out.indices.insert(out.indices.end(), {f[0], f[1], f[2], f[0], f[2], f[3]});
    return out;
}

TEST(MeshMass, IsTheFormulasOfBoxAndOctahedronWhereverTheyAre) {
    const vec3 half{0.5f, 0.3f, 0.2f}, middle{3, -2, 5};
    const auto box = mass_of_mesh(boxed(half, middle));
    ASSERT_TRUE(box) << box.error().message;
    EXPECT_NEAR(box->mass, 8 * 0.5 * 0.3 * 0.2, 1e-6);
    EXPECT_LT(length(box->center - middle), 1e-5f);
    const auto moment = [&](double a, double b) { return box->mass / 3 * (a * a + b * b); };
    EXPECT_NEAR(box->moments.x, moment(0.3, 0.2), 1e-6);
    EXPECT_NEAR(box->moments.y, moment(0.5, 0.2), 1e-6);
    EXPECT_NEAR(box->moments.z, moment(0.5, 0.3), 1e-6);
    const auto eight = mass_of_mesh(octahedron({1, 2, 3}));
    ASSERT_TRUE(eight) << eight.error().message;
    EXPECT_NEAR(eight->mass, 4.0 / 3 * 6, 1e-5);
    EXPECT_NEAR(eight->moments.x, eight->mass / 10 * (4 + 9), 1e-4);
    EXPECT_NEAR(eight->moments.z, eight->mass / 10 * (1 + 4), 1e-4);
    // A corner of a cube: its centre is not its box's, and its axes are not the frame's.
    Triangles corner;
    corner.vertices = {{2, 1, 3}, {3, 1, 3}, {2, 2, 3}, {2, 1, 4}};
    corner.indices = {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3};
    const auto four = mass_of_mesh(corner);
    ASSERT_TRUE(four) << four.error().message;
    EXPECT_NEAR(four->mass, 1.0 / 6, 1e-9);
    EXPECT_LT(length(four->center - vec3{2.25f, 1.25f, 3.25f}), 1e-6f);
    std::array<double, 3> moments{four->moments.x, four->moments.y, four->moments.z};
    std::sort(moments.begin(), moments.end());
    EXPECT_NEAR(moments[0], 1.0 / 96, 1e-9);
    EXPECT_NEAR(moments[1], 1.0 / 96, 1e-9);
    EXPECT_NEAR(moments[2], 1.0 / 60, 1e-9);
}

TEST_P(OnTriangles, AMeshThatMovesFallsRollsAndRestsOnFieldsAndTrianglesAndOthers) {
    const std::vector<Edit> block{edit(kiln::Box{.half_extents = {0.5f, 0.3f, 0.4f}}, {0.2f, 0, 0})};
    const auto mesh = with_solid(boxed({0.5f, 0.3f, 0.4f}, {0.2f, 0, 0}), block);
    for (const bool on_mesh : {false, true}) {
        Scene s(GetParam());
        const std::vector<Edit> edits{edit(Plane{}, {0, 0.05f, 0})};
        s.add({.shape = on_mesh ? BodyShape(meshed(edits, 8)) : BodyShape(fixed(edits, kGroundCell)),
               .motion = Motion::Static});
        const BodyId low = s.add({.shape = mesh, .pose = {{0, 0.5f, 0}, {}}, .density = 500});
        EXPECT_NEAR(s.world->mass(low), 500 * 8 * 0.5 * 0.3 * 0.4, 1e-3);
        EXPECT_NEAR(s.world->center_of_mass(low).x, 0.2f, 1e-6f);
        // A second on top of it, and an exact box on that; a field beside.
        const BodyId high = s.add({.shape = mesh, .pose = {{0, 1.15f, 0}, {}}});
        const BodyId top = s.add({.shape = Convex::box({0.3f, 0.3f, 0.3f}), .pose = {{0.2f, 1.8f, 0}, {}}});
        const BodyId torus = s.add({.shape = moving({edit(kiln::Torus{.major_radius = 0.5f, .minor_radius = 0.2f})}),
                                    .pose = {{3, 0.5f, 0}, {}}});
        s.run(5);
        EXPECT_NEAR(s.world->state(low).pose.position.y, 0.35f, 0.02f) << on_mesh;
        EXPECT_NEAR(s.world->state(high).pose.position.y, 0.95f, 0.03f) << on_mesh;
        EXPECT_NEAR(s.world->state(top).pose.position.y, 1.55f, 0.04f) << on_mesh;
        EXPECT_NEAR(s.world->state(torus).pose.position.y, 0.25f, 0.02f) << on_mesh;
        for (const BodyId id : {low, high, top, torus}) EXPECT_TRUE(s.world->state(id).asleep) << on_mesh;
    }
    // In the air it falls as anything does, about its centre of mass.
    Scene s(GetParam());
    const BodyId id = s.add({.shape = mesh, .pose = {{0, 5, 0}, {}}, .angular_velocity = {0, 2, 0}});
    const vec3 before = s.world->state(id).pose * vec3{0.2f, 0, 0};
    s.run(0.5f);
    const vec3 after = s.world->state(id).pose * vec3{0.2f, 0, 0};
    EXPECT_NEAR(after.x, before.x, 1e-3f);
    EXPECT_NEAR(before.y - after.y, kGravity * 0.5f * (0.5f + kStep) / 2, 5e-3f);
}

TEST_P(OnTriangles, AMeshThatMovesMustBeClosedAndHaveAnArea) {
    Scene s(GetParam());
    const std::vector<Edit> block{edit(kiln::Box{.half_extents = {0.5f, 0.3f, 0.4f}})};
    const auto refused = [&](Triangles t) {
        auto id = s.world->add({.shape = with_solid(std::move(t), block)});
        return id ? std::string("taken") : id.error().message;
    };
    const Triangles good = boxed({0.5f, 0.3f, 0.4f}, {});
    EXPECT_EQ(refused(good), "taken");
    Triangles open = good;
    open.indices.resize(open.indices.size() - 3);
    EXPECT_THAT(refused(open), testing::HasSubstr("open at 3 edges"));
    Triangles flipped = good;
    std::swap(flipped.indices[0], flipped.indices[1]);
    EXPECT_THAT(refused(flipped), testing::HasSubstr("do not agree"));
    Triangles inwards = good;
    for (size_t i = 0; i < inwards.indices.size(); i += 3) std::swap(inwards.indices[i], inwards.indices[i + 1]);
    EXPECT_THAT(refused(inwards), testing::HasSubstr("inwards"));
    Triangles flat = good;
    flat.vertices[1] = flat.vertices[0];
    EXPECT_THAT(refused(flat), testing::HasSubstr("no area"));
    EXPECT_EQ(s.world->body_count(), 1u);
}

}  // namespace
