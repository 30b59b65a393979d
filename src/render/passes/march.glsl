// SPDX-License-Identifier: MIT
// Primary visibility of the bricks: first hit of each pixel's ray on the trilinear surface. With KILN_LEVELS, of a clipmap's.

layout(local_size_x = kTileGroup, local_size_y = kTileGroup) in;

layout(set = 0, binding = 0, std140) uniform Frame { FrameParams frame; };
layout(set = 0, binding = 1, std430) readonly buffer Cells { uint cells[]; };
layout(set = 0, binding = 2, std430) readonly buffer Rays { FrameRay rays[]; };
layout(set = 0, binding = 3) uniform texture3D distances;
layout(set = 0, binding = 4, rgba32ui) writeonly uniform uimage2D visibility;
layout(set = 0, binding = 5, std430) readonly buffer Tables { uint tables[]; };
layout(set = 0, binding = 6, std430) writeonly buffer Counters { uint evaluations[]; };  // one a workgroup

#ifdef KILN_LEVELS
layout(set = 0, binding = 7, std140) uniform Levels { LevelsParams levels; LevelPlace level_places[kMostLevels]; };
#endif

#include "render/passes/field.glsl"
#include "render/passes/rays.glsl"

shared uint group_evaluations;

void main() {
    if (gl_LocalInvocationIndex == 0u) group_evaluations = 0u;
    barrier();
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (pixel.x < frame.tile_width && pixel.y < frame.tile_height) {
        TexelRay ray = pixel_ray(pixel);
#ifdef KILN_LEVELS
        LevelHit found = level_march(ray, 0.0, kFarVoxels, (frame.flags & kFrameAccelerate) != 0u);
        MarchHit hit = found.hit;
        uint level = uint(max(found.level, 0));
#else
        MarchHit hit = field_march(frame.grid, ray, 0.0, kFarVoxels, (frame.flags & kFrameAccelerate) != 0u);
        const uint level = 0u;
#endif
        uvec4 seen = uvec4(floatBitsToUint(kFarVoxels), kSeenNothing << 28u, 0u, 0u);
        if (hit.state != kMarchMiss) {
            uint state = hit.state == kMarchHit ? kSeenBrick : kSeenInside;
            seen.x = floatBitsToUint(hit.t);
            seen.y = (state << 28u) | (hit.state == kMarchHit ? uint(hit.slot) : 0u);
            seen.z = hit.state == kMarchHit ? uint(hit.voxel.x | (hit.voxel.y << 3) | (hit.voxel.z << 6)) | (level << kSeenLevelShift) : 0u;
        }
        seen.w = uint(min(hit.cells + hit.voxels, 65535)) | (uint(min(hit.voxels, 65535)) << 16u);
        imageStore(visibility, pixel, seen);
        atomicAdd(group_evaluations, uint(hit.voxels));
    }
    barrier();
    if (gl_LocalInvocationIndex == 0u) {
        evaluations[gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x] = group_evaluations;
    }
}
