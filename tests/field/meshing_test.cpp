// SPDX-License-Identifier: MIT
#include "field/meshing.h"

#include "field/cell_cases.h"
#include "field/mesh_edges.h"

#include "field/meshes.h"

#include <numbers>

namespace kiln::field {
namespace {

using meshes::expect_closed;
using meshes::facts;

constexpr double kPi = std::numbers::pi;

Mesh smooth_of(const worlds::World& world, int workers = 0) {
    const auto field = world.field();
    const HostBricks bricks = HostBricks::bake(field, workers);
    Mesh out;
    mesh_smooth(MeshBricks(bricks), out, workers);
    return out;
}

std::vector<std::byte> bytes_of(const Mesh& mesh) {
    std::vector<std::byte> out;
    const auto append = [&](auto span) {
        const auto bytes = std::as_bytes(span);
        out.insert(out.end(), bytes.begin(), bytes.end());
    };
    append(mesh.positions.span());
    append(mesh.triangles.span());
    return out;
}

// Solid where the waves' sum is below 0, inside a ball; made of heights so that it fits no closed form.
worlds::World waves() {
    worlds::World w{"repeated tori", {}, {.voxel_size = 0.05f, .bounds = {{-1.6f, -1.6f, -1.6f}, {1.6f, 1.6f, 1.6f}}}};
    Edit e = worlds::edit(Torus{.major_radius = 0.25f, .minor_radius = 0.1f});
    e.node.domain.push_back(Repeat{.spacing = {0.75f, 0.75f, 0.75f}, .count = {3, 3, 3}});
    e.node.domain.push_back(Twist{.rate = 0.6f});
    w.edits.push_back(e);
    w.edits.push_back(worlds::edit(Sphere{.radius = 1.2f}, {0.1f, 0, 0}, Op::Intersect, 0.1f));
    return w;
}

TEST(Meshing, WorldsAreClosedManifolds) {
    for (const worlds::World& world : worlds::all()) expect_closed(smooth_of(world), world.name);
    expect_closed(smooth_of(waves()), "waves");
    for (uint32_t seed = 20; seed < 26; ++seed) expect_closed(smooth_of(worlds::jumble(seed, 80)), "jumble");
}

TEST(Meshing, RandomSignsAreClosedManifoldsThroughEveryCase) {
    const meshes::MadeUp noise = meshes::noise(8, 3);
    const MeshBricks bricks = noise.view();
    std::set<uint32_t> cases;
    size_t ambiguous = 0;
    const MeshEdges edges(bricks, 1, [&](const BrickEdges& brick) {
        for (int z = 0; z < 7; ++z) {
            for (int bit = 0; bit < 56; ++bit) {
                if ((bit & 7) == 7) continue;
                const uint32_t signs = corner_signs(brick.solid, z, bit);
                cases.insert(signs);
                ambiguous += bits_of(ambiguous_faces(signs));
            }
        }
        return 0u;
    });
    EXPECT_EQ(cases.size(), 256u);
    EXPECT_GT(ambiguous, 2u * 4096u);
    Mesh mesh;
    mesh_smooth(bricks, mesh);
    expect_closed(mesh, "noise");
    mesh_smooth(meshes::noise(3, 9, DistanceFormat::Snorm8).view(), mesh);
    expect_closed(mesh, "noise in 8 bits");
}

TEST(Meshing, MissingNeighboursLeaveNoVertexWithoutATriangleAndNoTwoOwners) {
    // A sparse subset of bricks: open at its border, but every vertex used and none doubled.
    const meshes::MadeUp noise = meshes::noise(5, 4);
    for (uint32_t seed = 0; seed < 8; ++seed) {
        worlds::Random random(seed);
        std::vector<MeshBrick> some;
        for (const MeshBrick& b : noise.bricks)
            if (random.below(2) == 0) some.push_back(b);
        const MeshBricks bricks(some, noise.format, noise.voxel_size);
        Mesh mesh;
        mesh_smooth(bricks, mesh);
        const MeshFacts f = facts(mesh);
        EXPECT_EQ(f.vertices, mesh.vertex_count());
        EXPECT_EQ(f.non_manifold_edges, 0u);
        std::set<std::tuple<float, float, float>> places;
        for (const vec3 p : mesh.positions.span()) places.emplace(p.x, p.y, p.z);
        EXPECT_EQ(places.size(), mesh.vertex_count());
    }
}

TEST(Meshing, RegionsHaveEqualVerticesOnTheirCommonFaceAndTogetherAreTheWhole) {
    const auto field = worlds::jumble(7).field();
    const HostBricks bricks = HostBricks::bake(field);
    Mesh whole;
    mesh_smooth(MeshBricks(bricks), whole);
    const GridParams g = field->grid();
    const int middle = g.cell_x + g.size_x / 2;
    const ivec3 low{g.cell_x, g.cell_y, g.cell_z}, high{g.cell_x + g.size_x, g.cell_y + g.size_y, g.cell_z + g.size_z};
    Mesh left, right;
    mesh_smooth(MeshBricks(bricks, {low, {middle, high.y, high.z}}), left);
    mesh_smooth(MeshBricks(bricks, {{middle, low.y, low.z}, high}), right);
    EXPECT_EQ(left.triangle_count() + right.triangle_count(), whole.triangle_count());
    const float plane = float(7 * middle) * g.voxel_size;
    const auto on_face = [&](const Mesh& mesh) {
        std::set<std::tuple<float, float, float>> out;
        for (const vec3 p : mesh.positions.span())
            if (p.x == plane) out.emplace(p.x, p.y, p.z);
        return out;
    };
    const auto shared = on_face(left);
    EXPECT_GT(shared.size(), 50u);
    EXPECT_EQ(shared, on_face(right));
    EXPECT_EQ(left.vertex_count() + right.vertex_count(), whole.vertex_count() + shared.size());
    EXPECT_GT(facts(left).open_edges, 50u);
}

TEST(Meshing, SameBytesForAnyNumberOfWorkers) {
    const auto one = bytes_of(smooth_of(worlds::jumble(11, 60), 1));
    for (const int workers : {2, 3, 8}) EXPECT_EQ(bytes_of(smooth_of(worlds::jumble(11, 60), workers)), one) << workers;
}

TEST(Meshing, EulerCharacteristicOfSphereAndTorus) {
    EXPECT_EQ(facts(smooth_of(worlds::sphere_of(10))).euler(), 2);
    worlds::World torus{"torus", {}, {.voxel_size = 0.05f, .bounds = {{-1.5f, -1, -1.5f}, {1.5f, 1, 1.5f}}}};
    torus.edits.push_back(worlds::edit(Torus{.major_radius = 0.8f, .minor_radius = 0.3f}, {0.01f, 0.02f, 0.03f}));
    EXPECT_EQ(facts(smooth_of(torus)).euler(), 0);
}

TEST(Meshing, VolumeAndAreaConvergeToTheClosedForms) {
    // A triangle lies in a voxel, so its circumradius is at most sqrt(3)/2 voxels and it sags by at most 3/8 h²/R below the
    // sphere: both errors are below 9/8 (h/R)² of the whole, and fall with the square of the voxel.
    double volume_error[2], area_error[2];
    for (int i = 0; i < 2; ++i) {
        const float voxels = i == 0 ? 10 : 20;
        const MeshFacts f = facts(smooth_of(worlds::sphere_of(voxels, {0.3f, -0.2f, 0.4f}, 1 / voxels)));
        volume_error[i] = 4 * kPi / 3 - f.volume;
        area_error[i] = 4 * kPi - f.area;
        EXPECT_GT(volume_error[i], 0) << "a polyhedron with its corners on a sphere is smaller";
        EXPECT_LT(volume_error[i], 4 * kPi / 3 * 1.125 / double(voxels * voxels));
        EXPECT_LT(area_error[i], 4 * kPi * 1.125 / double(voxels * voxels));
    }
    EXPECT_NEAR(volume_error[0] / volume_error[1], 4, 0.4);
    EXPECT_NEAR(area_error[0] / area_error[1], 4, 0.4);
}

TEST(Meshing, NothingAndEverythingSolidMakeNoTriangles) {
    Mesh mesh;
    mesh_smooth(MeshBricks({}, DistanceFormat::Half, 0.1f), mesh);
    EXPECT_EQ(mesh.vertex_count() + mesh.triangle_count(), 0u);
    const meshes::MadeUp solid({0, 0, 0}, {2, 2, 2}, [](ivec3) { return -0.5f; });
    mesh_smooth(solid.view(), mesh);
    EXPECT_EQ(mesh.vertex_count() + mesh.triangle_count(), 0u);
}

}  // namespace
}  // namespace kiln::field
