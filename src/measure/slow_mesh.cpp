// SPDX-License-Identifier: MIT
#include "measure/slow_mesh.h"

#include "base/hash.h"
#include "field/cell_cases.h"
#include "sdf/eval.h"

#include <algorithm>
#include <array>
#include <vector>

namespace kiln::measure {
namespace {

using namespace field;

constexpr float kLeastFraction = 1.0f / 256;  // of a lattice edge: vertices keep as far from its ends

// A triangle's first corner is the one with the least hash, so that it may be named from any of them.
uint64_t checksum_of(std::array<uint64_t, 3> h) {
    std::rotate(h.begin(), std::min_element(h.begin(), h.end()), h.end());
    return hash_combine(hash_combine(h[0], h[1]), h[2]);
}

uint64_t hash_of(vec3 v) {
    const float place[3] = {v.x, v.y, v.z};
    return hash64_of(std::span<const float>(place));
}

uint64_t edge_name(int axis, const std::array<int, 3>& low_texel) {
    uint64_t name = uint64_t(axis);
    for (const int t : low_texel) name = name << 20 | uint64_t(uint32_t(t) & 0xfffffu);
    return name;
}

// Of a vertex, which is that far from the ends of its edge.
uint64_t edge_name(vec3 v, float voxel) {
    int axis = 3;
    std::array<int, 3> low;
    for (int k = 0; k < 3; ++k) {
        const double at = double((&v.x)[k]) / double(voxel), near = std::round(at);
        const bool along = std::abs(at - near) > 0.5 * double(kLeastFraction);
        if (along) axis = k;
        low[size_t(k)] = int(along ? std::floor(at) : near);
    }
    return edge_name(axis, low);
}

// visit(brick, corners, names of their edges) for each triangle, each corner anew from its two texels.
template <typename Visit>
void each_triangle(const HostBricks& bricks, Visit&& visit) {
    const float h = bricks.field().grid().voxel_size;
    for (const uint32_t slot : bricks.field().slots()) {
        const BrickRecord& record = bricks.field().records()[slot];
        for (int i = 0; i < 343; ++i) {
            const int voxel[3] = {i % 7, i / 7 % 7, i / 49};
            float value[8];
            uint32_t solid = 0;
            for (int c = 0; c < 8; ++c) {
                value[c] = bricks.texel(slot, voxel[0] + (c & 1), voxel[1] + (c >> 1 & 1), voxel[2] + (c >> 2));
                solid |= uint32_t(value[c] <= 0) << c;
            }
            const CellTriangles& triangles = cell_tables().triangles[solid];
            std::array<vec3, 3> corners;
            std::array<uint64_t, 3> names;
            for (int k = 0; k < 3 * triangles.count; ++k) {
                // Edges are numbered as cell_cases.h says.
                const int edge = triangles.edges[k], axis = edge / 4;
                int corner[3] = {};
                corner[axis == 0 ? 1 : 0] = edge & 1;
                corner[axis == 2 ? 1 : 2] = edge >> 1 & 1;
                const std::array<int, 3> texel{record.texel_x + voxel[0] + corner[0],
                                               record.texel_y + voxel[1] + corner[1],
                                               record.texel_z + voxel[2] + corner[2]};
                const int from = corner[0] | corner[1] << 1 | corner[2] << 2;
                const float a = value[from], b = value[from | 1 << axis];
                float at[3] = {float(texel[0]), float(texel[1]), float(texel[2])};
                at[axis] += std::clamp(a / (a - b), kLeastFraction, 1 - kLeastFraction);
                corners[size_t(k % 3)] = {at[0] * h, at[1] * h, at[2] * h};
                names[size_t(k % 3)] = edge_name(axis, texel);
                if (k % 3 == 2) visit(record, corners, names);
            }
        }
    }
}

}  // namespace

uint64_t checksum_of_triangles(const Mesh& mesh) {
    uint64_t sum = 0;
    for (size_t t = 0; t < mesh.triangles.size(); t += 3) {
        const auto corner = [&](size_t k) { return hash_of(mesh.positions[mesh.triangles[t + k]]); };
        sum += checksum_of({corner(0), corner(1), corner(2)});
    }
    return hash_combine(sum, mesh.vertex_count());
}

uint64_t smooth_mesh_by_voxel(const HostBricks& bricks) {
    uint64_t sum = 0;
    std::vector<uint64_t> edges;
    each_triangle(bricks,
                  [&](const BrickRecord&, const std::array<vec3, 3>& corners, const std::array<uint64_t, 3>& names) {
                      sum += checksum_of({hash_of(corners[0]), hash_of(corners[1]), hash_of(corners[2])});
                      edges.insert(edges.end(), names.begin(), names.end());
                  });
    std::sort(edges.begin(), edges.end());
    return hash_combine(sum, uint64_t(std::unique(edges.begin(), edges.end()) - edges.begin()));
}

uint64_t checksum_of_edges(std::span<const vec3> vertices, std::span<const uint32_t> indices, float voxel) {
    uint64_t sum = 0;
    for (size_t t = 0; t < indices.size(); t += 3) {
        const auto corner = [&](size_t k) { return edge_name(vertices[indices[t + k]], voxel); };
        sum += checksum_of({corner(0), corner(1), corner(2)});
    }
    return sum;
}

uint64_t edges_by_voxel(const HostBricks& bricks, const Box3& within) {
    const float h = bricks.field().grid().voxel_size, half = 0.5f * float(kBrickVoxels);
    uint64_t sum = 0;
    each_triangle(bricks, [&](const BrickRecord& at, const std::array<vec3, 3>&, const std::array<uint64_t, 3>& names) {
        const vec3 middle{float(at.texel_x) + half, float(at.texel_y) + half, float(at.texel_z) + half};
        if (within.contains(middle * h)) sum += checksum_of(names);
    });
    return sum;
}

uint64_t checksum_of_bytes(const Mesh& mesh) {
    return hash_combine(hash64(std::as_bytes(mesh.positions.span())), hash64(std::as_bytes(mesh.triangles.span())));
}

ExactBrick every_edit(const HostBricks& host, const MeshBricks& bricks, uint64_t stride) {
    return [&host, pruned = exact_of(host, bricks), stride](size_t brick, const sdf::Points& points, float* out) {
        if (brick % stride == 0)
            sdf::evaluate(sdf::view(host.field().program()), points, out);
        else
            pruned(brick, points, out);
    };
}

}  // namespace kiln::measure
