// SPDX-License-Identifier: MIT
// How much of the hemisphere over a visible point is open: which rays find out, and what kernels and C++ share of them; see ao.cpp.

#ifdef __cplusplus
#pragma once
#endif
#include "render/lib/hemisphere.gpu.h"
#ifdef __cplusplus
namespace kiln::render {
using shade::cosine_direction;
using shade::sobol_point;
using uint = uint32_t;
#endif

// The rays of kAoSide x kAoSide neighbouring points are one set, spread over the hemisphere. A point has AoPush::rays of them.
KILN_CONST int kAoSide = 4;
KILN_CONST uint kAoPoints = 16u;
KILN_CONST uint kAoMostRays = 8u;
// With pictures over time, so many sets follow one another: together they are one larger set.
KILN_CONST uint kAoPictures = 16u;

// Of the first word of a point (four words: this, its normal, t in finest voxels, 0): bits 0 … 7: rays that meet nothing.
KILN_CONST uint kAoOpen = 255u;            // its rays
KILN_CONST uint kAoSurface = 0x80000000u;  // something is seen there that has a hemisphere

struct AoPush {
    uint node_count;  // of the instances' tree
    uint picture;     // of a row over time
    uint every;       // pixel of a row, and row, has rays
    uint rays;        // of a point: 4 or 8
};

// Number of a ray of a point's, in the row of all: 4 x 4, 2 x 2 and single points have neighbouring numbers, so that each of them
// is spread as evenly as so few can be.
KILN_FN uint ao_number(int x, int y, uint picture, uint rays, uint ray) {
    uint u = uint(x);
    uint v = uint(y);
    uint place = (u & 1u) | ((v & 1u) << 1u) | ((u & 2u) << 1u) | ((v & 2u) << 2u);
    return ((picture & (kAoPictures - 1u)) * kAoPoints + place) * rays + ray;
}

// Its direction, unit, around +Z. Points of the sequence are corners of the intervals that they stand for; half an interval makes them middles.
KILN_FN vec3 ao_local_direction(uint number, uint rays) {
    vec2 p = sobol_point(number);
    float half_interval = 0.5f / float(kAoPoints * rays);
    float x = p.x + half_interval;
    float y = p.y + half_interval;
    return cosine_direction(vec2(x < 1.0f ? x : x - 1.0f, y < 1.0f ? y : y - 1.0f));
}

#ifdef __cplusplus
static_assert(sizeof(AoPush) == 16 && kAoPoints == kAoSide * kAoSide);
}  // namespace kiln::render
#endif
