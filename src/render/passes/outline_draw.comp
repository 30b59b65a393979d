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

// How far `away` from the pixel `at` is past the edge there. The edge is taken for straight across the 5 x 5 pixels around: its
// direction is theirs, and so many are inside as leave it at that distance from the middle (1/2 for one along the axes).
float past_edge(vec2 away, ivec2 at, uint owner) {
    vec2 slope = vec2(0.0);
    float inside = 0.0;
    for (int k = 0; k < 25; ++k) {
        ivec2 to = ivec2(k % 5 - 2, k / 5 - 2);
        ivec2 p = clamp(at + to, ivec2(0), ivec2(push.width, push.height) - 1);
        if (texelFetch(owners, p, 0).r != owner) continue;
        inside += 1.0;
        slope -= vec2(to);
    }
    float size = length(slope);
    // Corners and single pixels are no edges.
    if (inside < 13.0 || size < 0.5) return length(away) - 0.5;
    vec2 out_of = slope / size;
    float edge = 5.0 * (inside / 25.0 - 0.5) * max(abs(out_of.x), abs(out_of.y));
    return length(away - out_of * edge);
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (pixel.x >= push.width || pixel.y >= push.height) return;
    vec4 color = texelFetch(shown, pixel, 0);
    if (texelFetch(owners, pixel, 0).r == 0u) {
        // Neighbours' seeds too: the flood chose by pixels' middles.
        float covered = 0.0;
        vec3 line = vec3(0.0);
        for (int k = 0; k < 5; ++k) {
            ivec2 from = clamp(pixel + ivec2(k == 1 ? -1 : (k == 2 ? 1 : 0), k == 3 ? -1 : (k == 4 ? 1 : 0)), ivec2(0), ivec2(push.width, push.height) - 1);
            uint seed = texelFetch(seeds, from, 0).r;
            if (seed == kNoSeed) continue;
            ivec2 at = ivec2(seed & 0xffffu, seed >> 16u);
            uint owner = texelFetch(owners, at, 0).r;
            OutlineRecord r = outlines[owner - 1u];
            float here = clamp(r.width_px + 0.5 - past_edge(vec2(pixel - at), at, owner), 0.0, 1.0);
            if (here > covered) {
                covered = here;
                line = vec3(r.red, r.green, r.blue);
            }
        }
        color.rgb = srgb_from_linear3(mix(linear_from_srgb3(color.rgb), line, covered));
    }
    imageStore(outlined, pixel, color);
}
