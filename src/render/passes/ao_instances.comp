#version 460
// SPDX-License-Identifier: MIT
// Closes the rays of ambient occlusion that meet an instance: each goes down the tree as a hard shadow does. A pixel's rays follow one another in one
// loop, as in ao.glsl.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#include "render/passes/frame.gpu.h"
#include "render/passes/instances.gpu.h"
#include "render/passes/ao.gpu.h"

layout(local_size_x = kTileGroup, local_size_y = kTileGroup) in;

layout(set = 0, binding = 0, std140) uniform Frame { FrameParams frame; };
layout(set = 0, binding = 1, rgba32ui) readonly uniform uimage2D instance_ways;
layout(set = 0, binding = 2, rgba32ui) readonly uniform uimage2D instance_nodes;
layout(set = 0, binding = 3, std430) readonly buffer Cells { uint instance_cells[]; };
layout(set = 0, binding = 4, std430) readonly buffer Rays { FrameRay rays[]; };
layout(set = 0, binding = 5, std430) readonly buffer Tables { uint tables[]; };
layout(set = 0, binding = 6) uniform texture3D distances;
layout(set = 0, binding = 7) uniform utexture2D visibility;
layout(set = 0, binding = 8) uniform utexture2D points_before;
layout(set = 0, binding = 9, rgba32ui) writeonly uniform uimage2D ao_points;
layout(push_constant) uniform Push { AoPush push; };

#define KILN_INSTANCE_WALK
#include "render/passes/instances.glsl"
#include "render/passes/rays.glsl"
#include "render/passes/surface.glsl"
#include "render/passes/ao_rays.glsl"

void main() {
    ao_make_directions();
    ivec2 texel = ivec2(gl_GlobalInvocationID.xy);
    if (texel.x * int(push.every) >= frame.tile_width || texel.y * int(push.every) >= frame.tile_height) return;
    uvec4 point = texelFetch(points_before, texel, 0);
    if ((point.x & kAoOpen) == 0u) {
        imageStore(ao_points, texel, point);
        return;
    }
    ivec2 pixel = ao_pixel(texel);
    uvec4 seen = texelFetch(visibility, pixel, 0);
    uint state = seen.y >> 28u;
    TexelRay ray = pixel_ray(pixel);
    float t = uintBitsToFloat(seen.x);
    float voxel = state == kSeenBrick ? float(1u << (seen.z >> kSeenLevelShift)) : 1.0;
    if (state == kSeenInstance) voxel = 1.0 / instance_voxels(seen.y & 0x0fffffffu);
    vec3 normal = unpack_unit(point.y);
    vec3 surface = from_eye(ray) + ray.direction * t;
    float off = ao_offset(state, voxel, t);
    uint left = point.x & kAoOpen;
    int number = findLSB(left);
    vec3 direction = ao_direction(texel, uint(number), normal);
    float first = ao_first(direction, normal, off, voxel);
    vec3 p = surface + normal * (off - first * dot(direction, normal));
    vec3 inverse = walk_inverse(direction);
    uint at = 0u;
    float enters = 0.0;
    int looks = 0;
    InstanceNode leaf = node_at(0u);
    while (left != 0u) {
        // To the next object in whose turned box the ray comes, since marches cost most, and rays in step wait for each other.
        InstanceRecord instance;
        TexelRay local;
        float begin = 0.0;
        float end = 0.0;
        bool meets = false;
        bool ends = false;
        do {
            uint found = next_in_tree(at, p, direction, inverse, 0.0, kFarVoxels, leaf, enters, looks);
            ends = found == kNoInstance;
            if (!ends) {
                instance = instance_at(found);
                local = object_ray(instance, p, direction);
                begin = first;
                end = kFarVoxels;
                set_span(local, 0.0, begin, end);
                meets = begin <= end;
            }
        } while (!ends && !meets);
        if (meets && field_march(here.grid, local, begin, end, true).state != kMarchMiss) {
            point.x &= ~(1u << number);
            ends = true;
        }
        if (ends) {
            left &= left - 1u;
            number = max(findLSB(left), 0);
            direction = ao_direction(texel, uint(number), normal);
            first = ao_first(direction, normal, off, voxel);
            p = surface + normal * (off - first * dot(direction, normal));
            inverse = walk_inverse(direction);
            at = 0u;
        }
    }
    imageStore(ao_points, texel, point);
}
