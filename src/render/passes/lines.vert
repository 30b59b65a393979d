#version 460
// SPDX-License-Identifier: MIT
// Debug lines, an instance each: what of the segment is before the eye and near the picture, as a rectangle of pixels around it.
#extension GL_GOOGLE_include_directive : require
#include "render/passes/lines.gpu.h"

layout(set = 0, binding = 0, std140) uniform Params { LineParams params; };
layout(set = 0, binding = 1, std430) readonly buffer Lines { LineRecord lines[]; };

layout(location = 0) flat out vec4 ends;       // pixels: a, b
layout(location = 1) flat out vec4 nearness;   // 1 / metres along the camera's axis, at a and b; width in pixels; share where hidden
layout(location = 2) flat out vec4 line_color;

const float kNear = 1e-4;  // metres

// Keeps where `inside`, linear from a to b, is not negative.
void keep(float at_a, float at_b, inout float first, inout float last) {
    if (at_a < 0.0 && at_b < 0.0) last = -1.0;
    if (at_a < 0.0 && at_b >= 0.0) first = max(first, at_a / (at_a - at_b));
    if (at_a >= 0.0 && at_b < 0.0) last = min(last, at_a / (at_a - at_b));
}

void main() {
    LineRecord line = lines[gl_InstanceIndex];
    vec3 a = vec3(line.a_x, line.a_y, line.a_z);
    vec3 b = vec3(line.b_x, line.b_y, line.b_z);
    vec3 right = params.camera.right.xyz / dot(params.camera.right.xyz, params.camera.right.xyz);
    vec3 up = params.camera.up.xyz / dot(params.camera.up.xyz, params.camera.up.xyz);
    vec3 forward = params.camera.forward.xyz;
    // Clip space: x and y from -w to w are in the picture.
    vec3 clip_a = vec3(dot(right, a), dot(up, a), dot(forward, a));
    vec3 clip_b = vec3(dot(right, b), dot(up, b), dot(forward, b));
    vec2 size = vec2(params.width, params.height);
    vec2 wider = 1.0 + 2.0 * (line.width_px + 4.0) / size;
    float first = 0.0;
    float last = 1.0;
    keep(clip_a.z - kNear, clip_b.z - kNear, first, last);
    for (int i = 0; i < 2; ++i) {
        keep(wider[i] * clip_a.z - clip_a[i], wider[i] * clip_b.z - clip_b[i], first, last);
        keep(wider[i] * clip_a.z + clip_a[i], wider[i] * clip_b.z + clip_b[i], first, last);
    }
    ends = vec4(0.0);
    nearness = vec4(0.0);
    line_color = vec4(line.red, line.green, line.blue, 1.0);
    gl_Position = vec4(0.0, 0.0, 0.5, 1.0);
    if (!(first <= last)) return;  // of no size
    vec3 from = mix(clip_a, clip_b, first);
    vec3 to = mix(clip_a, clip_b, last);
    from.z = max(from.z, kNear);
    to.z = max(to.z, kNear);
    vec2 from_px = (vec2(from.x, -from.y) / from.z + 1.0) * 0.5 * size;
    vec2 to_px = (vec2(to.x, -to.y) / to.z + 1.0) * 0.5 * size;
    ends = vec4(from_px, to_px);
    nearness = vec4(1.0 / from.z, 1.0 / to.z, line.width_px, line.hidden);
    vec2 along = to_px - from_px;
    float len = length(along);
    along = len > 1e-6 ? along / len : vec2(1.0, 0.0);
    float reach = 0.5 * line.width_px + 1.0;
    const int kCorners[6] = int[6](0, 1, 2, 2, 1, 3);
    int corner = kCorners[gl_VertexIndex % 6];
    vec2 at = ((corner & 1) == 0 ? from_px - along * reach : to_px + along * reach) + vec2(-along.y, along.x) * ((corner & 2) == 0 ? -reach : reach);
    vec2 in_tile = (at - vec2(params.tile_x, params.tile_y)) / vec2(params.tile_width, params.tile_height);
    gl_Position = vec4(2.0 * in_tile.x - 1.0, 1.0 - 2.0 * in_tile.y, 0.5, 1.0);
}
