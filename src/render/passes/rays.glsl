// SPDX-License-Identifier: MIT
// The ray of a pixel of this tile. The including kernel declares first: FrameParams frame, FrameRay rays[].

#include "field/cubic.gpu.h"

vec3 camera_direction(ivec2 pixel) {
    return camera_direction_at(frame.camera, float(pixel.x) + 0.5, float(pixel.y) + 0.5);
}

// World metres of the place t voxels along a ray. Whoever lights what a pixel sees calls this, so that all mean the same point.
vec3 ray_point(TexelRay ray, float t) {
    return (vec3(ray.whole) + (ray.part + ray.direction * t)) * frame.grid.voxel_size;
}
vec3 seen_point(TexelRay ray, uvec4 seen) { return ray_point(ray, uintBitsToFloat(seen.x)); }

TexelRay pixel_ray(ivec2 pixel) {
    if ((frame.flags & kFrameRays) != 0u) {
        FrameRay r = rays[pixel.y * frame.tile_width + pixel.x];
        return texel_ray(ivec3(r.whole_x, r.whole_y, r.whole_z), vec3(r.part_x, r.part_y, r.part_z),
                         vec3(r.direction_x, r.direction_y, r.direction_z));
    }
    return texel_ray(ivec3(frame.eye_x, frame.eye_y, frame.eye_z), vec3(frame.eye_part_x, frame.eye_part_y, frame.eye_part_z),
                     camera_direction(pixel + ivec2(frame.tile_x, frame.tile_y)));
}

// Metres from the eye to where a ray starts: 0 for the camera's.
vec3 ray_origin(TexelRay ray) {
    return (vec3(ray.whole - ivec3(frame.eye_x, frame.eye_y, frame.eye_z)) + (ray.part - vec3(frame.eye_part_x, frame.eye_part_y, frame.eye_part_z))) * frame.grid.voxel_size;
}
