// SPDX-License-Identifier: MIT
#include "field/meshing.h"

#include "field/cell_cases.h"
#include "field/mesh_edges.h"

#include "base/parallel_for.h"
#include "base/profile.h"

#include <cstring>

namespace kiln::field {
namespace {

constexpr int kRowGrain = 4;

// A voxel's triangles as places in EdgeNumbers.
struct Row {
    uint16_t count;  // numbers, 3 a triangle
    uint16_t place[15];
};
const std::array<Row, 256>& triangle_rows() {
    static const std::array<Row, 256> rows = [] {
        std::array<Row, 256> out{};
        for (size_t solid = 0; solid < 256; ++solid) {
            const CellTriangles& triangles = cell_tables().triangles[solid];
            out[solid].count = uint16_t(3 * triangles.count);
            for (size_t i = 0; i < out[solid].count; ++i) out[solid].place[i] = kEdgeOffset[triangles.edges[i]];
        }
        return out;
    }();
    return rows;
}

// Bits of a stored half as a float scaled by 2^-112, then scaled back: no special case for 0, and exact.
float value_of(const std::byte* codes, DistanceFormat format, size_t texel) {
    if (format == DistanceFormat::Snorm8) return float(int8_t(codes[texel]));
    uint16_t code;
    std::memcpy(&code, codes + 2 * texel, 2);
    return std::bit_cast<float>(uint32_t(code & 0x8000u) << 16 | uint32_t(code & 0x7fffu) << 13);
}

class Smooth {
public:
    Smooth(const MeshEdges& edges, Mesh& out) : edges_(edges), out_(out) {}

    void brick(size_t index) {
        const BrickEdges& edges = edges_[index];
        if (!edges.crossed) return;
        EdgeNumbers numbers;
        edges_.number(index, numbers);
        vertices(index, edges);
        triangles(edges, numbers);
    }

private:
    void vertices(size_t index, const BrickEdges& edges) {
        const MeshBrick& brick = edges_.bricks().bricks()[index];
        const DistanceFormat format = edges_.bricks().format();
        const float h = edges_.bricks().voxel_size();
        // Texel positions as the bakers make them: whole numbers first, so that neighbours agree.
        const int first[3] = {brick.cell.x * kBrickVoxels, brick.cell.y * kBrickVoxels, brick.cell.z * kBrickVoxels};
        vec3* to = out_.positions.data() + edges.first_edge;
        for (int axis = 0; axis < 3; ++axis) {
            const size_t step = axis == 0 ? 1 : axis == 1 ? 8 : 64;
            for (int z = 0; z < 8; ++z) {
                for (Slice left = edges.owned[size_t(axis * 8 + z)]; left != 0; left &= left - 1) {
                    const int bit = std::countr_zero(left);
                    const size_t texel = size_t(z * 64 + bit);
                    const float a = value_of(brick.codes, format, texel);
                    const float b = value_of(brick.codes, format, texel + step);
                    const float t = std::min(std::max(a / (a - b), kLeastFraction), 1 - kLeastFraction);
                    float p[3] = {float(first[0] + (bit & 7)), float(first[1] + (bit >> 3)), float(first[2] + z)};
                    p[axis] += t;
                    *to++ = {p[0] * h, p[1] * h, p[2] * h};
                }
            }
        }
    }

    void triangles(const BrickEdges& edges, const EdgeNumbers& numbers) {
        const std::array<Row, 256>& rows = triangle_rows();
        uint32_t made[343 * 3 * kMostTriangles];
        uint32_t* to = made;
        for (int z = 0; z < kBrickVoxels; ++z) {
            for (Slice left = active_voxels(edges.solid, z); left != 0; left &= left - 1) {
                const int bit = std::countr_zero(left);
                const Row& row = rows[corner_signs(edges.solid, z, bit)];
                const uint32_t* const from = numbers.data() + z * 64 + bit;
                for (size_t i = 0; i < row.count; i += 3) {
                    to[0] = from[row.place[i]];
                    to[1] = from[row.place[i + 1]];
                    to[2] = from[row.place[i + 2]];
                    to += 3;
                }
            }
        }
        std::memcpy(out_.triangles.data() + 3 * size_t(edges.first_item), made, size_t(to - made) * sizeof(uint32_t));
    }

    const MeshEdges& edges_;
    Mesh& out_;
};

}  // namespace

void mesh_smooth(const MeshBricks& bricks, Mesh& out, int workers) {
    KILN_PROFILE("mesh");
    const std::array<Row, 256>& rows = triangle_rows();
    const MeshEdges edges(bricks, workers, [&](const BrickEdges& brick) {
        uint32_t numbers = 0;
        for (int z = 0; z < kBrickVoxels; ++z) {
            for (Slice left = active_voxels(brick.solid, z); left != 0; left &= left - 1)
                numbers += rows[corner_signs(brick.solid, z, std::countr_zero(left))].count;
        }
        return numbers / 3;
    });
    out.positions.resize(edges.edge_count());
    out.triangles.resize(3 * size_t(edges.item_count()));
    out.brick_vertices.resize(bricks.bricks().size() + 1);
    for (size_t i = 0; i < bricks.bricks().size(); ++i) out.brick_vertices[i] = edges[i].first_edge;
    out.brick_vertices[bricks.bricks().size()] = edges.edge_count();
    out.late_bricks.resize(0);
    Smooth smooth(edges, out);
    parallel_for(
        bricks.rows().size(), workers,
        [&](int i) {
            const MeshBricks::Row& row = bricks.rows()[size_t(i)];
            for (size_t brick = row.first; brick < row.end; ++brick) smooth.brick(brick);
        },
        kRowGrain);
}

}  // namespace kiln::field
