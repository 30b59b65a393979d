#version 460
// SPDX-License-Identifier: MIT
// Debug lines over the finished picture, mixed as light.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#include "render/passes/lines.gpu.h"
#include "render/lib/color.gpu.h"

layout(local_size_x = kLineGroup, local_size_y = kLineGroup) in;

layout(set = 0, binding = 0) uniform texture2D shown;
layout(set = 0, binding = 1) uniform texture2D drawn;  // colour times share; share
layout(set = 0, binding = 2, rgba8) writeonly uniform image2D shown_now;
layout(push_constant) uniform Push { LinePush push; };

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (pixel.x >= push.width || pixel.y >= push.height) return;
    vec4 color = texelFetch(shown, pixel, 0);
    vec4 line = texelFetch(drawn, pixel, 0);
    if (line.a > 0.0) color.rgb = srgb_from_linear3(linear_from_srgb3(color.rgb) * (1.0 - line.a) + line.rgb);
    imageStore(shown_now, pixel, color);
}
