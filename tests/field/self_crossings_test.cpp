// SPDX-License-Identifier: MIT
// Starts threads.
// Meshes never pass through themselves.
#include "rounds.h"
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

TEST(SelfCrossings, NeitherMesherHasAny) {
    std::vector<worlds::World> all = worlds::all();
    all.push_back(gyroid());
    for (size_t i = 0; i < all.size(); i += 4 / size_t(rounds(4))) {
        const worlds::World& world = all[i];
        const HostBricks host = HostBricks::bake(world.field());
        const MeshBricks bricks(host);
        Mesh smooth, sharp;
        mesh_smooth(bricks, smooth);
        mesh_sharp(bricks, exact_of(host, bricks), sharp);
        ASSERT_GT(smooth.triangle_count(), 1000u) << world.name;
        meshes::expect_closed(smooth, world.name);
        meshes::expect_closed(sharp, world.name);
        const float h = host.field().grid().voxel_size;
        const Crossings a = crossings(smooth, h), b = crossings(sharp, h);
        EXPECT_EQ(a.apart + a.at_vertex, 0u) << world.name;
        EXPECT_EQ(b.apart + b.at_vertex, 0u) << world.name;
    }
}

// Every voxel is a thin wall here, and the field knows nothing of the bricks: vertices land anywhere in their voxels.
TEST(SelfCrossings, OfRandomSignsAreNone) {
    for (uint32_t seed = 3; seed < 3 + uint32_t(rounds(6)); ++seed) {
        const meshes::MadeUp noise = meshes::noise(2, seed);
        const MeshBricks bricks = noise.view();
        Mesh smooth, sharp;
        mesh_smooth(bricks, smooth);
        mesh_sharp(
            bricks,
            [seed](size_t, const sdf::Points& p, float* to) {
                const float size = seed % 3 == 0 ? 0.1f : seed % 3 == 1 ? 0.01f : 0.0f;  // far off, near, all on it
                for (int i = 0; i < p.count; ++i) to[i] = std::sin(90 * p.x[i]) * std::cos(70 * p.y[i] + p.z[i]) * size;
            },
            sharp);
        const Crossings a = crossings(smooth, 0.1f), b = crossings(sharp, 0.1f);
        EXPECT_EQ(a.apart + a.at_vertex, 0u);
        EXPECT_EQ(b.apart + b.at_vertex, 0u) << seed;
        EXPECT_GT(sharp.late_bricks.size(), 1000u);
        meshes::expect_closed(sharp, "noise");
    }
}

}  // namespace
}  // namespace kiln::field
