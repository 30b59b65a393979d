#version 460
// SPDX-License-Identifier: MIT
// Glass along rays, where it is nearer than what was found before: the ray goes down its tree and into each object's bricks. Of equals the lower
// number. An eye inside glass sees out of it unbent; a ray that came in by its surface meets that from inside.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#include "render/passes/frame.gpu.h"
#include "render/passes/glass.gpu.h"
#include "render/passes/instances.gpu.h"

layout(local_size_x = kTileGroup, local_size_y = kTileGroup) in;

layout(set = 0, binding = 0, std140) uniform Frame { FrameParams frame; };
layout(set = 0, binding = 1, rgba32ui) readonly uniform uimage2D instance_ways;
layout(set = 0, binding = 2, rgba32ui) readonly uniform uimage2D instance_nodes;  // of glass
layout(set = 0, binding = 3, std430) readonly buffer Cells { uint instance_cells[]; };
layout(set = 0, binding = 4, std430) readonly buffer Rays { FrameRay rays[]; };
layout(set = 0, binding = 5, std430) readonly buffer Tables { uint tables[]; };
layout(set = 0, binding = 6) uniform texture3D distances;
layout(set = 0, binding = 7) uniform utexture2D seen_before;
layout(set = 0, binding = 8, rgba32ui) writeonly uniform uimage2D visibility;
layout(push_constant) uniform Push { InstancePush push; };

// A ray that starts inside has the surface it came by behind it, by less than the bricks' own error.
const float kPastVoxels = 0.25;

#define KILN_INSTANCE_WALK
#define KILN_FROM_INSIDE
#include "render/passes/instances.glsl"
#include "render/passes/rays.glsl"

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (pixel.x >= frame.tile_width || pixel.y >= frame.tile_height) return;
    uvec4 seen = texelFetch(seen_before, pixel, 0);
    TexelRay ray = pixel_ray(pixel);
    vec3 from = from_eye(ray);
    float within = (frame.flags & kFrameRays) != 0u ? rays[pixel.y * frame.tile_width + pixel.x].within : 0.0;
    if (within > 0.0) {
        uint index = uint(within) - 1u;
        InstanceRecord instance = instance_at(index);
        MarchHit hit = field_march(here.grid, object_ray(instance, from, ray.direction), kPastVoxels, kFarVoxels, true);
        float t = hit.state == kMarchMiss ? 0.0 : hit.t / instance.voxels;
        if (t < uintBitsToFloat(seen.x)) {
            seen.x = floatBitsToUint(t);
            seen.y = ((hit.state == kMarchHit ? kSeenInstance : kSeenGlassLeft) << 28u) | index;
            seen.z = uint(hit.voxel.x | (hit.voxel.y << 3) | (hit.voxel.z << 6)) | (uint(hit.slot) << kInstanceSlotShift);
        }
        imageStore(visibility, pixel, seen);
        return;
    }
    inside_out = false;
    vec3 inverse = walk_inverse(ray.direction);
    float nearest = uintBitsToFloat(seen.x);
    uint nearest_instance = kNoInstance;
    uint at = 0u;
    while (at < push.node_count) {
        // To the next leaf first, so that rays that are in step march together.
        uint found = kNoInstance;
        while (at < push.node_count && found == kNoInstance) {
            InstanceNode node = node_at(at);
            bool meets = walk_meets(node, from, inverse, nearest);
            at = meets ? at + 1u : node.skip;
            if (meets) found = node.instance;
        }
        if (found == kNoInstance) break;
        InstanceRecord instance = instance_at(found);
        // A little beyond the nearest, so that of equals the lower number is found.
        float t_end = nearest < kFarVoxels ? nearest * instance.voxels * 1.000001 : kFarVoxels;
        MarchHit hit = field_march(here.grid, object_ray(instance, from, ray.direction), 0.0, t_end, true);
        if (hit.state != kMarchHit || hit.t <= 0.0) continue;
        float t = hit.t / instance.voxels;
        if (t < nearest || (t == nearest && found < nearest_instance && nearest_instance != kNoInstance)) {
            nearest = t;
            nearest_instance = found;
            seen.x = floatBitsToUint(t);
            seen.y = (kSeenInstance << 28u) | found;
            seen.z = uint(hit.voxel.x | (hit.voxel.y << 3) | (hit.voxel.z << 6)) | (uint(hit.slot) << kInstanceSlotShift);
        }
    }
    imageStore(visibility, pixel, seen);
}
