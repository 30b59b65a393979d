// SPDX-License-Identifier: MIT
// Meshes of the surface that bricks hold. Both are closed manifolds wherever the bricks around the surface exist, and open at the
// border of a region; the bytes do not depend on the number of workers. Solid is value <= 0. Any thread, one Mesh each.
#pragma once

#include "field/mesh.h"

#include "sdf/eval.h"

#include <functional>

namespace kiln::field {

/// Marching cubes: a vertex on each crossed lattice edge, where the stored values vanish linearly. A pure function of the edge's two
/// texels and its place, so two regions that share a face have the same vertices on it, bit for bit.
void mesh_smooth(const MeshBricks& bricks, Mesh& out, int workers = 0);

}  // namespace kiln::field
