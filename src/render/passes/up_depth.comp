#version 460
// SPDX-License-Identifier: MIT
// Distances of fewer rays in the pixels that are shown: the nearest ray's.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#include "render/passes/taa_up.gpu.h"

layout(local_size_x = 8, local_size_y = 8) in;

layout(set = 0, binding = 0) uniform texture2D depth;
layout(set = 0, binding = 1, r32f) writeonly uniform image2D depth_up;
layout(push_constant) uniform Push { UpPush push; };

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (pixel.x >= push.width || pixel.y >= push.height) return;
    ivec2 from = pixel * ivec2(push.width_rays, push.height_rays) / ivec2(push.width, push.height);
    imageStore(depth_up, pixel, vec4(texelFetch(depth, from, 0).r));
}
