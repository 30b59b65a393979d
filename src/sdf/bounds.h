// SPDX-License-Identifier: MIT
// Boxes and Lipschitz factors of shapes and warps, from the host part of their texts. Boxes contain the solid; faces may be infinite.
#pragma once

#include <kiln/edit.h>
#include <kiln/math.h>

namespace kiln::sdf {

/// Solid of a primitive in its own frame.
Box3 shape_bounds(const Shape& shape);
/// Solid after one domain entry, given the solid before it, outside whose box the value is at least rate · distance to the box.
Box3 warp_bounds(const Warp& warp, const Box3& child, float rate);
/// Largest stretch of the entry at the points that it takes into `region`, a box in the child's space: there the child's value divided
/// by this is 1-Lipschitz. Infinite where there is none.
float warp_lipschitz(const Warp& warp, const Box3& region);
/// 1 on the axes along which a point of the space after the entry can see two points of `region`, a box in the child's space.
vec3 second_copies(const Warp& warp, const Box3& region);
/// `box` moved by `transform`, as the smallest axis-aligned box; infinite faces stay infinite on every axis they can reach.
Box3 transformed_box(const Box3& box, const Transform& transform);
/// Smallest scale factor: what a local distance is multiplied by to stay a lower bound.
float smallest_scale(const Transform& transform);
float largest_scale(const Transform& transform);

}  // namespace kiln::sdf
