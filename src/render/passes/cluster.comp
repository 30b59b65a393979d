#version 460
// SPDX-License-Identifier: MIT
// Which lights may reach which tile, a bit a light (Olsson, Billeter and Assarsson, "Clustered Deferred and Forward Shading", 2012;
// bits as Drobot, "Improved Culling for Tiled and Clustered Rendering", 2017). The solid that a light must reach is the box round the
// tile's visible points, so what is empty between near and far of a tile is left out as depth slices would leave it. A light is
// left out only where every point's illuminance from it is exactly 0: sums over the list equal sums over all lights, bit for bit.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#include "render/passes/frame.gpu.h"
#include "render/passes/cluster.gpu.h"
#include "render/lib/lights.gpu.h"

layout(local_size_x = kClusterSide, local_size_y = kClusterSide) in;

layout(set = 0, binding = 0, std140) uniform Frame { FrameParams frame; };
layout(set = 0, binding = 1, std430) readonly buffer Rays { FrameRay rays[]; };
layout(set = 0, binding = 2, std430) readonly buffer Lights { LightRecord lights[]; };
layout(set = 0, binding = 3, std430) readonly buffer LightRects { uvec2 light_rects[]; };  // see light_rects.h
layout(set = 0, binding = 4) uniform utexture2D visibility;
layout(set = 0, binding = 5, std430) writeonly buffer LightMasks { uint light_masks[]; };

#include "render/passes/rays.glsl"

const uint kThreads = uint(kClusterSide * kClusterSide);

shared uint low[3], high[3];  // ordered_bits(): of the points' box
shared uint words[kThreads / 32u];

#include "render/passes/ordered_bits.glsl"

// May the light's illuminance be above 0 somewhere in the box?
bool reaches(LightRecord light, vec3 box_low, vec3 box_high) {
    if (light.kind == kLightDirectional) return true;
    vec3 away = light.position.xyz - clamp(light.position.xyz, box_low, box_high);
    // The window of light_falloff() is 0 from 1 on; the rest is for rounding.
    if (dot(away, away) * light.direction.w > 1.0001) return false;
    if (light.kind != kLightSpot) return true;
    // A ball round the box against the cone's side, in the plane of axis and middle: behind the apex this is less than the distance.
    vec3 middle = 0.5 * (box_low + box_high) - light.position.xyz;
    float radius = 0.5 * length(box_high - box_low);
    float cosine = clamp(-light.spot_offset / light.spot_scale, -1.0, 1.0);
    float sine = sqrt(1.0 - cosine * cosine);
    float along = dot(middle, light.direction.xyz);
    float across = sqrt(max(dot(middle, middle) - along * along, 0.0));
    return across * cosine - along * sine <= radius + 1e-3 * (radius + length(middle));
}

void main() {
    uint thread = gl_LocalInvocationIndex;
    if (thread < 3u) {
        low[thread] = ~0u;
        high[thread] = 0u;
    }
    barrier();
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (pixel.x < frame.tile_width && pixel.y < frame.tile_height) {
        uvec4 seen = texelFetch(visibility, pixel, 0);
        if ((seen.y >> 28u) != kSeenNothing) {
            vec3 p_world = seen_point(pixel_ray(pixel), seen);
            for (int axis = 0; axis < 3; ++axis) {
                atomicMin(low[axis], ordered_bits(p_world[axis]));
                atomicMax(high[axis], ordered_bits(p_world[axis]));
            }
        }
    }
    barrier();
    bool all = (frame.flags & kFrameAllLights) != 0u;
    bool any = all || low[0] <= high[0];
    vec3 box_low = vec3(float_of_ordered(low[0]), float_of_ordered(low[1]), float_of_ordered(low[2]));
    vec3 box_high = vec3(float_of_ordered(high[0]), float_of_ordered(high[1]), float_of_ordered(high[2]));
    // Other kernels may round the same point otherwise.
    vec3 slack = 1e-6 * max(abs(box_low), abs(box_high)) + 1e-6;
    box_low -= slack;
    box_high += slack;
    uint count = (frame.light_count + 31u) >> 5u;
    uint first = (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * count;
    for (uint base = 0u; base < frame.light_count; base += kThreads) {
        if (thread < kThreads / 32u) words[thread] = 0u;
        barrier();
        uint index = base + thread;
        if (any && index < frame.light_count) {
            uvec2 rect = light_rects[index];
            uvec2 here = gl_WorkGroupID.xy;
            bool in_rect = here.x >= (rect.x & 0xffffu) && here.x < (rect.x >> 16u) && here.y >= (rect.y & 0xffffu) && here.y < (rect.y >> 16u);
            if (all || (in_rect && reaches(lights[index], box_low, box_high))) atomicOr(words[thread >> 5u], 1u << (thread & 31u));
        }
        barrier();
        uint word = (base >> 5u) + thread;
        if (thread < kThreads / 32u && word < count) light_masks[first + word] = words[thread];
        barrier();
    }
}
