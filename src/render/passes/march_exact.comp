#version 460
// SPDX-License-Identifier: MIT
// Primary visibility of exact programs: of what leaves the grid, beside the hits that march found in the bricks; or, with the
// analytic switch, of the cells' pruned programs, or of the whole program, instead of them.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#include "render/passes/frame.gpu.h"

layout(local_size_x = kTileGroup, local_size_y = kTileGroup) in;

layout(set = 0, binding = 0, std140) uniform Frame { FrameParams frame; };
layout(set = 0, binding = 1, std430) readonly buffer Cells { uint cells[]; };
layout(set = 0, binding = 2, std430) readonly buffer Records { BrickRecord records[]; };
layout(set = 0, binding = 3, std430) readonly buffer Code { uvec2 code[]; };
layout(set = 0, binding = 4, std430) readonly buffer ProgramCode { uvec2 program_code[]; };
layout(set = 0, binding = 5, std430) readonly buffer Numbers { float numbers[]; };
layout(set = 0, binding = 6, std430) readonly buffer Rays { FrameRay rays[]; };
layout(set = 0, binding = 7) uniform utexture2D seen;  // from march; not read when analytic
layout(set = 0, binding = 8, rgba32ui) writeonly uniform uimage2D visibility;
layout(set = 0, binding = 9, std430) writeonly buffer Counters { uint evaluations[]; };  // one a workgroup

#include "render/passes/map.glsl"
#include "render/passes/rays.glsl"
#include "render/passes/tape_buffers.glsl"
#include "render/passes/exact.glsl"

shared uint group_evaluations;

void main() {
    if (gl_LocalInvocationIndex == 0u) group_evaluations = 0u;
    barrier();
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (pixel.x < frame.tile_width && pixel.y < frame.tile_height) {
        bool analytic = (frame.flags & kFrameAnalytic) != 0u;
        uvec4 before = uvec4(floatBitsToUint(kFarVoxels), kSeenNothing << 28u, 0u, 0u);
        if (!analytic) before = texelFetch(seen, pixel, 0);
        float t_end = uintBitsToFloat(before.x);
        ExactHit hit = exact_march(pixel_ray(pixel), t_end, analytic, (frame.flags & kFrameAccelerate) != 0u);
        uvec4 seen_now = before;
        if (hit.state != kSeenNothing) {
            seen_now.x = floatBitsToUint(hit.t);
            seen_now.y = (hit.state << 28u) | uint(hit.slot);
            seen_now.z = 0u;
        }
        uint steps = min((before.w & 0xffffu) + uint(hit.steps), 65535u);
        seen_now.w = steps | (min((before.w >> 16u) + uint(hit.steps), 65535u) << 16u);
        imageStore(visibility, pixel, seen_now);
        atomicAdd(group_evaluations, uint(hit.steps));
    }
    barrier();
    if (gl_LocalInvocationIndex == 0u) {
        evaluations[gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x] = group_evaluations;
    }
}
