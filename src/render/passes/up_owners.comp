#version 460
// SPDX-License-Identifier: MIT
// An outline's mask of fewer rays in the pixels that are shown.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#include "render/passes/outline.gpu.h"
#include "render/passes/taa_up.gpu.h"

layout(local_size_x = 8, local_size_y = 8) in;

layout(set = 0, binding = 0) uniform utexture2D owners;
layout(set = 0, binding = 1, r32ui) writeonly uniform uimage2D owners_up;
layout(set = 0, binding = 2, r32ui) writeonly uniform uimage2D seeds_up;
layout(push_constant) uniform Push { UpPush push; };

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (pixel.x >= push.width || pixel.y >= push.height) return;
    ivec2 from = pixel * ivec2(push.width_rays, push.height_rays) / ivec2(push.width, push.height);
    uint owner = texelFetch(owners, from, 0).r;
    imageStore(owners_up, pixel, uvec4(owner));
    imageStore(seeds_up, pixel, uvec4(owner == 0u ? kNoSeed : uint(pixel.x) | (uint(pixel.y) << 16u)));
}
