#version 460
// SPDX-License-Identifier: MIT
// Adds what it finds in an image to a buffer, in whole numbers so that the order does not matter.
#extension GL_EXT_samplerless_texture_functions : require
layout(local_size_x = 8, local_size_y = 8) in;
layout(set = 0, binding = 0) uniform texture2D source;
layout(set = 0, binding = 1, std430) buffer Sums { uint sums[]; };

void main() {
    ivec2 p = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(p, textureSize(source, 0)))) return;
    uvec4 bits = floatBitsToUint(texelFetch(source, p, 0));
    atomicAdd(sums[uint(p.x) % 16u], bits.x ^ bits.y ^ bits.z ^ bits.w);
}
