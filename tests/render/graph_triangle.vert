#version 460
// SPDX-License-Identifier: MIT
// Covers the lower left half of the target.
layout(push_constant) uniform Push {
    vec4 color;
    float depth;
    float pad_0, pad_1, pad_2;
};

void main() {
    vec2 corner = vec2(gl_VertexIndex == 1 ? 1.0 : -1.0, gl_VertexIndex == 2 ? 1.0 : -1.0);
    gl_Position = vec4(corner, depth, 1.0);
}
