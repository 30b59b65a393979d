// SPDX-License-Identifier: MIT
// True distances: where the nearest point of a program's surface is, on both sides. The program's own value is only a bound inside
// unions, outside intersections and in blends. Branch and bound over boxes, nearest first: a box in which the value at the centre
// exceeds the half diagonal holds no surface; and a surface point in it is a zero of one of the operands that still matter
// there, so it is no nearer than the least of those operands' own values (all are 1-Lipschitz). A box is drawn in to what of it lies
// in the ball that a better answer must come from. How many boxes that takes where values are a share 1 / L of the distance grows with
// L³ and with the size of the ball over the tolerance: around a planet of noise some hundred thousand, two tenths of a second. Any thread.
#pragma once

#include "sdf/regions.h"

namespace kiln::sdf {

struct Nearest {
    bool found = false;   ///< false: there is no surface, or none within `within`
    double distance = 0;  ///< metres, >= 0, of a real surface point
    double least =
        0;  ///< the true distance is no less than this: above distance − tolerance unless the search was cut short
    dvec3 point;  ///< on the surface
};

/// Nearest surface point to p, no farther than `within` metres. `tolerance` (metres) is how much farther than the nearest one the
/// answer may be.
Nearest nearest_surface(const Regions& regions, dvec3 p, double within, double tolerance);

/// Whether a solid point lies in the box of `half` extents around `center`, turned by `rotation`. Gaps below `tolerance` metres may
/// count as touching, never the other way round.
bool solid_in_box(const Regions& regions, dvec3 center, vec3 half, quat rotation, double tolerance);

}  // namespace kiln::sdf
