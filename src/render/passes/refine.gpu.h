// SPDX-License-Identifier: MIT
// Where a surface of the exact program is along a ray, from a place found in bricks: a few looks at the program, in steps that the
// refine kernel and its twin on the host share. Distances and places along the ray are in voxels.

#ifdef __cplusplus
#pragma once
#endif
#include "math/math.gpu.h"
#ifdef __cplusplus
namespace kiln::render {
using namespace kiln::gpu;
#endif

// Looks at most, before the one at the place found.
KILN_CONST int kRefineSteps = 16;
// What may be left of the distance there; and how far a place may move before it is another surface's.
KILN_CONST float kRefinedVoxels = 0.01f;
KILN_CONST float kRefineReachVoxels = 6.0f;
KILN_CONST float kRefineMostVoxels = 6.1f;  // … rounding included
// Word of a point that stays where it is.
KILN_CONST uint kNotRefined = 0xffffffffu;

// The place to look at next, d being the distance at t: a step that never passes the surface, then the secant's.
KILN_FN float refine_next(int step, float t_before, float d_before, float t, float d) {
    float moved = t - t_before;
    float slope = step > 0 && abs(moved) > 1e-5f ? min((d - d_before) / moved, -0.02f) : -1.0f;
    return t - clamp(d / slope, -1.5f, 1.5f);
}

KILN_FN bool refine_holds(float t_first, float t, float d) {
    return abs(d) <= kRefinedVoxels && abs(t - t_first) <= kRefineReachVoxels;
}

// A distance, voxels, that is as good as none for a coordinate of that size, metres: no more looks.
KILN_FN float refine_enough(float voxel_size, float coordinate) { return max(2e-4f, 5e-7f * coordinate / voxel_size); }

// Metres between the point and each sample of a central difference: a tenth of a voxel, but never so little that the rounding of a
// coordinate of that size shows.
KILN_FN float refine_gradient_step(float voxel_size, float coordinate) {
    return max(0.1f * voxel_size, 3e-4f * coordinate);
}

// Slope along an axis, over two steps, from the distances a step up, a step down and at the place. Where materials meet at a crease, one of
// the samples may lie beyond it: what is heaviest there is another material. The other side alone then says how the surface lies that
// the place is on; a mean of both would be a sliver of, say, water that stands on end.
KILN_FN float refine_slope(float up, float down, float here, bool up_is_other, bool down_is_other) {
    if (up_is_other == down_is_other) return up - down;
    return 2.0f * (up_is_other ? here - down : up - here);
}

#ifdef __cplusplus
}  // namespace kiln::render
#endif
