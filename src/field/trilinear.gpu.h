// SPDX-License-Identifier: MIT
// Arithmetic of one voxel: eight corner values, the trilinear polynomial through them, and the blend of the gradients of
// the eight voxels around a point (the "dual voxel"), which makes normals continuous across voxels (Hansson-Söderlund,
// Evans and Akenine-Möller, "Ray Tracing of Signed Distance Function Grids", JCGT 2022).
// Positions are in voxels; values are whatever the texels hold.

#ifndef KILN_FIELD_TRILINEAR_GPU_H
#define KILN_FIELD_TRILINEAR_GPU_H

#include "field/words.gpu.h"

KILN_FIELD_BEGIN

// vXYZ is the value at corner (X, Y, Z) of the voxel.
struct Corners {
    float v000, v100, v010, v110, v001, v101, v011, v111;
};

// a at t = 0 and b at t = 1, exactly.
KILN_FN float lerp_exact(float a, float b, float t) { return a * (1.0f - t) + b * t; }

// Value at p in [0, 1]³; between the least and the greatest corner.
KILN_FN float trilinear_value(Corners c, vec3 p) {
    float low = lerp_exact(lerp_exact(c.v000, c.v100, p.x), lerp_exact(c.v010, c.v110, p.x), p.y);
    float high = lerp_exact(lerp_exact(c.v001, c.v101, p.x), lerp_exact(c.v011, c.v111, p.x), p.y);
    return lerp_exact(low, high, p.z);
}

// Gradient at p, per voxel. Also outside the voxel, where the polynomial goes on.
KILN_FN vec3 trilinear_gradient(Corners c, vec3 p) {
    float x = lerp_exact(lerp_exact(c.v100 - c.v000, c.v110 - c.v010, p.y),
                         lerp_exact(c.v101 - c.v001, c.v111 - c.v011, p.y), p.z);
    float y = lerp_exact(lerp_exact(c.v010 - c.v000, c.v110 - c.v100, p.x),
                         lerp_exact(c.v011 - c.v001, c.v111 - c.v101, p.x), p.z);
    float z = lerp_exact(lerp_exact(c.v001 - c.v000, c.v101 - c.v100, p.x),
                         lerp_exact(c.v011 - c.v010, c.v111 - c.v110, p.x), p.y);
    return vec3(x, y, z);
}

// First of the two voxels that the dual voxel spans along one axis, for a position p there.
KILN_FN int dual_first(float p) { return int(floor(p - 0.5f)); }

// Weights of the three texels from dual_first(p) on. The blend of both voxels' polynomials has, per axis, these weights
// for values and those of dual_slope for derivatives, so where all 27 texels exist
//     gradient.x = sum over i, j, k of slope_x[i] * value_y[j] * value_z[k] * texel[i][j][k].
// s = p - first is in [1/2, 3/2]; the second voxel's share is s - 1/2.
KILN_FN vec3 dual_value(float s) {
    float share = s - 0.5f;
    return vec3((1.0f - share) * (1.0f - s), (1.0f - share) * s + share * (2.0f - s), share * (s - 1.0f));
}
KILN_FN vec3 dual_slope(float s) {
    float share = s - 0.5f;
    return vec3(share - 1.0f, 1.0f - 2.0f * share, share);
}

KILN_FIELD_END

#endif
