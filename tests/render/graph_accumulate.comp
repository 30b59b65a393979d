#version 460
// SPDX-License-Identifier: MIT
// One buffer onto another.
layout(local_size_x = 16) in;
layout(set = 0, binding = 0, std430) readonly buffer Source { uint source[]; };
layout(set = 0, binding = 1, std430) buffer Target { uint target[]; };

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i < uint(target.length()) && i < uint(source.length())) target[i] = target[i] * 3u + source[i];
}
