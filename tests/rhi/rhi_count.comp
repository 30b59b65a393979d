#version 460
// SPDX-License-Identifier: MIT
// Test kernel: every thread counts itself; the first writes the next dispatch's group counts.
layout(local_size_x = 32) in;
layout(set = 0, binding = 0, std430) buffer Counter { uint total; } counter;
layout(set = 0, binding = 1, std430) buffer Next { uint groups[3]; } next;
layout(push_constant) uniform Push { uint groups_x; } push;
void main() {
    atomicAdd(counter.total, 1u);
    if (gl_GlobalInvocationID.x == 0u) {
        next.groups[0] = push.groups_x;
        next.groups[1] = 2u;
        next.groups[2] = 1u;
    }
}
