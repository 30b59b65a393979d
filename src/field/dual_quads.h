// SPDX-License-Identifier: MIT
// Triangles of a dual mesh: a quad around each crossed edge of the lattice, from the vertices of the voxels around it. No two triangles
// cross, whatever the signs are and wherever in its voxel a vertex lies. Lengths are in voxels unless metres are said.
//
// On every face that the surface passes, a path leads from one crossed edge to another by one point inside the face. The paths of a loop of
// crossed edges close around its vertex, and the triangles from the vertex to the path are that loop's surface in the voxel: a cone
// from a point inside the voxel over a simple closed curve on its border, which does not cross itself. Cones of two voxels meet only in their
// common face, in the same path. So nothing crosses, if the loops of one voxel keep clear of each other.
//
// - A plain face lies between two voxels of one loop each, of which no face is ambiguous. Its point is where the line between the two vertices
//   passes it (a pair of voxels is convex), so what lies on both sides of it is one triangle: crossing, vertex, next vertex. It stays in
//   its room, the tetrahedron of the edge and the two vertices; rooms of different edges share only faces (Ju and Udeshi,
//   "Intersection-free contouring on an octree grid", 2006). Any other triangles with the same border that stay in the four rooms around an edge will
//   do as well: two of them, where one of the quad's diagonals stays; else a fan of four around the crossing.
// - On all others the path is straight, from crossing to crossing, by a vertex of its own in between, and the quads beside it are fans.
//   A voxel's loops lie on different sides of planes (tests/field/cell_cases_test.cpp shows one for each pair), with straight paths and a vertex
//   among its crossings so does each cone. Fans keep two edges of an ambiguous face apart that dual contouring would draw
//   between the same two vertices: the mesh is a manifold.
#pragma once

#include "field/mesh_edges.h"
#include "field/meshing.h"

#include <vector>

namespace kiln::field {

typedef float float4 __attribute__((vector_size(16)));

/// What the surface is where an edge crosses it: the normal, of unit length and towards the empty side (0 where the gradient
/// vanishes), and in the last place how far along the edge, (0, 1).
using Crossing = float4;

/// Slot i of an edge: the vertex of the voxel for which the edge lies at i & 1 and i >> 1 of the other two axes, in ascending order.
using AroundEdge = std::array<uint32_t, 4>;
inline constexpr uint32_t kNothing = UINT32_MAX;    ///< there is no voxel
inline constexpr uint32_t kNotPlain = 0x80000000u;  ///< added to a vertex: its voxel's faces are not plain

/// Points of the lattice in metres. Whole numbers come first, so that bricks agree on what they share.
class LatticePoints {
public:
    explicit LatticePoints(const MeshBricks& bricks) : bricks_(bricks), h_(bricks.voxel_size()) {}
    /// `p` from the texel.
    vec3 world(vec3 texel, vec3 p) const { return {(texel.x + p.x) * h_, (texel.y + p.y) * h_, (texel.z + p.z) * h_}; }
    vec3 world(size_t brick, int texel, vec3 p) const {
        const ivec3 cell = bricks_.bricks()[brick].cell;
        return world(vec3{float(cell.x * kBrickVoxels + (texel & 7)), float(cell.y * kBrickVoxels + (texel >> 3 & 7)),
                          float(cell.z * kBrickVoxels + (texel >> 6))},
                     p);
    }
    static vec3 on_edge(int axis, float t) { return {axis == 0 ? t : 0, axis == 1 ? t : 0, axis == 2 ? t : 0}; }

private:
    const MeshBricks& bricks_;
    const float h_;
};

/// A path over a face that is not plain, as one of its two voxels sees it.
struct FacePath {
    uint32_t edges[2];  ///< numbers, ascending
    uint8_t sides[2];   ///< which of the four faces around each edge it is
    uint32_t brick;
    vec3 ends[2];  ///< the crossings, from `texel`
    int texel;     ///< the voxel's first
};
/// `a` and `b`: edges of cell_cases.h that share a face of the voxel.
FacePath face_path(size_t brick, int texel, int a, int b, const EdgeNumbers& numbers, const Crossing* crossings);

class DualQuads {
public:
    /// `out.positions` hold the vertices of the voxels, by brick.
    DualQuads(const MeshEdges& edges, const Buffer<Crossing>& crossings, const Buffer<AroundEdge>& around, Mesh& out);

    /// Adds the vertices and all triangles. `paths` are of all voxels that are not plain, by brick.
    void make(std::vector<FacePath> paths, const ExactBrick& exact, int workers);

private:
    enum class Way : uint8_t { kNone, kFirst, kSecond, kFan };
    struct Late {
        uint64_t side;  // 4 * edge + face around it
        uint32_t vertex;
    };
    struct Counts {
        uint32_t triangles = 0, fans = 0;
    };

    void add_face_vertices(std::vector<FacePath>& paths, const ExactBrick& exact, int workers);
    Counts choose(size_t brick);
    void write(size_t brick, uint32_t first_triangle, uint32_t first_fan);
    Way way(const uint32_t (&ring)[4], size_t brick, int texel, int axis, const Crossing& c) const;
    uint32_t face_vertex(uint32_t edge, int side) const;
    template <typename Fn>
    void each_edge(size_t brick, Fn&& fn) const;

    const MeshEdges& edges_;
    const LatticePoints lattice_;
    const Buffer<Crossing>& crossings_;
    const Buffer<AroundEdge>& around_;
    Mesh& out_;
    const float per_voxel_;
    Buffer<Way> ways_;        // by edge
    std::vector<Late> late_;  // ascending
};

}  // namespace kiln::field
