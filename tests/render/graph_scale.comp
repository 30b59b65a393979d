#version 460
// SPDX-License-Identifier: MIT
// An image in place; of one 32-bit channel, the only kind that every device both reads and writes.
layout(local_size_x = 8, local_size_y = 8) in;
layout(set = 0, binding = 0, r32f) uniform image2D target;

void main() {
    ivec2 p = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(p, imageSize(target)))) return;
    imageStore(target, p, 0.75 * imageLoad(target, p));
}
