// SPDX-License-Identifier: MIT
// The crossed lattice edges of a set of bricks, numbered: an edge is crossed where one end is solid (value <= 0) and the other is
// not. Bricks share the edges in their common faces; of the bricks that hold an edge the first in order (z, y, x) owns it, so each
// crossed edge has one number however many bricks see it, and numbers follow the order of bricks for any number of workers.
// Both meshers stand on this: marching cubes puts a vertex on each edge, the sharp mesher a quad around it.
#pragma once

#include "field/mesh.h"
#include "field/solid.h"

#include <array>
#include <bit>

namespace kiln::field {

inline uint32_t bits_of(uint64_t word) {  // the plain instruction set has no population count
    word -= word >> 1 & 0x5555555555555555u;
    word = (word & 0x3333333333333333u) + (word >> 2 & 0x3333333333333333u);
    return uint32_t(((word + (word >> 4)) & 0x0f0f0f0f0f0f0f0fu) * 0x0101010101010101u >> 56);
}

/// What is known of one brick before its vertices exist.
struct BrickEdges {
    std::array<Slice, 8> solid;     ///< by z
    std::array<Slice, 24> owned;    ///< axis * 8 + z: crossed edges this brick numbers; bit of the edge's lower end
    std::array<uint16_t, 24> rank;  ///< owned edges before those of (axis, z)
    std::array<int32_t, 9> lower;   ///< neighbours that come before it (kLower); -1: none
    uint32_t first_edge = 0, edges = 0;
    uint32_t first_item = 0, items = 0;  ///< the mesher's own count (triangles, dual vertices)
    bool crossed = false;                ///< some texels are solid and some are not
};

/// Steps to those neighbours that come before a brick in order and share an edge with it.
inline constexpr ivec3 kLower[9] = {{-1, 0, 0},  {-1, -1, 0}, {0, -1, 0}, {1, -1, 0}, {0, -1, -1},
                                    {-1, 0, -1}, {0, 0, -1},  {1, 0, -1}, {0, 1, -1}};

/// Edges of `solid` along an axis in slice z: bit set where the ends differ.
inline Slice crossed_edges(const std::array<Slice, 8>& solid, int axis, int z) {
    const Slice s = solid[size_t(z)];
    if (axis == 0) return (s ^ s >> 1) & 0x7f7f7f7f7f7f7f7fu;
    if (axis == 1) return (s ^ s >> 8) & 0x00ffffffffffffffu;
    return z < 7 ? s ^ solid[size_t(z) + 1] : 0;
}

/// Voxels of slice z (0 … 6) that the surface passes: bit y * 8 + x, x and y < 7.
inline Slice active_voxels(const std::array<Slice, 8>& solid, int z) {
    const Slice a = solid[size_t(z)], b = solid[size_t(z) + 1];
    Slice any = a | b, all = a & b;
    any |= any >> 1;
    all &= all >> 1;
    any |= any >> 8;
    all &= all >> 8;
    return any & ~all & 0x007f7f7f7f7f7f7fu;
}

/// Corner signs (cell_cases.h) of the voxel at `bit` of slice z.
inline uint32_t corner_signs(const std::array<Slice, 8>& solid, int z, int bit) {
    const Slice a = solid[size_t(z)] >> bit, b = solid[size_t(z) + 1] >> bit;
    return uint32_t((a & 3) | (a >> 6 & 12) | (b << 4 & 48) | (b >> 2 & 192));
}

/// Numbers by axis * 512 + texel, of the edge's lower end. Only crossed edges are filled in.
using EdgeNumbers = std::array<uint32_t, 1536>;

/// From an edge of cell_cases.h to its place in EdgeNumbers, relative to the voxel's first texel.
inline constexpr std::array<uint16_t, 12> kEdgeOffset = [] {
    std::array<uint16_t, 12> out{};
    for (int e = 0; e < 12; ++e) {
        const int axis = e / 4, u = e & 1, v = e >> 1 & 1;
        const int x = axis == 0 ? 0 : u, y = axis == 0 ? u : axis == 1 ? 0 : v, z = axis == 2 ? 0 : v;
        out[size_t(e)] = uint16_t(axis * 512 + z * 64 + y * 8 + x);
    }
    return out;
}();

class MeshEdges {
public:
    /// Signs, owners and counts. `count_items` is asked of every brick the surface passes.
    template <typename CountItems>
    MeshEdges(const MeshBricks& bricks, int workers, CountItems&& count_items) : MeshEdges(bricks) {
        count(workers, {&count_items, [](void* object, const BrickEdges& brick) {
                            return (*static_cast<std::remove_reference_t<CountItems>*>(object))(brick);
                        }});
    }

    const MeshBricks& bricks() const { return bricks_; }
    const BrickEdges& operator[](size_t brick) const { return edges_[brick]; }
    uint32_t edge_count() const { return edge_count_; }
    uint32_t item_count() const { return item_count_; }

    /// Numbers of all crossed edges of a brick.
    void number(size_t brick, EdgeNumbers& out) const;

private:
    struct Count {
        void* object;
        uint32_t (*call)(void* object, const BrickEdges& brick);
    };
    explicit MeshEdges(const MeshBricks& bricks);
    void count(int workers, Count items);
    void count_row(const MeshBricks::Row& row, Count items);
    uint32_t number_of(int32_t brick, int axis, int x, int y, int z) const;

    const MeshBricks& bricks_;
    Buffer<BrickEdges> edges_;
    uint32_t edge_count_ = 0, item_count_ = 0;
};

}  // namespace kiln::field
