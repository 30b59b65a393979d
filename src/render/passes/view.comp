#version 460
// SPDX-License-Identifier: MIT
// Debug views: what the G-buffer holds, as numbers in `values` and as bytes in `shown`.
//   albedo  linear base colour; shown as sRGB      normal  0.5 + 0.5 n, world space; shown as it is; misses black
//   depth   metres along the ray; shown as t / (t + 1), near is dark, misses white
//   steps   cells and samples along the ray, 0 … 1 for 0 … 256, as a heat map
//   bricks  a colour a brick or instance, shaded by the normal
//   ao      share of the hemisphere that is open; shown as it is; misses white
//   levels  a colour a level of the clipmap, finest first: red, orange, yellow, green, blue, violet, and again; what no brick shows is grey
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#include "render/passes/frame.gpu.h"

layout(local_size_x = kTileGroup, local_size_y = kTileGroup) in;

layout(set = 0, binding = 0, std140) uniform Frame { FrameParams frame; };
layout(set = 0, binding = 1) uniform utexture2D visibility;
layout(set = 0, binding = 2) uniform utexture2D surface_words;
layout(set = 0, binding = 3) uniform texture2D depth;
layout(set = 0, binding = 4, rgba32f) writeonly uniform image2D values;
layout(set = 0, binding = 5, rgba8) writeonly uniform image2D shown;

#include "render/passes/surface.glsl"

// Values of kiln::View.
const uint kViewAlbedo = 1u;
const uint kViewNormal = 2u;
const uint kViewDepth = 3u;
const uint kViewSteps = 4u;
const uint kViewLevels = 6u;
const uint kViewAo = 7u;

vec3 level_color(uint level) {
    const vec3 kColors[6] = vec3[6](vec3(0.80, 0.10, 0.08), vec3(0.85, 0.38, 0.05), vec3(0.80, 0.72, 0.10), vec3(0.15, 0.55, 0.15), vec3(0.08, 0.25, 0.75), vec3(0.45, 0.12, 0.62));
    return kColors[level % 6u] * (level < 6u ? 1.0 : 0.6);
}

// Black, blue, magenta, orange, white.
vec3 heat(float x) {
    x = clamp(x, 0.0, 1.0);
    return clamp(vec3(2.2 * x - 0.2, 2.5 * x - 1.3, x < 0.35 ? 2.4 * x : (x < 0.75 ? 1.47 - 1.8 * x : 3.5 * x - 2.5)), vec3(0.0), vec3(1.0));
}

// A colour that neighbouring numbers do not share.
vec3 number_color(uint n) {
    n = (n ^ 61u) ^ (n >> 16u);
    n *= 9u;
    n ^= n >> 4u;
    n *= 0x27d4eb2du;
    n ^= n >> 15u;
    return 0.25 + 0.75 * vec3(float(n & 255u), float((n >> 8u) & 255u), float((n >> 16u) & 255u)) / 255.0;
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (pixel.x >= frame.tile_width || pixel.y >= frame.tile_height) return;
    uvec4 seen = texelFetch(visibility, pixel, 0);
    SurfaceSample s = unpack_surface(texelFetch(surface_words, pixel, 0));
    bool hit = (s.flags & kSurfaceHit) != 0u;
    vec3 value = vec3(0.0);
    vec3 color = vec3(0.0);
    if (frame.view == kViewAlbedo) {
        value = hit ? s.albedo : vec3(0.0);
        color = srgb_from_linear3(value);
    } else if (frame.view == kViewNormal) {
        value = hit ? 0.5 + 0.5 * s.normal : vec3(0.0);
        color = value;
    } else if (frame.view == kViewDepth) {
        float t = texelFetch(depth, pixel, 0).r;
        value = vec3(t);
        color = vec3(hit ? t / (t + 1.0) : 1.0);
    } else if (frame.view == kViewSteps) {
        value = vec3(float(seen.w & 0xffffu) / 256.0);
        color = heat(value.x);
    } else if (frame.view == kViewAo) {
        value = vec3(hit ? s.ambient : 1.0);
        color = value;
    } else if (hit) {
        uint state = seen.y >> 28u;
        vec3 brick = state == kSeenBrick || state == kSeenPruned || state == kSeenInstance ? number_color(seen.y & 0x0fffffffu) : vec3(0.5);
        if (frame.view == kViewLevels && state == kSeenBrick) brick = level_color(seen.z >> kSeenLevelShift);
        value = brick * (0.55 + 0.45 * s.normal.y);
        color = srgb_from_linear3(value);
    }
    imageStore(values, pixel, vec4(value, 1.0));
    imageStore(shown, pixel, vec4(color, 1.0));
}
