#version 460
// SPDX-License-Identifier: MIT
layout(push_constant) uniform Push {
    vec4 color;
    float depth;
    float pad_0, pad_1, pad_2;
};
layout(location = 0) out vec4 target;

void main() { target = color; }
