#version 460
// SPDX-License-Identifier: MIT
// Test kernel: a 3D R16Float storage texture filled with x + 10 y + 100 z.
layout(local_size_x = 4, local_size_y = 4, local_size_z = 4) in;
layout(set = 0, binding = 0, r16f) uniform writeonly image3D volume;
void main() {
    ivec3 p = ivec3(gl_GlobalInvocationID);
    if (all(lessThan(p, imageSize(volume)))) imageStore(volume, p, vec4(float(p.x + 10 * p.y + 100 * p.z)));
}
