// SPDX-License-Identifier: MIT
// Fewer triangles for the same surface.
#pragma once

#include <kiln/math.h>

#include <cstdint>
#include <span>
#include <vector>

namespace kiln::field {

/// Collapses edges until `share` of the triangles is left, or until the next collapse would move the surface by more than `error`
/// metres (root mean square over the planes of the triangles that the corner which goes stands for). Vertices keep their places; some are no longer
/// used. `parts`, a number by triangle, goes with the triangles, and borders between parts are kept like creases. A closed
/// manifold stays one, open edges stay as they are.
void simplify(std::span<const vec3> positions, std::vector<uint32_t>& triangles, std::vector<uint32_t>& parts,
              float share, float error);

}  // namespace kiln::field
