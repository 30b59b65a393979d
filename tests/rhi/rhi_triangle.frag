#version 460
// SPDX-License-Identifier: MIT
layout(location = 0) in vec3 shade;
layout(location = 0) out vec4 color;
layout(push_constant) uniform Push { float brightness; } push;
void main() { color = vec4(shade * push.brightness, 1.0); }
