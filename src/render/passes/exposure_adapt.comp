#version 460
// SPDX-License-Identifier: MIT
// From a histogram to the exposure of this picture.
#extension GL_GOOGLE_include_directive : require
#include "render/passes/exposure.gpu.h"

layout(local_size_x = kExposureBins) in;

layout(set = 0, binding = 0, std430) readonly buffer Histogram { uint histogram[]; };
layout(set = 0, binding = 1, std430) buffer Exposure { ExposureState exposure; };
layout(push_constant) uniform Push { ExposurePush push; };

shared float counts[kExposureBins];

void main() {
    counts[gl_LocalInvocationIndex] = float(histogram[gl_LocalInvocationIndex]);
    barrier();
    if (gl_LocalInvocationIndex != 0u) return;
    float lit = 0.0;
    for (int bin = 1; bin < kExposureBins; ++bin) lit += counts[bin];
    float before = 0.0;
    float shares = 0.0;
    float sum = 0.0;
    for (int bin = 1; bin < kExposureBins; ++bin) {
        float share = exposure_share(before, counts[bin], lit);
        shares += share;
        sum += share * exposure_stops(bin);
        before += counts[bin];
    }
    float measured = shares > 0.0 ? sum / shares : kExposureLowest - 1.0;
    exposure = exposure_after(exposure, measured, push.seconds, push.correction);
}
