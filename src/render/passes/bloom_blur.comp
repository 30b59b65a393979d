#version 460
// SPDX-License-Identifier: MIT
// One pass of the ping-pong Gaussian: along x or along y, at full size. The first takes the bright part of the picture alone.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#include "render/passes/bloom.gpu.h"
#include "render/lib/exposure.gpu.h"

layout(local_size_x = kBloomGroup, local_size_y = kBloomGroup) in;

layout(set = 0, binding = 0, std430) readonly buffer Exposure { ExposureState exposure; };
layout(set = 0, binding = 1) uniform texture2D from;
layout(set = 0, binding = 2, rgba16f) writeonly uniform image2D target;
layout(push_constant) uniform Push { BloomPush push; };

void main() {
    ivec2 texel = ivec2(gl_GlobalInvocationID.xy);
    if (texel.x >= push.width || texel.y >= push.height) return;
    vec3 sum = vec3(0.0);
    float weights = 0.0;
    for (int i = -kBlurReach; i <= kBlurReach; ++i) {
        ivec2 at = texel + (push.along_x != 0 ? ivec2(i, 0) : ivec2(0, i));
        vec3 c = texelFetch(from, clamp(at, ivec2(0), ivec2(push.width - 1, push.height - 1)), 0).rgb;
        c *= luminance(c) * exposure.multiplier >= push.threshold ? 1.0 : 0.0;
        float weight = exp(-0.125 * float(i * i));
        sum += c * weight;
        weights += weight;
    }
    imageStore(target, texel, vec4(sum / weights, 1.0));
}
