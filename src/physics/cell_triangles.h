// SPDX-License-Identifier: MIT
// Triangles of a field in a box, made when they are asked for: marching cubes of the voxels that the box meets. For what knows bodies as
// triangles only.
#pragma once

#include "field/sdf_field.h"

#include <vector>

namespace kiln::physics {

/// Three corners a triangle, anticlockwise as seen from the empty side. Where the surface is far, nothing is asked but how far.
void triangles_in(const field::SdfField& field, float voxel_size, const Box3& box, std::vector<vec3>& out);

}  // namespace kiln::physics
