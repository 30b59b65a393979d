#version 460
// SPDX-License-Identifier: MIT
// A storage image read, another written.
layout(local_size_x = 8, local_size_y = 8) in;
layout(set = 0, binding = 0, rgba16f) readonly uniform image2D source;
layout(set = 0, binding = 1, rgba16f) writeonly uniform image2D target;

void main() {
    ivec2 p = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(p, imageSize(target)))) return;
    ivec2 last = imageSize(source) - 1;
    imageStore(target, p, imageLoad(source, clamp(last - p, ivec2(0), last)));
}
