#version 460
// SPDX-License-Identifier: MIT
// A triangle whose right angle is in the lower left corner of the picture (+y up in clip space).
layout(location = 0) in vec2 at_clip;
layout(location = 1) in vec3 color;
layout(location = 0) out vec3 shade;
void main() {
    gl_Position = vec4(at_clip, 0.5, 1.0);
    shade = color;
}
