// SPDX-License-Identifier: MIT
// Rays of ambient occlusion. The including kernel includes ao.gpu.h and declares first: FrameParams frame, AoPush push.

#include "render/passes/shadow_offset.glsl"

// The pixel whose point a texel of the rays' image is about.
ivec2 ao_pixel(ivec2 texel) { return min(texel * int(push.every), ivec2(frame.tile_width, frame.tile_height) - 1); }

// How far off a surface found at t its rays start, finest voxels. Half of what shadows take, and no pixel: the flattest ray climbs faster than theirs may,
// and from higher up more is hidden by what stands near.
float ao_offset(uint state, float voxel, float t) { return 0.5 * (state == kSeenOutside ? shadow_offset(state, voxel, t) : voxel); }

const float kAoFirst = 1.0;  // voxels from the surface to the first look, at most

// Where a ray from the surface is looked at first: as far off its plane as `off`. A flat one, which would go far to get there, begins raised by what
// is missing; if all began so high, all would see more of what stands near than the surface does.
float ao_first(vec3 direction, vec3 normal, float off, float voxel) {
    return min(off / max(dot(direction, normal), 1e-3), kAoFirst * voxel);
}

vec3 ao_direction(ivec2 texel, uint ray, vec3 normal) {
    vec3 d = ao_local_direction(ao_number(texel.x, texel.y, push.picture, push.rays, ray), push.rays);
    Basis basis = basis_around(normal);
    return basis.tangent * d.x + basis.bitangent * d.y + normal * d.z;
}
