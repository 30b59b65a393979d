#version 460
// SPDX-License-Identifier: MIT
// Fills the left part of an image with a value that depends on the texel.
layout(local_size_x = 8, local_size_y = 8) in;
layout(set = 0, binding = 0, rgba16f) writeonly uniform image2D target;
layout(push_constant) uniform Push {
    vec4 value;
    uint columns;  // how many are written
    uint pad_0, pad_1, pad_2;
};

void main() {
    uvec2 p = gl_GlobalInvocationID.xy;
    if (any(greaterThanEqual(p, uvec2(imageSize(target)))) || p.x >= columns) return;
    imageStore(target, ivec2(p), value + vec4(p.x, p.y, 0.0, 0.0) / 64.0);
}
