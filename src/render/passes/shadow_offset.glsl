// SPDX-License-Identifier: MIT
// Where rays that leave a surface start, for shadows and for light from all around. The including kernel declares first: FrameParams frame.

#ifndef KILN_SHADOW_OFFSET_GLSL
#define KILN_SHADOW_OFFSET_GLSL

// How far off a surface found at t its shadow rays start, finest voxels: a voxel of what it was found in; a pixel, where pixels are larger.
float shadow_offset(uint state, float voxel, float t) {
    float off = max(voxel, 1.5 * frame.pixel_angle * t);
    // What bricks hold is exact to a voxel: farther would leave small hollows.
    return state != kSeenOutside ? min(off, 2.0 * voxel) : off;
}

#endif
