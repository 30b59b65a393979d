#version 460
// SPDX-License-Identifier: MIT
// The surface of glass as the light pass is to see it, where rays come from outside: it reflects as its index of refraction says, and the share that stays outside looks
// like its base colour. A G-buffer has albedo a and metallic m, which make a base of a (1 - m) and a reflectance of 0.04 (1 - m) + a m; both
// are wanted, so m follows from a quadratic equation.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#include "render/passes/frame.gpu.h"
#include "render/passes/glass.gpu.h"
#include "render/lib/glass.gpu.h"

layout(local_size_x = kTileGroup, local_size_y = kTileGroup) in;

layout(set = 0, binding = 0, std430) readonly buffer Glass { GlassRecord glass[]; };  // not read without glass
layout(set = 0, binding = 1) uniform utexture2D seen;
layout(set = 0, binding = 2) uniform utexture2D words;
layout(set = 0, binding = 3, std430) readonly buffer Rays { FrameRay rays[]; };  // not read with kThroughCamera
layout(set = 0, binding = 4, rgba32ui) writeonly uniform uimage2D words_now;
layout(set = 0, binding = 5, rgba32ui) writeonly uniform uimage2D seen_now;
layout(push_constant) uniform Push { ThroughPush push; };

#include "render/passes/surface.glsl"

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (pixel.x >= push.width || pixel.y >= push.height) return;
    uvec4 packed_surface = texelFetch(words, pixel, 0);
    uvec4 word = texelFetch(seen, pixel, 0);
    if ((word.y >> 28u) == kSeenInstance) {
        GlassRecord g = glass[word.y & 0x0fffffffu];
        SurfaceSample s = unpack_surface(packed_surface);
        const float kDielectric = 0.04;
        vec3 base = s.albedo * g.opacity;
        float f0 = glass_f0(g.ior);
        float both = dot(base, vec3(1.0 / 3.0)) + f0;
        float sum = max(both * both - 4.0 * kDielectric * (both - f0), 0.0);
        float rest = clamp((both - sqrt(sum)) / (2.0 * kDielectric), 0.0, 1.0);  // 1 - m
        s.albedo = clamp(base + f0 - kDielectric * rest, vec3(0.0), vec3(1.0));
        s.metallic = 1.0 - rest;
        packed_surface = pack_surface(s);
    }
    bool inside = (push.step & kThroughCamera) == 0u && rays[pixel.y * push.width + pixel.x].within > 0.0 && (word.y >> 28u) == kSeenInstance;
    imageStore(words_now, pixel, packed_surface);
    imageStore(seen_now, pixel, inside ? uvec4(0x7f800000u, kSeenNothing << 28u, 0u, 0u) : word);
}
