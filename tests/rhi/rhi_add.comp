#version 460
// SPDX-License-Identifier: MIT
// Test kernel: out = in * scale + offset, over a whole buffer.
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, std430) readonly buffer Input { uint values[]; } source;
layout(set = 0, binding = 1, std430) buffer Output { uint values[]; } target;
layout(push_constant) uniform Push { uint scale; uint offset; uint count; uint pad; } push;
void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i < push.count) target.values[i] = source.values[i] * push.scale + push.offset;
}
