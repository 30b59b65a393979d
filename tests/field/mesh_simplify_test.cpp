// SPDX-License-Identifier: MIT
// Starts threads.
#include "field/mesh_simplify.h"

#include "field/meshing.h"
#include "meshes.h"

#include <algorithm>
#include <cmath>
#include <limits>

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

// A flat sheet of unit squares, its inner vertices shaken and numbered at random.
Lists shaken_sheet(uint32_t side) {
    worlds::Random random(3);
    std::vector<uint32_t> number(side * side);
    for (uint32_t i = 0; i < number.size(); ++i) {
        number[i] = i;
        std::swap(number[i], number[size_t(random.below(int(i) + 1))]);
    }
    Lists mesh;
    mesh.positions.resize(number.size());
    for (uint32_t y = 0; y < side; ++y) {
        for (uint32_t x = 0; x < side; ++x) {
            const float by = x > 0 && y > 0 && x + 1 < side && y + 1 < side ? 0.3f : 0;
            const uint32_t v = y * side + x;
            mesh.positions[number[v]] = {float(x) + random.in(-by, by), float(y) + random.in(-by, by), 0};
            if (x + 1 == side || y + 1 == side) continue;
            for (const uint32_t corner : {v, v + 1, v + side, v + 1, v + side + 1, v + side})
                mesh.triangles.push_back(number[corner]);
            mesh.parts.insert(mesh.parts.end(), {0, 0});
        }
    }
    return mesh;
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

TEST(MeshSimplify, ASmallThingOnAWidePlaneIsMeasuredByItself) {
    // The root mean square over plane and spike together is small wherever the spike's tip goes.
    Lists mesh = shaken_sheet(41);
    const auto tip = std::ranges::find_if(
        mesh.positions, [](const vec3& p) { return std::fabs(p.x - 20) < 0.4f && std::fabs(p.y - 20) < 0.4f; });
    ASSERT_NE(tip, mesh.positions.end());
    tip->z = 1;
    simplify(mesh.positions, mesh.triangles, mesh.parts, 1, 0.3f);
    EXPECT_LT(mesh.parts.size(), 300u);
    EXPECT_TRUE(std::ranges::count(mesh.triangles, uint32_t(tip - mesh.positions.begin())) > 0);
}

TEST(MeshSimplify, NoCornerOfAPlaneTakesItsTrianglesToItself) {
    // Each collapse looks at all triangles of the corner that stays: with some hundreds of them a fine plane would take minutes.
    Lists mesh = shaken_sheet(65);
    simplify(mesh.positions, mesh.triangles, mesh.parts, 0.1f, std::numeric_limits<float>::infinity());
    EXPECT_LT(mesh.parts.size(), 900u);
    std::vector<int> around(mesh.positions.size());
    for (const uint32_t v : mesh.triangles) ++around[v];
    EXPECT_LE(std::ranges::max(around), 16);
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

TEST(MeshSimplify, OpenEdgesStayAndNoTriangleTurnsOver) {
    // Collapses cost nothing, so only these two rules say no.
    constexpr uint32_t kSide = 17;
    Lists mesh = shaken_sheet(kSide);
    for (const float share : {0.7f, 0.7f, 0.7f, 0.7f, 0.01f}) {
        simplify(mesh.positions, mesh.triangles, mesh.parts, share, std::numeric_limits<float>::infinity());
        const MeshFacts f = mesh_facts(mesh.positions, mesh.triangles);
        EXPECT_EQ(f.open_edges, 4 * (kSide - 1));
        EXPECT_NEAR(f.area, double((kSide - 1) * (kSide - 1)), 1e-4);
        for (size_t t = 0; t < mesh.triangles.size(); t += 3) {
            const vec3 a = mesh.positions[mesh.triangles[t]], b = mesh.positions[mesh.triangles[t + 1]],
                       c = mesh.positions[mesh.triangles[t + 2]];
            EXPECT_GT(cross(b - a, c - a).z, 0);
        }
    }
    EXPECT_LT(mesh.parts.size(), 100u);
}

}  // namespace
}  // namespace kiln::field
