#version 460
// SPDX-License-Identifier: MIT
// What a pixel shows first, transparent or not: where that was in the frame before, and what lies before it and behind it, depend on it.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#include "render/passes/frame.gpu.h"
#include "render/passes/glass.gpu.h"

layout(local_size_x = kTileGroup, local_size_y = kTileGroup) in;

layout(set = 0, binding = 0, std140) uniform Frame { FrameParams frame; };
layout(set = 0, binding = 1) uniform utexture2D seen;
layout(set = 0, binding = 2) uniform texture2D light;
layout(set = 0, binding = 3) uniform texture2D left;
layout(set = 0, binding = 4) uniform texture2D mirrored;  // with kThroughParts: belongs to the light
layout(set = 0, binding = 5, rgba32ui) writeonly uniform uimage2D front_seen;
layout(set = 0, binding = 6, r32f) writeonly uniform image2D front_depth;
layout(set = 0, binding = 7, rgba16f) writeonly uniform image2D front_light;
layout(set = 0, binding = 8, rgba16f) writeonly uniform image2D front_left;
layout(push_constant) uniform Push { ThroughPush push; };

#include "render/passes/depth.glsl"

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (pixel.x >= push.width || pixel.y >= push.height) return;
    uvec4 word = texelFetch(seen, pixel, 0);
    // A part goes over what is there.
    if ((push.step & kThroughBegins) == 0u && (word.y >> 28u) == kSeenNothing) return;
    vec4 own = texelFetch(light, pixel, 0);
    if ((push.step & kThroughParts) != 0u) own.rgb += texelFetch(mirrored, pixel, 0).rgb;
    ivec2 to = pixel + ivec2(push.from_x, push.from_y);
    imageStore(front_seen, to, word);
    imageStore(front_depth, to, vec4(depth_of(word, frame.grid.voxel_size)));
    imageStore(front_light, to, own);
    imageStore(front_left, to, texelFetch(left, pixel, 0));
}
