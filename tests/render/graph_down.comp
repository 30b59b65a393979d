#version 460
// SPDX-License-Identifier: MIT
// One mip from another.
#extension GL_EXT_samplerless_texture_functions : require
layout(local_size_x = 8, local_size_y = 8) in;
layout(set = 0, binding = 0) uniform texture2D source;
layout(set = 0, binding = 1, rgba16f) writeonly uniform image2D target;

void main() {
    ivec2 p = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(p, imageSize(target)))) return;
    ivec2 last = textureSize(source, 0) - 1;
    imageStore(target, p, 0.5 * (texelFetch(source, min(2 * p, last), 0) + texelFetch(source, min(2 * p + 1, last), 0)));
}
