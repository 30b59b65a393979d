#version 460
// SPDX-License-Identifier: MIT
// What instances hide of each light's disc, multiplied into the fractions that the field leaves visible: those lights of a tile's list. The cone
// around the disc goes down the tree; each object it meets is asked in its own voxels. Hard shadows are the march of primary rays.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#include "render/passes/frame.gpu.h"
#include "render/passes/instances.gpu.h"
#include "render/passes/shadow.gpu.h"

layout(local_size_x = kTileGroup, local_size_y = kTileGroup) in;

layout(set = 0, binding = 0, std140) uniform Frame { FrameParams frame; };
layout(set = 0, binding = 1, rgba32ui) readonly uniform uimage2D instance_ways;
layout(set = 0, binding = 2, rgba32ui) readonly uniform uimage2D instance_nodes;
layout(set = 0, binding = 3, std430) readonly buffer Cells { uint instance_cells[]; };
layout(set = 0, binding = 4, std430) readonly buffer Rays { FrameRay rays[]; };
layout(set = 0, binding = 5, std430) readonly buffer Tables { uint tables[]; };
layout(set = 0, binding = 6, std430) readonly buffer Lights { LightRecord lights[]; };
layout(set = 0, binding = 7) uniform texture3D distances;
layout(set = 0, binding = 8) uniform sampler distance_sampler;
layout(set = 0, binding = 9) uniform utexture2D visibility;
layout(set = 0, binding = 10) uniform utexture2D surface_words;
layout(set = 0, binding = 11) uniform utexture2D fractions_before;
layout(set = 0, binding = 12, rgba32ui) writeonly uniform uimage2D visible_fractions;
layout(set = 0, binding = 13, std430) readonly buffer LightMasks { uint light_masks[]; };
layout(push_constant) uniform Push { InstancePush push; };

#define KILN_INSTANCE_WALK
#include "render/passes/instances.glsl"
#include "render/passes/rays.glsl"
#include "render/passes/light_walk.glsl"
#include "render/passes/surface.glsl"
#include "render/passes/shadow_bricks.glsl"

// Positions of shadow rays count from here: the object's voxel that their point is in.
ivec3 shadow_whole;

// Where a ray enters the set's box, counted from its first texel; far away where it does not.
float way_to_set(vec3 local, vec3 direction) {
    vec3 size = vec3(here.grid.size_x, here.grid.size_y, here.grid.size_z) * float(kBrickVoxels);
    vec3 inverse = walk_inverse(direction);
    vec3 a = -local * inverse;
    vec3 b = (size - local) * inverse;
    vec3 low = min(a, b);
    vec3 high = max(a, b);
    float t_in = max(max(low.x, low.y), max(low.z, 0.0));
    float t_out = min(min(high.x, high.y), high.z);
    return t_in <= t_out ? t_in + kPastFace : kFarVoxels;
}

// For soft_shadow.gpu.h, in the object's voxels.
vec3 shadow_field(vec3 p, vec3 direction) {
    vec3 local = vec3(shadow_whole - set_first_cell() * kBrickVoxels) + p;
    ivec3 cell = ivec3(floor(local / float(kBrickVoxels)));
    if (!in_set(cell)) {
        vec3 size = vec3(here.grid.size_x, here.grid.size_y, here.grid.size_z) * float(kBrickVoxels);
        float gap = length(max(max(-local, local - size), vec3(0.0)));
        return vec3(kFarAway, gap + 0.25, way_to_set(local, direction));
    }
    uint word = field_cell(cell);
    vec3 in_cell = local - vec3(cell * kBrickVoxels);
    if ((word & kCellOccupied) != 0u) {
        float d = sampled_distance(int(word & kCellSlotMask) + int(here.slot_first), in_cell);
        return vec3(d >= kSaturatedVoxels ? kFarAway : d, max(abs(d) - kTrilinearErrorVoxels, 0.01), 0.0);
    }
    return empty_cell((word & kCellInside) != 0u, int(word & 7u), in_cell, direction);
}

#include "render/lib/soft_shadow.gpu.h"

// What instances leave visible of a disc; p counts from the eye. All lengths but those in the object: finest voxels.
float visible_past_instances(vec3 p, vec3 l, float tan_radius, float t_last) {
    vec3 inverse = walk_inverse(l);
    float visible = 1.0;
    uint at = 0u;
    float enters = 0.0;
    int looks = 0;
    InstanceNode leaf = node_at(0u);
    while (true) {
        // To the next object in whose turned box the cone comes first, as in march_sets.glsl.
        TexelRay ray;
        float first = 0.0;
        float last = 0.0;
        bool meets = false;
        bool ends = false;
        do {
            uint found = next_in_tree(at, p, l, inverse, tan_radius, t_last, leaf, enters, looks);
            ends = found == kNoInstance;
            if (!ends) {
                InstanceRecord instance = instance_at(found);
                ray = object_ray(instance, p, l);
                float scale = instance.voxels;
                first = 0.5;
                last = t_last * scale;
                float by = 0.0;
                if (tan_radius > 0.0) {
                    // From where the cone comes near to where it is past; rays to the rim are longer by a little.
                    vec3 low = vec3(leaf.low_x, leaf.low_y, leaf.low_z);
                    vec3 high = vec3(leaf.high_x, leaf.high_y, leaf.high_z);
                    float along = dot(0.5 * (low + high) - p, l);
                    float radius = 0.5 * length(high - low);
                    float longer = 1.0 + tan_radius;
                    first = max(0.5, (along - radius) * scale / longer - 1.0);
                    last = min(t_last, (along + radius) * longer) * scale + 1.0;
                    // Where no ray of the cone meets it nothing is hidden; the distances that are stored lie by up to a voxel.
                    by = last * tan_radius * longer + 1.0;
                }
                set_span(ray, by, first, last);
                meets = first <= last;
            }
        } while (!ends && !meets);
        if (ends) break;
        if (tan_radius <= 0.0) {
            if (field_march(here.grid, ray, first, last, true).state != kMarchMiss) return 0.0;
            continue;
        }
        shadow_whole = ray.whole;
        visible *= shadow_visible(ray.part, ray.direction, tan_radius, ShadowMarch(first, last, 0.25, kSaturatedVoxels, kShadowSteps));
        if (visible <= 0.0) return 0.0;
    }
    return visible;
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (pixel.x >= frame.tile_width || pixel.y >= frame.tile_height) return;
    uvec4 seen = texelFetch(visibility, pixel, 0);
    uvec4 fractions = texelFetch(fractions_before, pixel, 0);
    uint state = seen.y >> 28u;
    if (state != kSeenNothing && state != kSeenInside) {
        SurfaceSample surface = unpack_surface(texelFetch(surface_words, pixel, 0));
        TexelRay ray = pixel_ray(pixel);
        float t = uintBitsToFloat(seen.x);
        float voxel = state == kSeenBrick ? float(1u << (seen.z >> kSeenLevelShift)) : 1.0;
        if (state == kSeenInstance) voxel = 1.0 / instance_voxels(seen.y & 0x0fffffffu);
        vec3 p = from_eye(ray) + ray.direction * t + surface.normal * shadow_offset(state, voxel, t);
        vec3 p_world = (vec3(ray.whole) + (ray.part + ray.direction * t)) * frame.grid.voxel_size;
        LightWalk walk = light_walk(pixel, push.first_light);
        for (uint channel = 0u; channel < kLightsAtOnce; ++channel) {
            uint index = next_light(walk);
            if (index == kNoLight) break;
            float before = visible_fraction(fractions, channel);
            if (before <= 0.0) continue;
            LightSample light = sample_light(lights[index], p_world);
            float left = visible_past_instances(p, light.l, light.tan_radius, light.distance / frame.grid.voxel_size);
            set_visible_fraction(fractions, channel, before * left);
        }
    }
    imageStore(visible_fractions, pixel, fractions);
}
