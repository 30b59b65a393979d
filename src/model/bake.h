// SPDX-License-Identifier: MIT
// A triangle mesh becomes a signed distance grid of two levels (sdf::MeshGrid), which the shape `mesh` reads.
// The surface is the mesh, and where the mesh is open also the sheet on which its winding number is one half: the distance is to both.
#pragma once

#include "model/topology.h"
#include "sdf/program.h"

namespace kiln::model {

struct BakeOptions {
    int resolution = 128;  ///< cells along the longest side of the mesh's box
    bool closed = false;   ///< the user's claim, checked
    int workers = 0;       ///< 0: every core; the answer does not depend on it
};

/// What was made of a mesh, and how inside and outside were told apart.
struct BakeReport {
    Topology topology;
    bool claimed_closed = false;
    size_t bricks = 0;  ///< of 8x8x8 samples, near the surface
    size_t bytes = 0;
    float cell = 0;            ///< in the file's unit
    bool overlapping = false;  ///< some parts lie in others; triangles inside the solid were left out
    size_t cap_triangles = 0;  ///< of the sheet that closes the openings
    /// Of the samples within a cell and a half of the surface, those whose winding number is between 1/4 and 3/4.
    float ambiguous_share = 0;
    /// Every value was divided by this (after the steepest places were made flatter) to be 1-Lipschitz.
    float divisor = 1;

    /// "closed manifold, 69664 triangles" or "winding number: 12 open edges, …; 0.1 % of the samples at the surface ambiguous".
    std::string sentence() const;
};

struct Baked {
    sdf::MeshGrid grid;
    BakeReport report;
};

/// `name` stands in errors. Any thread.
Result<Baked> bake(const Triangles& mesh, const std::string& name, const BakeOptions& options = {});

}  // namespace kiln::model
