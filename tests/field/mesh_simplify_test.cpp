// SPDX-License-Identifier: MIT
#include "field/mesh_simplify.h"

#include "field/meshing.h"
#include "meshes.h"

namespace kiln::field {
namespace {

struct Lists {
    std::vector<vec3> positions;
    std::vector<uint32_t> triangles, parts;
};

Lists lists_of(const worlds::World& world) {
    const HostBricks host = HostBricks::bake(world.field());
    Mesh mesh;
    mesh_smooth(MeshBricks(host), mesh);
    return {{mesh.positions.span().begin(), mesh.positions.span().end()},
            {mesh.triangles.span().begin(), mesh.triangles.span().end()},
            std::vector<uint32_t>(mesh.triangle_count())};
}

TEST(MeshSimplify, StaysAClosedManifoldOfTheSameTopology) {
    for (const worlds::World& world : worlds::all()) {
        Lists mesh = lists_of(world);
        const MeshFacts before = mesh_facts(mesh.positions, mesh.triangles);
        for (const float share : {0.5f, 0.1f, 0.01f}) {
            simplify(mesh.positions, mesh.triangles, mesh.parts, share, std::numeric_limits<float>::infinity());
            const MeshFacts f = mesh_facts(mesh.positions, mesh.triangles);
            EXPECT_LT(f.triangles, before.triangles) << world.name;
            EXPECT_EQ(f.open_edges + f.non_manifold_edges, 0u) << world.name << " " << share;
            EXPECT_EQ(f.euler(), before.euler()) << world.name << " " << share;
        }
    }
}

TEST(MeshSimplify, ErrorBoundsHowFarTheSurfaceMoves) {
    const worlds::World ball = worlds::sphere_of(16);
    const float h = ball.options.voxel_size, radius = 16 * h;
    Lists mesh = lists_of(ball);
    const size_t before = mesh.triangles.size();
    const float error = 0.05f * h;
    simplify(mesh.positions, mesh.triangles, mesh.parts, 1, error);
    EXPECT_LT(mesh.triangles.size(), before / 2);
    const vec3 center = vec3{0.3f, -0.2f, 0.4f} * h;
    for (size_t t = 0; t < mesh.triangles.size(); t += 3) {
        const vec3 middle = (mesh.positions[mesh.triangles[t]] + mesh.positions[mesh.triangles[t + 1]] +
                             mesh.positions[mesh.triangles[t + 2]]) /
                            3.0f;
        EXPECT_NEAR(length(middle - center), radius,
                    4 * error + 0.03f * h);  // root mean square, not the most; and chords
    }
}

TEST(MeshSimplify, BordersBetweenPartsStayStraight) {
    // A box cut in two parts along a plane through its middle: corners of triangles of both parts stay on it.
    worlds::World box{"box", {}, {.voxel_size = 0.05f, .bounds = {{-1, -1, -1}, {1, 1, 1}}}};
    box.edits.push_back(worlds::edit(Box{.half_extents = {0.6f, 0.5f, 0.4f}}, {0.01f, 0.02f, 0.03f}));
    Lists mesh = lists_of(box);
    const auto side = [&](uint32_t t) {
        const auto x = [&](size_t k) { return mesh.positions[mesh.triangles[3 * t + k]].x; };
        return (x(0) + x(1) + x(2)) / 3 > 0.101f ? 1u : 0u;
    };
    for (uint32_t t = 0; t < mesh.parts.size(); ++t) mesh.parts[t] = side(t);
    simplify(mesh.positions, mesh.triangles, mesh.parts, 0.05f, std::numeric_limits<float>::infinity());
    std::vector<uint32_t> seen(mesh.positions.size());
    for (size_t t = 0; t < mesh.parts.size(); ++t)
        for (size_t k = 0; k < 3; ++k) seen[mesh.triangles[3 * t + k]] |= 1u << mesh.parts[t];
    int shared = 0;
    for (size_t v = 0; v < seen.size(); ++v) {
        if (seen[v] != 3) continue;
        ++shared;
        EXPECT_NEAR(mesh.positions[v].x, 0.1f, 0.05f);
    }
    EXPECT_GE(shared, 4);
}

TEST(MeshSimplify, OpenEdgesStay) {
    Lists mesh{{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0.5f, 0.5f, 0}},
               {0, 1, 4, 1, 2, 4, 2, 3, 4, 3, 0, 4},
               {0, 0, 0, 0}};
    simplify(mesh.positions, mesh.triangles, mesh.parts, 0.1f, std::numeric_limits<float>::infinity());
    EXPECT_EQ(mesh_facts(mesh.positions, mesh.triangles).open_edges, 4u);
}

}  // namespace
}  // namespace kiln::field
