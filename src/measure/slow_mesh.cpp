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

uint64_t checksum_of(const std::array<vec3, 3>& corners) {
    // A triangle's first corner is the one with the least hash, so that it may be named from any of them.
    std::array<uint64_t, 3> h;
    for (size_t i = 0; i < 3; ++i) {
        const float place[3] = {corners[i].x, corners[i].y, corners[i].z};
        h[i] = hash64_of(std::span<const float>(place));
    }
    std::rotate(h.begin(), std::min_element(h.begin(), h.end()), h.end());
    return hash_combine(hash_combine(h[0], h[1]), h[2]);
}

}  // namespace

uint64_t checksum_of_triangles(const Mesh& mesh) {
    uint64_t sum = 0;
    for (size_t t = 0; t < mesh.triangles.size(); t += 3)
        sum += checksum_of({mesh.positions[mesh.triangles[t]], mesh.positions[mesh.triangles[t + 1]],
                            mesh.positions[mesh.triangles[t + 2]]});
    return hash_combine(sum, mesh.vertex_count());
}

uint64_t smooth_mesh_by_voxel(const HostBricks& bricks) {
    const float h = bricks.field().grid().voxel_size;
    uint64_t sum = 0;
    std::vector<uint64_t> edges;
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
            for (int k = 0; k < 3 * triangles.count; ++k) {
                // Edges are numbered as cell_cases.h says.
                const int edge = triangles.edges[k], axis = edge / 4;
                int corner[3] = {};
                corner[axis == 0 ? 1 : 0] = edge & 1;
                corner[axis == 2 ? 1 : 2] = edge >> 1 & 1;
                const int texel[3] = {record.texel_x + voxel[0] + corner[0], record.texel_y + voxel[1] + corner[1],
                                      record.texel_z + voxel[2] + corner[2]};
                const int from = corner[0] | corner[1] << 1 | corner[2] << 2;
                const float a = value[from], b = value[from | 1 << axis];
                float at[3] = {float(texel[0]), float(texel[1]), float(texel[2])};
                at[axis] += std::clamp(a / (a - b), kLeastFraction, 1 - kLeastFraction);
                corners[size_t(k % 3)] = {at[0] * h, at[1] * h, at[2] * h};
                uint64_t name = uint64_t(axis);
                for (const int t : texel) name = name << 20 | uint64_t(uint32_t(t) & 0xfffffu);
                edges.push_back(name);
                if (k % 3 == 2) sum += checksum_of(corners);
            }
        }
    }
    std::sort(edges.begin(), edges.end());
    return hash_combine(sum, uint64_t(std::unique(edges.begin(), edges.end()) - edges.begin()));
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
