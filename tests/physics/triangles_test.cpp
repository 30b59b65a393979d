// SPDX-License-Identifier: MIT
// Ground as triangles, beside the field that they are the surface of.
#include "field/host_bricks.h"
#include "field/meshing.h"
#include "physics/physics.h"
#include "physics/worlds.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

using namespace kiln;
using namespace kiln::physics;
using namespace kiln::physics::worlds;

namespace {

struct OnTriangles : Engines {};
KILN_EACH_ENGINE(OnTriangles);

constexpr float kCell = 0.2f;

std::shared_ptr<const Triangles> meshed(const std::vector<Edit>& edits, float reach) {
    const auto exact = field_of(edits);
    auto program = sdf::compile({edits, {}, {}});
    const auto host =
        field::HostBricks::build(std::make_shared<const sdf::Program>(std::move(*program)),
                                 {.voxel_size = kCell, .bounds = {{-reach, -3, -reach}, {reach, 3, reach}}});
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
                s.add({.shape = on_mesh ? BodyShape(mesh) : BodyShape(fixed(edits, kCell)), .motion = Motion::Static});
                rests.emplace_back();
                std::vector<BodyId> ids;
                for (const vec3 at : {vec3{0.1f, 0.7f, 0.13f}, vec3{4.1f, 1.2f, 0.1f}})
                    ids.push_back(s.add({.shape = as_field ? solid.field() : solid.exact(),
                                         .pose = {at, lies ? axis_angle({1, 0, 0}, kPi / 2) : quat{}}}));
                s.run(4);
                for (const BodyId id : ids) rests.back().push_back(s.world->state(id).pose.position);
            }
            for (size_t i = 0; i < (lies ? 1u : 2u); ++i)
                EXPECT_NEAR(rests[0][i].y, rests[1][i].y, 0.25f * kCell) << solid.name << as_field << i;
        }
    }
}

TEST_P(OnTriangles, ASlideAcrossThemKeepsItsEnergyAndNeverKicks) {
    const auto mesh = meshed({edit(Plane{}, {0, 0.03f, 0})}, 22);
    for (const Solid& solid : {solids()[0], solids()[1], solids()[2]}) {
        Scene s(GetParam());
        s.add({.shape = mesh, .motion = Motion::Static, .friction = 0});
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
    EXPECT_THAT(refused(*mesh, Motion::Dynamic), testing::HasSubstr("static"));
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

}  // namespace
