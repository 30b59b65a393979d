#version 460
// SPDX-License-Identifier: MIT
// A buffer from another, with a uniform block between them.
layout(local_size_x = 16) in;
layout(set = 0, binding = 0, std430) readonly buffer Source { uint source[]; };
layout(set = 0, binding = 1, std140) uniform Params {
    uint factor;
    uint offset;
    uint pad_0, pad_1;
};
layout(set = 1, binding = 0, std430) writeonly buffer Target { uint target[]; };

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i < uint(target.length()) && i < uint(source.length())) target[i] = source[i] * factor + offset;
}
