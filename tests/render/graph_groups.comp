#version 460
// SPDX-License-Identifier: MIT
// Group counts for an indirect dispatch, out of a buffer's first word.
layout(local_size_x = 1) in;
layout(set = 0, binding = 0, std430) readonly buffer Source { uint source[]; };
layout(set = 0, binding = 1, std430) writeonly buffer Groups { uint groups[3]; };

void main() {
    groups[0] = 1u + source[0] % 4u;
    groups[1] = 1u;
    groups[2] = 1u;
}
