// SPDX-License-Identifier: MIT
// Rays and points of a frame in the voxels of an instance's object. The including kernel declares first: FrameParams frame.

#include "field/cubic.gpu.h"

// The set at hand.
InstanceSet here;

// From the eye to where a ray starts, in finest voxels: 0 for the camera's.
vec3 from_eye(TexelRay ray) {
    return vec3(ray.whole - ivec3(frame.eye_x, frame.eye_y, frame.eye_z)) + (ray.part - vec3(frame.eye_part_x, frame.eye_part_y, frame.eye_part_z));
}

vec3 into_object(InstanceRecord i, vec3 v) { return vec3(dot(i.x.xyz, v), dot(i.y.xyz, v), dot(i.z.xyz, v)); }
vec3 out_of_object(InstanceRecord i, vec3 v) { return i.x.xyz * v.x + i.y.xyz * v.y + i.z.xyz * v.z; }

// A ray that starts at `from` (finest voxels from the eye), in the object's voxels: t there is i.voxels times t here.
TexelRay object_ray(InstanceRecord i, vec3 from, vec3 direction) {
    vec3 part = vec3(i.x.w, i.y.w, i.z.w) + into_object(i, from) * i.voxels;
    vec3 whole = floor(part);
    return texel_ray(ivec3(i.eye_x, i.eye_y, i.eye_z) + ivec3(whole), part - whole, into_object(i, direction));
}

// A ray's point at t, in voxels from the object's origin: as exact as floats near `texel` are.
vec3 brick_point(BrickRay ray, ivec3 texel, float t) {
    float s = t - ray.t_base;
    return vec3(texel) + vec3(ray_coordinate(0.0, ray.high.x, ray.low.x, ray.lead.x, ray.rest.x, s),
                              ray_coordinate(0.0, ray.high.y, ray.low.y, ray.lead.y, ray.rest.y, s),
                              ray_coordinate(0.0, ray.high.z, ray.low.z, ray.lead.z, ray.rest.z, s));
}
