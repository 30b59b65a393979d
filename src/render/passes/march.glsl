// SPDX-License-Identifier: MIT
// Primary visibility of the bricks: first hit of each pixel's ray on the trilinear surface. With KILN_LEVELS, of a clipmap's;
// with KILN_INSTANCES, of instances too.

#include "field/levels.gpu.h"
#include "render/passes/mesh.gpu.h"

layout(local_size_x = kTileGroup, local_size_y = kTileGroup) in;

layout(set = 0, binding = 0, std140) uniform Frame { FrameParams frame; };
layout(set = 0, binding = 1, std430) readonly buffer Cells { uint cells[]; };
layout(set = 0, binding = 2, std430) readonly buffer Rays { FrameRay rays[]; };
layout(set = 0, binding = 3) uniform texture3D distances;
layout(set = 0, binding = 4, rgba32ui) writeonly uniform uimage2D visibility;
layout(set = 0, binding = 5, std430) readonly buffer Tables { uint tables[]; };
layout(set = 0, binding = 6, std430) writeonly buffer Counters { uint evaluations[]; };  // one a workgroup

layout(set = 0, binding = 7) uniform texture2D mesh_depth;  // not read without kFrameRayEnds

#ifdef KILN_LEVELS
layout(set = 0, binding = 8, std140) uniform Levels { LevelsParams levels; LevelPlace level_places[kMostLevels]; };
#define KILN_NEXT_BINDING 9
#else
#define KILN_NEXT_BINDING 8
#endif

#ifdef KILN_INSTANCES
layout(set = 0, binding = KILN_NEXT_BINDING, rgba32ui) readonly uniform uimage2D instance_ways;
layout(set = 0, binding = KILN_NEXT_BINDING + 1, rgba32ui) readonly uniform uimage2D instance_nodes;
layout(set = 0, binding = KILN_NEXT_BINDING + 2, std430) readonly buffer InstanceCells { uint instance_cells[]; };
layout(push_constant) uniform Push { InstancePush push; };
#endif

#include "render/passes/field.glsl"
#include "render/passes/rays.glsl"

LevelHit world_march(TexelRay ray, float t_min, float t_max, bool accelerate) {
#ifdef KILN_LEVELS
    return level_march(ray, t_min, t_max, accelerate);
#else
    return LevelHit(field_march(frame.grid, ray, t_min, t_max, accelerate), 0);
#endif
}

#ifdef KILN_INSTANCES
#include "render/passes/march_sets.glsl"
#endif

#include "render/passes/ray_end.glsl"

shared uint group_evaluations;

void main() {
    if (gl_LocalInvocationIndex == 0u) group_evaluations = 0u;
    barrier();
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    bool has_ray = pixel.x < frame.tile_width && pixel.y < frame.tile_height;
#ifdef KILN_INSTANCES
    TexelRay ray = pixel_ray(min(pixel, ivec2(frame.tile_width, frame.tile_height) - 1));
    vec3 from = from_eye(ray);
    make_list(has_ray, from, ray.direction, (frame.flags & kFrameRays) == 0u);
#endif
    if (has_ray) {
#ifndef KILN_INSTANCES
        TexelRay ray = pixel_ray(pixel);
#endif
        bool accelerate = (frame.flags & kFrameAccelerate) != 0u;
        float t_last = ray_end(pixel, ray.direction);
#ifdef KILN_INSTANCES
        // The world up to the first box of an instance; the instances; the world behind that box, up to what was found there. So neither
        // looks at voxels that the other hides.
        vec3 inverse = walk_inverse(ray.direction);
        int boxes = 0;
        float first_box = first_box_of(from, inverse, boxes);
        SetHit beside = SetHit(kFarVoxels, kNoInstance, no_hit(), 0, 0);
        LevelHit found = LevelHit(no_hit(), -1);
        int cells = boxes;
        int voxels = 0;
        float t_begin = 0.0;
        float t_end = min(first_box, t_last);
        for (int part = 0; part < 2; ++part) {
            found = world_march(ray, t_begin, t_end, accelerate);
            cells += found.hit.cells;
            voxels += found.hit.voxels;
            if (part == 1 || first_box >= t_last || found.hit.state == kMarchHit || found.hit.state == kMarchInside) break;
            beside = march_sets(ray, from, inverse, t_last, accelerate);
            cells += beside.cells;
            voxels += beside.voxels;
            t_begin = first_box;
            // A little beyond, so that of equals the world is seen.
            t_end = min(beside.t * 1.000001, kFarVoxels);
        }
        MarchHit hit = found.hit;
        hit.cells = cells;
        hit.voxels = voxels;
        bool is_set = beside.instance != kNoInstance && !((hit.state == kMarchHit || hit.state == kMarchInside) && hit.t <= beside.t);
#else
        LevelHit found = world_march(ray, 0.0, t_last, accelerate);
        MarchHit hit = found.hit;
        const bool is_set = false;
#endif
        uint level = uint(max(found.level, 0));
        // Where nothing was found, whoever marches on ends there too.
        uvec4 seen = uvec4(floatBitsToUint(t_last), kSeenNothing << 28u, 0u, 0u);
        if (!is_set && hit.state != kMarchMiss) {
            uint state = hit.state == kMarchHit ? kSeenBrick : kSeenInside;
            seen.x = floatBitsToUint(hit.t);
            seen.y = (state << 28u) | (hit.state == kMarchHit ? uint(hit.slot) : 0u);
            seen.z = hit.state == kMarchHit ? uint(hit.voxel.x | (hit.voxel.y << 3) | (hit.voxel.z << 6)) | (level << kSeenLevelShift) : 0u;
        }
#ifdef KILN_INSTANCES
        if (is_set) {
            bool inside = beside.hit.state != kMarchHit;
            seen.x = floatBitsToUint(beside.t);
            seen.y = inside ? kSeenInside << 28u : (kSeenInstance << 28u) | beside.instance;
            seen.z = inside ? 0u : uint(beside.hit.voxel.x | (beside.hit.voxel.y << 3) | (beside.hit.voxel.z << 6)) | (uint(beside.hit.slot) << kInstanceSlotShift);
        }
#endif
        seen.w = uint(min(hit.cells + hit.voxels, 65535)) | (uint(min(hit.voxels, 65535)) << 16u);
        imageStore(visibility, pixel, seen);
        atomicAdd(group_evaluations, uint(hit.voxels));
    }
    barrier();
    if (gl_LocalInvocationIndex == 0u) {
        uint counted = group_evaluations;
#ifdef KILN_INSTANCES
        if (list_count > kMostListed) counted |= kWalkedTree;
#endif
        evaluations[gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x] = counted;
    }
}
