#version 460
// SPDX-License-Identifier: MIT
// What a screen shows: exposure, tone map, sRGB curve.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#include "render/passes/frame.gpu.h"
#include "render/lib/color.gpu.h"
#include "render/lib/tonemap.gpu.h"

layout(local_size_x = kTileGroup, local_size_y = kTileGroup) in;

layout(set = 0, binding = 0, std140) uniform Frame { FrameParams frame; };
layout(set = 0, binding = 1) uniform texture2D radiance;
layout(set = 0, binding = 2, rgba8) writeonly uniform image2D shown;

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (pixel.x >= frame.tile_width || pixel.y >= frame.tile_height) return;
    vec3 c = tone_map(frame.tone_map, texelFetch(radiance, pixel, 0).rgb * frame.exposure);
    imageStore(shown, pixel, vec4(srgb_from_linear3(c), 1.0));
}
