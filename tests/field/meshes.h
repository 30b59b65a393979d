// SPDX-License-Identifier: MIT
// What the tests of meshers share: bricks of any numbers, and what a good mesh is.
#pragma once

#include "field/codes.gpu.h"
#include "field/mesh.h"
#include "field/mesh_facts.h"

#include "worlds.h"

#include <cstring>
#include <functional>
#include <map>
#include <set>

namespace kiln::field::meshes {

/// Bricks of a value per lattice point, in voxels, for world cells [low, high).
struct MadeUp {
    std::vector<std::vector<std::byte>> codes;
    std::vector<MeshBrick> bricks;
    DistanceFormat format;
    float voxel_size;

    MadeUp(ivec3 low, ivec3 high, const std::function<float(ivec3)>& value, DistanceFormat f = DistanceFormat::Half,
           float h = 0.1f)
        : format(f), voxel_size(h) {
        const size_t bytes = f == DistanceFormat::Half ? 2 : 1;
        for (int z = low.z; z < high.z; ++z) {
            for (int y = low.y; y < high.y; ++y) {
                for (int x = low.x; x < high.x; ++x) {
                    std::vector<std::byte> brick(512 * bytes);
                    for (int i = 0; i < 512; ++i) {
                        const float v = value({7 * x + (i & 7), 7 * y + (i >> 3 & 7), 7 * z + (i >> 6)});
                        const uint32_t code = f == DistanceFormat::Half ? half_code(v) : snorm8_code(v);
                        std::memcpy(brick.data() + size_t(i) * bytes, &code, bytes);
                    }
                    codes.push_back(std::move(brick));
                    bricks.push_back({{x, y, z}, uint32_t(bricks.size()), codes.back().data()});
                }
            }
        }
    }
    MeshBricks view() const { return {bricks, format, voxel_size}; }
};

/// Random values, empty on and beyond the faces of the box of cells, so that the surface is closed.
inline MadeUp noise(int cells, uint32_t seed, DistanceFormat format = DistanceFormat::Half) {
    const auto value = [=](ivec3 p) {
        const int end = 7 * cells;
        if (p.x <= 0 || p.y <= 0 || p.z <= 0 || p.x >= end || p.y >= end || p.z >= end) return 1.0f;
        uint32_t h =
            seed * 0x9e3779b9u + uint32_t(p.x) * 73856093u + uint32_t(p.y) * 19349663u + uint32_t(p.z) * 83492791u;
        h = (h ^ h >> 16) * 0x7feb352du;
        h = (h ^ h >> 15) * 0x846ca68bu;
        h ^= h >> 16;
        return h % 64 == 0 ? 0.0f : float(h >> 8) * 0x1p-23f - 1.0f;  // now and then exactly 0
    };
    return MadeUp({0, 0, 0}, {cells, cells, cells}, value, format);
}

inline MeshFacts facts(const Mesh& mesh) { return mesh_facts(mesh.positions.span(), mesh.triangles.span()); }

/// Vertices whose triangles do not form one ring.
inline size_t pinched_vertices(const Mesh& mesh) {
    std::vector<std::vector<std::pair<uint32_t, uint32_t>>> spokes(mesh.vertex_count());
    for (size_t t = 0; t < mesh.triangles.size(); t += 3) {
        for (size_t i = 0; i < 3; ++i) {
            spokes[mesh.triangles[t + i]].emplace_back(mesh.triangles[t + (i + 1) % 3],
                                                       mesh.triangles[t + (i + 2) % 3]);
        }
    }
    size_t out = 0;
    for (const auto& spoke : spokes) {
        if (spoke.empty()) continue;
        std::map<uint32_t, uint32_t> next(spoke.begin(), spoke.end());
        size_t length = 1;
        uint32_t at = spoke.front().second;
        while (at != spoke.front().first && next.contains(at) && length <= spoke.size()) at = next[at], ++length;
        out += next.size() != spoke.size() || length != spoke.size();
    }
    return out;
}

inline void expect_closed(const Mesh& mesh, const std::string& name) {
    const MeshFacts f = facts(mesh);
    EXPECT_GT(f.triangles, 0u) << name;
    EXPECT_EQ(f.open_edges, 0u) << name;
    EXPECT_EQ(f.non_manifold_edges, 0u) << name;
    EXPECT_EQ(f.vertices, mesh.vertex_count()) << name << ": vertices that no triangle uses";
    EXPECT_EQ(pinched_vertices(mesh), 0u) << name;
    std::set<std::tuple<float, float, float>> places;
    for (const vec3 p : mesh.positions.span()) places.emplace(p.x, p.y, p.z);
    EXPECT_EQ(places.size(), mesh.vertex_count()) << name << ": vertices that share a position";
}

}  // namespace kiln::field::meshes
