// SPDX-License-Identifier: MIT
// Whether meshes pass through themselves: never, by marching cubes; by the sharp mesher only where two sheets of surface share a voxel, or
// where all four vertices of a quad lie so low in their voxels that neither of its diagonals stays in its own room.
#include "self_crossings.h"

#include "field/meshing.h"
#include "meshes.h"

namespace kiln::field {
namespace {

using meshes::Crossings;

Crossings crossings(const Mesh& mesh, float voxel_size) {
    return meshes::SelfCrossings(mesh.positions.span(), mesh.triangles.span()).count(voxel_size);
}

worlds::World gyroid() {
    worlds::World w{"gyroid", {}, {.voxel_size = 0.05f, .bounds = {{-1.5f, -1.5f, -1.5f}, {1.5f, 1.5f, 1.5f}}}};
    w.edits.push_back(
        worlds::edit(Expression{.expression = "(sin(4*x)*cos(4*y) + sin(4*y)*cos(4*z) + sin(4*z)*cos(4*x)) / 8",
                                .half_extents = {1.4f, 1.4f, 1.4f}}));
    w.edits.push_back(worlds::edit(Sphere{.radius = 1.2f}, {}, Op::Intersect));
    return w;
}

TEST(SelfCrossings, AreFoundWhereTrianglesCross) {
    const vec3 places[] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0.2f, 0.2f, -1}, {0.2f, 0.3f, 1}, {0.3f, 0.2f, 1}};
    const uint32_t apart[] = {0, 1, 2, 3, 4, 5}, folded[] = {0, 1, 2, 0, 4, 5};
    EXPECT_EQ(meshes::SelfCrossings(places, apart).count(0.7f).apart, 1u);
    EXPECT_EQ(meshes::SelfCrossings(places, folded).count(0.7f).at_vertex, 0u);  // they only meet in the vertex
    const vec3 through[] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0.2f, 0.2f, -1}, {0.3f, 0.3f, 1}};
    const uint32_t pair[] = {0, 1, 2, 0, 3, 4};
    EXPECT_EQ(meshes::SelfCrossings(through, pair).count(0.7f).at_vertex, 1u);
}

TEST(SelfCrossings, MarchingCubesHasNoneAndTheSharpMesherNextToNone) {
    std::vector<worlds::World> all = worlds::all();
    all.push_back(gyroid());
    size_t triangles = 0, found = 0;
    for (const worlds::World& world : all) {
        const HostBricks host = HostBricks::bake(world.field());
        const MeshBricks bricks(host);
        Mesh smooth, sharp;
        mesh_smooth(bricks, smooth);
        mesh_sharp(bricks, exact_of(host, bricks), sharp);
        ASSERT_GT(smooth.triangle_count(), 1000u) << world.name;
        const float h = host.field().grid().voxel_size;
        const Crossings a = crossings(smooth, h), b = crossings(sharp, h);
        EXPECT_EQ(a.apart + a.at_vertex, 0u) << world.name;
        std::printf("%-12s sharp: %zu triangles, %zu pairs cross, %zu at a common vertex\n", world.name.c_str(),
                    sharp.triangle_count(), b.apart, b.at_vertex);
        EXPECT_LE(b.apart + b.at_vertex, 6u) << world.name;
        triangles += sharp.triangle_count(), found += b.apart + b.at_vertex;
    }
    EXPECT_LE(found, triangles / 10000);
}

TEST(SelfCrossings, OfRandomSignsAreNoneByMarchingCubesAndFewByTheSharpMesher) {
    for (const uint32_t seed : {3u, 4u}) {
        const meshes::MadeUp noise = meshes::noise(2, seed);
        const MeshBricks bricks = noise.view();
        Mesh smooth, sharp;
        mesh_smooth(bricks, smooth);
        mesh_sharp(
            bricks,
            [](size_t, const sdf::Points& p, float* to) {
                for (int i = 0; i < p.count; ++i) to[i] = std::sin(90 * p.x[i]) * std::cos(70 * p.y[i] + p.z[i]) * 0.1f;
            },
            sharp);
        const Crossings a = crossings(smooth, 0.1f), b = crossings(sharp, 0.1f);
        EXPECT_EQ(a.apart + a.at_vertex, 0u);
        EXPECT_LE(b.apart + b.at_vertex, sharp.triangle_count() / 50);  // every voxel is a thin wall here
    }
}

}  // namespace
}  // namespace kiln::field
