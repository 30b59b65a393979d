// SPDX-License-Identifier: MIT
// What lies beyond the edges of a meshed region's triangles, so that a body slides over an edge between two as over one (Bullet knows
// this only of whole bodies that are meshes: btInternalEdgeUtility).
#pragma once

#include "physics/region_mesh.h"

#include <array>
#include <optional>

namespace kiln::physics {

class RegionEdges {
public:
    explicit RegionEdges(const RegionMesh& mesh);
    /// The normal of a contact at p on one of the region's triangles, brought to what its surface there allows: between those of both
    /// triangles at an edge that sticks out. At one that is flat or hollow only the triangle's own is; what comes at it otherwise meets
    /// the other triangle first, and is no contact of this one.
    std::optional<vec3> allowed(const RegionMesh& mesh, uint32_t triangle, vec3 p, vec3 normal) const;

private:
    std::vector<std::array<int32_t, 3>>
        beside_;  // by own triangle: the one beyond the edge from corner i to i + 1; -1: none
};

}  // namespace kiln::physics
