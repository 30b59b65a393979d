#version 460
// SPDX-License-Identifier: MIT
// A level of the bloom pyramid from the finer one.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#include "render/passes/bloom.gpu.h"

layout(local_size_x = kBloomGroup, local_size_y = kBloomGroup) in;

layout(set = 0, binding = 0) uniform texture2D finer;
layout(set = 0, binding = 1) uniform sampler linear;
layout(set = 0, binding = 2, rgba16f) writeonly uniform image2D target;
layout(push_constant) uniform Push { BloomPush push; };

vec3 bloom_sample(vec2 at) { return textureLod(sampler2D(finer, linear), at / vec2(textureSize(finer, 0)), 0.0).rgb; }

#include "render/lib/bloom.gpu.h"

void main() {
    ivec2 texel = ivec2(gl_GlobalInvocationID.xy);
    if (texel.x >= push.width || texel.y >= push.height) return;
    imageStore(target, texel, vec4(bloom_down(2.0 * (vec2(texel) + 0.5)), 1.0));
}
