// SPDX-License-Identifier: MIT
// How much of each light's disc a point sees: sixteen lights of its tile's list at a time, a byte each. Rays start one voxel off the surface and sample
// the bricks (a trilinear value less kTrilinearErrorVoxels is what a step may trust); with KILN_EXACT, exact programs where they apply.

#include "render/passes/shadow.gpu.h"

layout(local_size_x = kTileGroup, local_size_y = kTileGroup) in;

layout(set = 0, binding = 0, std140) uniform Frame { FrameParams frame; };
layout(set = 0, binding = 1, std430) readonly buffer Cells { uint cells[]; };
layout(set = 0, binding = 2, std430) readonly buffer Rays { FrameRay rays[]; };
layout(set = 0, binding = 3, std430) readonly buffer Lights { LightRecord lights[]; };
layout(set = 0, binding = 4) uniform texture3D distances;
layout(set = 0, binding = 5) uniform sampler distance_sampler;
layout(set = 0, binding = 6) uniform utexture2D visibility;
layout(set = 0, binding = 7) uniform utexture2D surface_words;
layout(set = 0, binding = 8, rgba32ui) writeonly uniform uimage2D visible_fractions;
layout(set = 0, binding = 9, std430) readonly buffer LightMasks { uint light_masks[]; };
#ifdef KILN_EXACT
layout(set = 0, binding = 10, std430) readonly buffer Records { BrickRecord records[]; };
layout(set = 0, binding = 11, std430) readonly buffer Code { uvec2 code[]; };
layout(set = 0, binding = 12, std430) readonly buffer ProgramCode { uvec2 program_code[]; };
layout(set = 0, binding = 13, std430) readonly buffer Numbers { float numbers[]; };
#endif
#ifdef KILN_LEVELS
#ifdef KILN_EXACT
const uint kLevelsBinding = 14u;
#else
const uint kLevelsBinding = 10u;
#endif
layout(set = 0, binding = kLevelsBinding, std140) uniform Levels { LevelsParams levels; LevelPlace level_places[kMostLevels]; };
#endif
layout(push_constant) uniform Push { ShadowPush push; };
// False: code is only asked for horizons, no ray marches along it.
layout(constant_id = 5) const bool kAlongCode = true;

#ifdef KILN_LEVELS
#include "render/passes/level_map.glsl"
#endif
#include "render/passes/map.glsl"
#include "render/passes/rays.glsl"
#include "render/passes/light_walk.glsl"
#include "render/passes/surface.glsl"
#include "render/passes/grid_stretch.glsl"
#ifdef KILN_EXACT
#include "render/passes/tape_buffers.glsl"
#include "render/passes/code_of.glsl"
#endif

#include "render/passes/shadow_bricks.glsl"

#include "render/passes/shadow_field.glsl"

#include "render/lib/soft_shadow.gpu.h"

#ifdef KILN_EXACT
// Half-spaces reach to infinity: they hide what of the disc is below their horizon, wherever the ray meets them.
float above_horizons(vec3 p, vec3 l, float tan_radius, float distance_voxels) {
    float far = min(distance_voxels, 1e5);
    float height = code_distance(code_of(kSeenOutside, 0), (vec3(shadow_whole) + p + l * far) * frame.grid.voxel_size) / frame.grid.voxel_size;
    return tan_radius > 0.0 ? disc_visible(height / (far * tan_radius)) : (height > 0.0 ? 1.0 : 0.0);
}
#endif

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (pixel.x >= frame.tile_width || pixel.y >= frame.tile_height) return;
    uvec4 seen = texelFetch(visibility, pixel, 0);
    uvec4 fractions = uvec4(0u);
    uint state = seen.y >> 28u;
    if (state != kSeenNothing && state != kSeenInside) {
        SurfaceSample surface = unpack_surface(texelFetch(surface_words, pixel, 0));
        TexelRay ray = pixel_ray(pixel);
        float t = uintBitsToFloat(seen.x);
        float h = frame.grid.voxel_size;
        float voxel = state == kSeenBrick ? float(1u << (seen.z >> kSeenLevelShift)) : 1.0;
        float off = shadow_offset(state, voxel, t);
        vec3 from = ray.part + ray.direction * t + surface.normal * off;
        shadow_whole = ray.whole + ivec3(floor(from));
        vec3 p = from - floor(from);
        vec3 p_world = seen_point(ray, seen);
        LightWalk walk = light_walk(pixel, push.first_light);
        for (uint channel = 0u; channel < kLightsAtOnce; ++channel) {
            uint index = next_light(walk);
            if (index == kNoLight) break;
            LightSample light = sample_light(lights[index], p_world);
            vec3 l = light.l;
            if (dot(l, surface.normal) <= 0.0 || largest3(light.illuminance) <= 0.0) continue;
            // Beyond the grid is only what code describes; it is looked at for some grid sizes.
            float t_in;
            float t_out;
            grid_stretch(texel_ray(shadow_whole, p, l), t_in, t_out);
            vec3 grid_size = vec3(frame.grid.size_x, frame.grid.size_y, frame.grid.size_z) * float(kBrickVoxels);
            bool concave = frame.outside_count != 0u && (frame.flags & (kFrameOutsideConcave | kFrameUnpruned)) == kFrameOutsideConcave;
            bool beyond = (frame.outside_count != 0u && !concave) || (frame.flags & kFrameUnpruned) != 0u;
            float t_last = min(light.distance / h, max(t_out, 0.0) + (beyond ? 16.0 * length(grid_size) : 2.0 * float(kBrickVoxels)));
            float fraction = shadow_visible(p, l, light.tan_radius, ShadowMarch(0.5, t_last, 0.25, kSaturatedVoxels, kShadowSteps));
#ifdef KILN_EXACT
            if (concave && fraction > 0.0) fraction *= above_horizons(p, l, light.tan_radius, light.distance / h);
#endif
            set_visible_fraction(fractions, channel, fraction);
        }
    }
    imageStore(visible_fractions, pixel, fractions);
}
