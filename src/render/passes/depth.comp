#version 460
// SPDX-License-Identifier: MIT
// Depth, from visibility words that have t where the surface is. Made when it is asked for: between, no pass has to keep it.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#include "render/passes/frame.gpu.h"

layout(local_size_x = kTileGroup, local_size_y = kTileGroup) in;

layout(set = 0, binding = 0, std140) uniform Frame { FrameParams frame; };
layout(set = 0, binding = 1) uniform utexture2D seen;
layout(set = 0, binding = 2, r32f) writeonly uniform image2D depth;

#include "render/passes/depth.glsl"

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (pixel.x >= frame.tile_width || pixel.y >= frame.tile_height) return;
    imageStore(depth, pixel + ivec2(0, frame.first_row), vec4(depth_of(texelFetch(seen, pixel, 0), frame.grid.voxel_size)));
}
