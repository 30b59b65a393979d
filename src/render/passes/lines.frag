#version 460
// SPDX-License-Identifier: MIT
// How much of a pixel a debug line covers, colour times share: exact across the line for a pixel of one unit that lies along it. What is solid and
// nearer leaves only the share that hidden parts have.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#include "render/passes/lines.gpu.h"

layout(set = 0, binding = 0, std140) uniform Params { LineParams params; };
layout(set = 0, binding = 2) uniform texture2D depth;  // metres along the ray

layout(location = 0) flat in vec4 ends;
layout(location = 1) flat in vec4 nearness;
layout(location = 2) flat in vec4 line_color;
layout(location = 0) out vec4 over;

// A line on a surface counts as before it: rounding, and a little more.
const float kOnSurface = 2e-3;

void main() {
    vec2 pixel = gl_FragCoord.xy + vec2(params.tile_x, params.tile_y);
    vec2 along = ends.zw - ends.xy;
    float square = dot(along, along);
    float at = square > 0.0 ? clamp(dot(pixel - ends.xy, along) / square, 0.0, 1.0) : 0.0;
    float away = length(pixel - ends.xy - at * along);
    float half_width = 0.5 * nearness.z;
    float share = clamp(min(away + 0.5, half_width) - max(away - 0.5, -half_width), 0.0, 1.0);
    float ahead = 1.0 / mix(nearness.x, nearness.y, at);
    float cosine = dot(camera_direction_at(params.camera, pixel.x, pixel.y), params.camera.forward.xyz);
    float t = ahead / cosine;
    if (t > texelFetch(depth, ivec2(gl_FragCoord.xy), 0).r * (1.0 + kOnSurface)) share *= nearness.w;
    over = vec4(line_color.rgb, 1.0) * share;
}
