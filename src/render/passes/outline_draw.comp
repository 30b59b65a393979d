#version 460
// SPDX-License-Identifier: MIT
// The lines over the finished picture: outside all outlined edits, from their edge to its width, the last pixel by its share.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#include "render/passes/outline.gpu.h"
#include "render/lib/color.gpu.h"

layout(local_size_x = kOutlineGroup, local_size_y = kOutlineGroup) in;

layout(set = 0, binding = 0, std430) readonly buffer Outlines { OutlineRecord outlines[]; };
layout(set = 0, binding = 1) uniform utexture2D owners;
layout(set = 0, binding = 2) uniform utexture2D seeds;
layout(set = 0, binding = 3) uniform texture2D shown;
layout(set = 0, binding = 4, rgba8) writeonly uniform image2D outlined;
layout(push_constant) uniform Push { OutlinePush push; };

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (pixel.x >= push.width || pixel.y >= push.height) return;
    vec4 color = texelFetch(shown, pixel, 0);
    uint seed = texelFetch(seeds, pixel, 0).r;
    if (seed != kNoSeed && texelFetch(owners, pixel, 0).r == 0u) {
        ivec2 at = ivec2(seed & 0xffffu, seed >> 16u);
        OutlineRecord r = outlines[texelFetch(owners, at, 0).r - 1u];
        // The edge is half a pixel before the middle of the last pixel inside.
        float past_edge = length(vec2(at - pixel)) - 0.5;
        float covered = clamp(r.width_px + 0.5 - past_edge, 0.0, 1.0);
        color.rgb = srgb_from_linear3(mix(linear_from_srgb3(color.rgb), vec3(r.red, r.green, r.blue), covered));
    }
    imageStore(outlined, pixel, color);
}
