// SPDX-License-Identifier: MIT
// Jumps of empty cells: how many cells a ray may skip. A pure function of which cells own bricks.
#pragma once

#include "field/brick.gpu.h"

#include <cstdint>
#include <span>

namespace kiln::field {

/// Box of cells, [min, max), counted from the grid's first.
struct CellBox {
    ivec3 min, max;
    bool empty() const { return min.x >= max.x || min.y >= max.y || min.z >= max.z; }
};

/// Cells of `box` grown by `by` and cut to the grid.
CellBox grown(const CellBox& box, int by, ivec3 grid_size);

/// Rewrites the jump of every empty cell in `box`: the Chebyshev distance to the nearest occupied cell of the whole grid, at most
/// kMaxJump (also where there is none). All cells of such a cube around an empty cell but its shell are empty; neighbouring empty
/// cells share a face of texels, on which every value is at least a voxel from 0, and no two neighbouring texels differ by
/// two voxels: so they all have one sign.
void update_jumps(std::span<uint32_t> cells, ivec3 grid_size, const CellBox& box, int workers);

}  // namespace kiln::field
