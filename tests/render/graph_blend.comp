#version 460
// SPDX-License-Identifier: MIT
// Half of one image, filtered, and half of another, texel by texel.
#extension GL_EXT_samplerless_texture_functions : require
layout(local_size_x = 8, local_size_y = 8) in;
layout(set = 0, binding = 0) uniform texture2D a;
layout(set = 0, binding = 1) uniform sampler linear;
layout(set = 0, binding = 2) uniform texture2D b;
layout(set = 0, binding = 3, rgba16f) writeonly uniform image2D target;

void main() {
    ivec2 p = ivec2(gl_GlobalInvocationID.xy);
    ivec2 size = imageSize(target);
    if (any(greaterThanEqual(p, size))) return;
    vec4 one = textureLod(sampler2D(a, linear), (vec2(p) + 0.5) / vec2(size), 0.0);
    vec4 other = texelFetch(b, min(p, textureSize(b, 0) - 1), 0);
    imageStore(target, p, 0.5 * one + 0.5 * other);
}
