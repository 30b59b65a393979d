#version 460
// SPDX-License-Identifier: MIT
// Moves what march found to where refine has the surface. A pass of its own, so that the words march wrote make room before materials need it.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#include "render/passes/frame.gpu.h"

layout(local_size_x = kTileGroup, local_size_y = kTileGroup) in;

layout(set = 0, binding = 0, std140) uniform Frame { FrameParams frame; };
layout(set = 0, binding = 1) uniform utexture2D visibility;
layout(set = 0, binding = 2) uniform utexture2D refined;
layout(set = 0, binding = 3, rgba32ui) writeonly uniform uimage2D visibility_now;

#include "render/passes/settle.glsl"

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (pixel.x >= frame.tile_width || pixel.y >= frame.tile_height) return;
    imageStore(visibility_now, pixel, settled(texelFetch(visibility, pixel, 0), pixel));
}
