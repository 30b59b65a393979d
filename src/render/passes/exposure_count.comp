#version 460
// SPDX-License-Identifier: MIT
// Histogram of a picture's log luminance.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#include "render/passes/exposure.gpu.h"

layout(local_size_x = kExposureGroup, local_size_y = kExposureGroup) in;

layout(set = 0, binding = 0) uniform texture2D radiance;
layout(set = 0, binding = 1, std430) buffer Histogram { uint histogram[]; };
layout(push_constant) uniform Push { ExposurePush push; };

shared uint counted[kExposureBins];

void main() {
    uint mine = gl_LocalInvocationIndex;
    counted[mine] = 0u;
    barrier();
    ivec2 first = ivec2(gl_WorkGroupID.xy) * kExposureGroup * kExposureStep + ivec2(gl_LocalInvocationID.xy);
    for (int i = 0; i < kExposureStep * kExposureStep; ++i) {
        ivec2 pixel = first + ivec2(i % kExposureStep, i / kExposureStep) * kExposureGroup;
        if (pixel.x < push.width && pixel.y < push.height) {
            atomicAdd(counted[exposure_bin(luminance(texelFetch(radiance, pixel, 0).rgb))], 1u);
        }
    }
    barrier();
    if (counted[mine] != 0u) atomicAdd(histogram[mine], counted[mine]);
}
