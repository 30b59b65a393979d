// SPDX-License-Identifier: MIT
// What can be counted and measured on a triangle mesh: whether it is closed, its volume and its area.
#pragma once

#include <kiln/math.h>

#include <cstdint>
#include <span>
#include <vector>

namespace kiln::field {

struct MeshFacts {
    uint64_t vertices = 0;  ///< that some triangle uses
    uint64_t triangles = 0;
    uint64_t edges = 0;               ///< pairs of vertices
    uint64_t open_edges = 0;          ///< of one triangle
    uint64_t non_manifold_edges = 0;  ///< of three or more, or of two that do not agree which side is out
    double volume = 0;                ///< cubic metres inside, where the mesh is closed
    double area = 0;                  ///< square metres
    Box3 bounds;

    int64_t euler() const { return int64_t(vertices) - int64_t(edges) + int64_t(triangles); }
};

/// `faulty`: is given the vertices of open and non-manifold edges.
MeshFacts mesh_facts(std::span<const vec3> positions, std::span<const uint32_t> triangles,
                     std::vector<uint32_t>* faulty = nullptr);

}  // namespace kiln::field
