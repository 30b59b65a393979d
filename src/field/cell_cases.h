// SPDX-License-Identifier: MIT
// What the eight corner signs of a voxel say about the surface in it: closed loops of crossed edges, and their triangles.
//
// Nothing is tabled by hand. On each face the crossed edges are joined by a rule that sees only the face's four signs, so both
// voxels of a face draw the same segments: runs of solid corners are cut off one by one ("separate the solids"). Walked as seen from outside the voxel, a segment goes from the edge where the walk enters the
// solid to one where it leaves. An edge has two faces that walk it in opposite directions, so it starts one segment and
// ends one: the segments of a voxel close into loops.
// Marching cubes: Lorensen and Cline, "Marching Cubes", 1987. Ambiguous faces: Nielson and Hamann, "The Asymptotic Decider", 1991;
// Chernyaev, "Marching Cubes 33", 1995.
//
// Corner c is at (c & 1, c >> 1 & 1, c >> 2). Edge e runs along axis e / 4; its other coordinates, in ascending order of axis, are
// e & 1 and e >> 1 & 1. Face f is the side f & 1 of axis f / 2.
#pragma once

#include <array>
#include <cstdint>

namespace kiln::field {

inline constexpr int kMostLoops = 4;      // each has three edges or more, and a voxel twelve
inline constexpr int kMostTriangles = 5;  // of any of the 256 voxels

/// The loops of one voxel, edges in order, anticlockwise as seen from the empty side.
struct CellLoops {
    uint8_t count = 0;
    uint8_t first[kMostLoops + 1] = {};  ///< loop i is edges[first[i]] … edges[first[i + 1] - 1]
    uint8_t edges[12] = {};
};

/// Bit c of `solid`: corner c is solid.
CellLoops cell_loops(uint32_t solid);

/// Bits of the faces whose signs alternate around it.
uint32_t ambiguous_faces(uint32_t solid);

struct CellTriangles {
    uint8_t count = 0;
    uint8_t edges[3 * kMostTriangles] = {};
};

/// Triangulates the loops without a diagonal that lies in a face of the voxel: such a one could be drawn by both voxels of the
/// face, and four triangles would meet in it. With none, every segment has its two triangles in its two voxels, and every
/// diagonal in one: the surface is a manifold whatever the signs. Among those, least squared length of diagonals between middles.
CellTriangles cell_triangles(const CellLoops& loops);

/// By `solid`; made at first use.
struct CellTables {
    std::array<CellLoops, 256> loops;
    std::array<CellTriangles, 256> triangles;
    std::array<bool, 256> plain;  ///< one loop at most, and no ambiguous face
};
const CellTables& cell_tables();

}  // namespace kiln::field
