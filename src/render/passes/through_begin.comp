#version 460
// SPDX-License-Identifier: MIT
// A part of the tile as a picture of its own: what is solid, and its light.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#include "render/passes/frame.gpu.h"
#include "render/passes/glass.gpu.h"

layout(local_size_x = kTileGroup, local_size_y = kTileGroup) in;

layout(set = 0, binding = 0) uniform utexture2D tile_seen;
layout(set = 0, binding = 1) uniform texture2D tile_radiance;
layout(set = 0, binding = 2, rgba32ui) writeonly uniform uimage2D seen;
layout(set = 0, binding = 3, rgba16f) writeonly uniform image2D radiance;
layout(push_constant) uniform Push { ThroughPush push; };

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (pixel.x >= push.width || pixel.y >= push.height) return;
    ivec2 from = pixel + ivec2(push.from_x, push.from_y);
    imageStore(seen, pixel, texelFetch(tile_seen, from, 0));
    imageStore(radiance, pixel, texelFetch(tile_radiance, from, 0));
}
