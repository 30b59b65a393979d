#version 460
// SPDX-License-Identifier: MIT
// The stencil test, by the mask of what is seen: not where the mesh itself is; and behind nothing solid.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#include "render/passes/frame.gpu.h"
#include "render/passes/mesh.gpu.h"
#include "render/passes/outline_hull.gpu.h"

layout(set = 0, binding = 0, std140) uniform Frame { FrameParams frame; };
layout(set = 0, binding = 5) uniform utexture2D owners;
layout(set = 0, binding = 6) uniform texture2D depth;  // metres along the ray
layout(push_constant) uniform Push { HullPush push; };
layout(location = 0) out vec4 over;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    if (texelFetch(owners, pixel, 0).r == push.owner) discard;
    vec2 whole = gl_FragCoord.xy + vec2(frame.tile_x, frame.tile_y);
    float t = (1.0 / gl_FragCoord.w) / dot(camera_direction_at(frame.camera, whole.x, whole.y), frame.camera.forward.xyz);
    if (t > texelFetch(depth, pixel, 0).r) discard;
    over = vec4(push.red, push.green, push.blue, 1.0);
}
