#version 460
// SPDX-License-Identifier: MIT
// What rays through transparent things bring: their surfaces' own light, and that of what is behind the last.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#include "render/passes/frame.gpu.h"
#include "render/passes/glass.gpu.h"

layout(local_size_x = kTileGroup, local_size_y = kTileGroup) in;

layout(set = 0, binding = 0) uniform texture2D sum;
layout(set = 0, binding = 1) uniform texture2D carried;
layout(set = 0, binding = 2) uniform texture2D behind;
layout(set = 0, binding = 3, rgba16f) writeonly uniform image2D total;
layout(push_constant) uniform Push { ThroughPush push; };

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (pixel.x >= push.width || pixel.y >= push.height) return;
    vec4 light = texelFetch(sum, pixel, 0);
    light.rgb += texelFetch(carried, pixel, 0).rgb * texelFetch(behind, pixel, 0).rgb;
    imageStore(total, pixel, min(light, vec4(65000.0)));
}
