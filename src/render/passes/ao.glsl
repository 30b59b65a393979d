// SPDX-License-Identifier: MIT
// Which rays over the hemisphere of each visible point the world's field leaves open: the first of the passes of ao.cpp. Steps are of
// sphere tracing in bricks and empty cells, a little longer than what is proven near a surface: what is thinner than half a voxel may be missed.
// A pixel's rays follow one another in one loop, so that those in step wait for each other once and not at every ray's end.

#include "render/passes/ao.gpu.h"

layout(local_size_x = kTileGroup, local_size_y = kTileGroup) in;

layout(set = 0, binding = 0, std140) uniform Frame { FrameParams frame; };
layout(set = 0, binding = 1, std430) readonly buffer Cells { uint cells[]; };
layout(set = 0, binding = 2, std430) readonly buffer Rays { FrameRay rays[]; };
layout(set = 0, binding = 3) uniform texture3D distances;
layout(set = 0, binding = 4) uniform sampler distance_sampler;
layout(set = 0, binding = 5) uniform utexture2D visibility;
layout(set = 0, binding = 6) uniform utexture2D surface_words;
layout(set = 0, binding = 7, rgba32ui) writeonly uniform uimage2D ao_points;
layout(set = 0, binding = 8, std430) writeonly buffer Counters { uint evaluations[]; };  // one a workgroup
#ifdef KILN_EXACT
layout(set = 0, binding = 9, std430) readonly buffer Records { BrickRecord records[]; };
layout(set = 0, binding = 10, std430) readonly buffer Code { uvec2 code[]; };
layout(set = 0, binding = 11, std430) readonly buffer ProgramCode { uvec2 program_code[]; };
layout(set = 0, binding = 12, std430) readonly buffer Numbers { float numbers[]; };
#endif
#ifdef KILN_LEVELS
#ifdef KILN_EXACT
const uint kLevelsBinding = 13u;
#else
const uint kLevelsBinding = 9u;
#endif
layout(set = 0, binding = kLevelsBinding, std140) uniform Levels { LevelsParams levels; LevelPlace level_places[kMostLevels]; };
#endif
layout(push_constant) uniform Push { AoPush push; };
// False: code is only asked for horizons, no ray marches along it.
layout(constant_id = 5) const bool kAlongCode = true;

#ifdef KILN_LEVELS
#include "render/passes/level_map.glsl"
#endif
#include "render/passes/map.glsl"
#include "render/passes/rays.glsl"
#include "render/passes/surface.glsl"
#include "render/passes/grid_stretch.glsl"
#ifdef KILN_EXACT
#include "render/passes/tape_buffers.glsl"
#include "render/passes/code_of.glsl"
#endif
#include "render/passes/shadow_bricks.glsl"
#include "render/passes/shadow_field.glsl"
#include "render/passes/ao_rays.glsl"

const int kAoSteps = 128;          // of one ray; beyond, it is open
const float kAoShortest = 0.5;     // voxels: the least step
const float kAoTrusted = 0.75;     // share of a distance near a surface that a step takes

shared uint group_evaluations;

// How far a ray goes, voxels: to where the grid ends, and farther where code describes what is beyond.
float ao_reach(vec3 p, vec3 direction) {
    float t_in;
    float t_out;
    grid_stretch(texel_ray(shadow_whole, p, direction), t_in, t_out);
    bool concave = (frame.flags & (kFrameOutsideConcave | kFrameUnpruned)) == kFrameOutsideConcave;
    bool beyond = (frame.outside_count != 0u && !concave) || (frame.flags & kFrameUnpruned) != 0u;
    vec3 size = vec3(frame.grid.size_x, frame.grid.size_y, frame.grid.size_z) * float(kBrickVoxels);
    float reach = max(t_out, 0.0) + 1.0;
    if (!beyond) return reach;
    float beyond_in;
    float beyond_out;
    outside_stretch(texel_ray(shadow_whole, p, direction), beyond_in, beyond_out);
    if ((frame.flags & kFrameUnpruned) != 0u) beyond_out = kFarVoxels;
    return clamp(beyond_out, reach, max(t_out, 0.0) + 16.0 * length(size));
}

#ifdef KILN_EXACT
// Half-spaces that leave the grid hide what is below their horizon.
bool above_horizon(vec3 p, vec3 direction) {
    return code_distance(code_of(kSeenOutside, 0), (vec3(shadow_whole) + p + direction * 1e5) * frame.grid.voxel_size) > 0.0;
}
#endif

void main() {
    if (gl_LocalInvocationIndex == 0u) group_evaluations = 0u;
    ao_make_directions();
    ivec2 texel = ivec2(gl_GlobalInvocationID.xy);
    uint looks = 0u;
    if (texel.x * int(push.every) < frame.tile_width && texel.y * int(push.every) < frame.tile_height) {
        ivec2 pixel = ao_pixel(texel);
        uvec4 seen = texelFetch(visibility, pixel, 0);
        uvec4 point = uvec4(0u);
        uint state = seen.y >> 28u;
        if (state != kSeenNothing && state != kSeenInside) {
            uint packed_normal = texelFetch(surface_words, pixel, 0).y;
            vec3 normal = unpack_unit(packed_normal);
            TexelRay ray = pixel_ray(pixel);
            float t_seen = uintBitsToFloat(seen.x);
            float voxel = state == kSeenBrick ? float(1u << (seen.z >> kSeenLevelShift)) : 1.0;
            float off = ao_offset(state, voxel, t_seen);
            vec3 from = ray.part + ray.direction * t_seen;
            shadow_whole = ray.whole + ivec3(floor(from));
            vec3 surface = from - floor(from);
            uint open = 0u;
            uint number = 0u;
            vec3 direction = ao_direction(texel, 0u, normal);
            float t = ao_first(direction, normal, off, voxel);
            vec3 p = surface + normal * (off - t * dot(direction, normal));
            float reach = ao_reach(p, direction);
            int steps = 0;
            while (number < push.rays) {
                vec3 f = shadow_field(p + direction * t, direction);
                ++looks;
                ++steps;
                t += max(max(f.y, f.x < kFarAway ? kAoTrusted * f.x : 0.0), max(f.z, kAoShortest * voxel));
                bool is_open = f.x > 0.0 && (t >= reach || steps >= kAoSteps);
                if (f.x <= 0.0 || is_open) {
                    if (is_open) open |= 1u << number;
                    ++number;
                    direction = ao_direction(texel, number, normal);
                    t = ao_first(direction, normal, off, voxel);
                    p = surface + normal * (off - t * dot(direction, normal));
                    reach = ao_reach(p, direction);
                    steps = 0;
                }
            }
#ifdef KILN_EXACT
            if (frame.outside_count != 0u && (frame.flags & (kFrameOutsideConcave | kFrameUnpruned)) == kFrameOutsideConcave) {
                for (uint i = 0u; i < push.rays; ++i) {
                    if ((open & (1u << i)) != 0u && !above_horizon(surface, ao_direction(texel, i, normal))) open &= ~(1u << i);
                }
            }
#endif
            point = uvec4(open | kAoSurface, packed_normal, seen.x, 0u);
        }
        imageStore(ao_points, texel, point);
    }
    atomicAdd(group_evaluations, looks);
    barrier();
    if (gl_LocalInvocationIndex == 0u) evaluations[gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x] = group_evaluations;
}
