#version 460
// SPDX-License-Identifier: MIT
// One step of a jump flood (Rong and Tan, "Jump Flooding in GPU", 2006; for outlines: Golus, "The Quest for Very Wide Outlines", 2020):
// of the seeds of nine pixels, the one whose line reaches farthest past this pixel.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#include "render/passes/outline.gpu.h"

layout(local_size_x = kOutlineGroup, local_size_y = kOutlineGroup) in;

layout(set = 0, binding = 0, std430) readonly buffer Outlines { OutlineRecord outlines[]; };
layout(set = 0, binding = 1) uniform utexture2D owners;
layout(set = 0, binding = 2) uniform utexture2D seeds;
layout(set = 0, binding = 3, r32ui) writeonly uniform uimage2D flooded;
layout(push_constant) uniform Push { OutlinePush push; };

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (pixel.x >= push.width || pixel.y >= push.height) return;
    uint best = kNoSeed;
    float least = 1e30;
    for (int k = 0; k < 9; ++k) {
        ivec2 from = pixel + ivec2(k % 3 - 1, k / 3 - 1) * push.step;
        if (any(lessThan(from, ivec2(0))) || from.x >= push.width || from.y >= push.height) continue;
        uint seed = texelFetch(seeds, from, 0).r;
        if (seed == kNoSeed) continue;
        ivec2 at = ivec2(seed & 0xffffu, seed >> 16u);
        float past = length(vec2(at - pixel)) - outlines[texelFetch(owners, at, 0).r - 1u].width_px;
        if (past < least || (past == least && seed < best)) {
            least = past;
            best = seed;
        }
    }
    imageStore(flooded, pixel, uvec4(best));
}
