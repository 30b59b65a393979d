// SPDX-License-Identifier: MIT
// The reference for rays through bricks: double precision, every cell and every voxel, roots by bisection between the points where
// the derivative vanishes. Shares no arithmetic with cubic.gpu.h. Slow; for tests and gates G1 to G3.
#pragma once

#include "field/host_bricks.h"

namespace kiln::field {

struct ReferenceHit {
    int state = kMarchMiss;
    double t = 0;  ///< voxels along the ray
    /// Least |value| (voxels) where the value along the ray stops falling: before the hit, and once more after it. Near 0 the ray is
    /// tangent, and hit or miss is a matter of rounding.
    double least = 1e30;
    /// How fast the value falls at the hit, per voxel of t; where the ray is in solid as it enters the grid, its speed through that face.
    /// What is off by e along the ray is off by slope · e across the surface.
    double slope = 1;
};

ReferenceHit reference_ray(const HostBricks& bricks, const TexelRay& ray, double t_max);

}  // namespace kiln::field
