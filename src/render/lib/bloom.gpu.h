// SPDX-License-Identifier: MIT
// The two filters of the bloom pyramid, threshold-free: every texel's light goes on whole, so a picture keeps its energy and a spark that
// moves by less than a pixel keeps its glow (Jimenez, "Next Generation Post Processing in Call of Duty: Advanced Warfare", 2014).
//
// A text that includes this first declares `vec3 bloom_sample(vec2 at)`: the finer or coarser image, linear between texels, its edges
// continued; `at` in texels, the middle of the first at 0.5. C++ includes it inside a class; so it has no guard.

#ifndef __cplusplus
#include "math/math.gpu.h"
#endif

// A texel of half the size, from `at`, its middle in texels of the finer image: five squares of 4 x 4 texels that overlap, the middle one
// counting half.
KILN_FN vec3 bloom_down(vec2 at) {
    vec3 inner = splat3(0.0f);
    vec3 edges = splat3(0.0f);
    vec3 corners = splat3(0.0f);
    for (int i = 0; i < 4; i++) {
        float x = (i & 1) == 0 ? -1.0f : 1.0f;
        float y = i < 2 ? -1.0f : 1.0f;
        inner = inner + bloom_sample(vec2(at.x + x, at.y + y));
        corners = corners + bloom_sample(vec2(at.x + 2.0f * x, at.y + 2.0f * y));
        edges = edges + bloom_sample(vec2(at.x + (i < 2 ? 2.0f * x : 0.0f), at.y + (i < 2 ? 0.0f : 2.0f * x)));
    }
    return inner * 0.125f + bloom_sample(at) * 0.125f + edges * 0.0625f + corners * 0.03125f;
}

// A texel of twice the size, from `at`, its middle in texels of the coarser image: a tent of three texels each way.
KILN_FN vec3 bloom_up(vec2 at) {
    vec3 sum = bloom_sample(at) * 4.0f;
    for (int i = 0; i < 4; i++) {
        float x = (i & 1) == 0 ? -1.0f : 1.0f;
        float y = i < 2 ? -1.0f : 1.0f;
        sum = sum + bloom_sample(vec2(at.x + x, at.y + y));
        sum = sum + bloom_sample(vec2(at.x + (i < 2 ? x : 0.0f), at.y + (i < 2 ? 0.0f : x))) * 2.0f;
    }
    return sum * 0.0625f;
}
