#version 460
// SPDX-License-Identifier: MIT
// The part back into the tile: what its rays brought, and what those brought that parted from them.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#include "render/passes/frame.gpu.h"
#include "render/passes/glass.gpu.h"

layout(local_size_x = kTileGroup, local_size_y = kTileGroup) in;

layout(set = 0, binding = 0) uniform texture2D total;
layout(set = 0, binding = 1) uniform texture2D parted;  // with kThroughParts: two pictures, one below the other
layout(set = 0, binding = 2, rgba16f) writeonly uniform image2D tile_radiance;
layout(push_constant) uniform Push { ThroughPush push; };

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (pixel.x >= push.width || pixel.y >= push.height) return;
    vec4 light = texelFetch(total, pixel, 0);
    if ((push.step & kThroughParts) != 0u)
        light.rgb += texelFetch(parted, pixel, 0).rgb + texelFetch(parted, ivec2(pixel.x, pixel.y + push.height), 0).rgb;
    imageStore(tile_radiance, pixel + ivec2(push.from_x, push.from_y), min(light, vec4(65000.0)));
}
