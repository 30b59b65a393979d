// SPDX-License-Identifier: MIT
// Where a ray goes on inside glass that it meets. The including kernel has instance_rays.glsl.

#include "render/lib/glass.gpu.h"

const float kOffVoxels = 0.02;  // of the object: rays start as far off its surface

// Normals of bricks may look away from the ray by a little at the rim.
vec3 towards(vec3 n, vec3 d) {
    float away = dot(n, d);
    return away > -1e-3 ? normalize(n - d * (away + 1e-3)) : n;
}

// A ray that starts at `at`, counted from the eye in finest voxels.
FrameRay frame_ray(vec3 at, vec3 direction, float within) {
    vec3 part = vec3(frame.eye_part_x, frame.eye_part_y, frame.eye_part_z) + at;
    ivec3 whole = ivec3(floor(part));
    part -= vec3(whole);
    return FrameRay(frame.eye_x + whole.x, frame.eye_y + whole.y, frame.eye_z + whole.z, within, part.x, part.y, part.z, 0.0, direction.x, direction.y, direction.z, 0.0);
}

// One that meets nothing: from above everything, upwards.
FrameRay resting_ray() {
    return FrameRay(frame.eye_x, (frame.grid.cell_y + frame.grid.size_y) * kBrickVoxels + 64, frame.eye_z, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0);
}
