// SPDX-License-Identifier: MIT
// What holds a triangle mesh together: equal corners become one, equal triangles one, neighbours agree about their outside.
#pragma once

#include "model/triangles.h"

namespace kiln::model {

/// What was found in a mesh, for people. Counts are of the mesh after welding.
struct Topology {
    size_t triangles = 0;
    size_t degenerate_faces = 0;     ///< two corners in one place; left out
    size_t duplicate_faces = 0;      ///< equal to another; opposite ones cancel
    size_t flipped_faces = 0;        ///< turned so that neighbours agree
    size_t open_edges = 0;           ///< with one triangle
    size_t non_manifold_edges = 0;   ///< with three triangles or more
    bool turned_inside_out = false;  ///< the whole mesh faced inwards
    /// Every edge is passed as often forwards as backwards: the winding number is whole everywhere off the surface.
    bool balanced = false;
    /// No open and no non-manifold edges, and balanced.
    bool closed_manifold() const { return balanced && open_edges == 0 && non_manifold_edges == 0; }
};

/// Welds positions that are equal, drops what has no area, and orients. Any thread.
Triangles heal(const Triangles& mesh, Topology& found);

}  // namespace kiln::model
