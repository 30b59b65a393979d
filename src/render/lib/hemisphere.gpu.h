// SPDX-License-Identifier: MIT
// Directions over a hemisphere, as often as a Lambert surface would send light there, spread evenly however many are taken.
//   Points of the unit square: the first two dimensions of Sobol's sequence (Sobol', 1967), a (0, 2)-sequence: of any 4^k that
//   follow one another from a multiple of 4^k on, each of the elementary intervals of area 4^-k has one (Kollig and Keller,
//   "Efficient Multidimensional Sampling", 2002). Square to disc: Shirley and Chiu, "A Low Distortion Map Between Disk and
//   Square", 1997; disc to hemisphere: straight up (Malley), which makes cosines of equal areas.

#ifndef KILN_RENDER_LIB_HEMISPHERE_GPU_H
#define KILN_RENDER_LIB_HEMISPHERE_GPU_H

#include "math/math.gpu.h"

#ifdef __cplusplus
namespace kiln::render::shade {
using namespace kiln::gpu;
#endif

// Point i, in [0, 1)². Its digits are those of i: the first backwards, the second times Pascal's triangle modulo 2.
KILN_FN vec2 sobol_point(uint i) {
    uint x = 0u;
    uint y = 0u;
    uint bit = 0x80000000u;
    uint row = 0x80000000u;
    for (uint rest = i; rest != 0u; rest = rest >> 1u) {
        if ((rest & 1u) != 0u) {
            x = x ^ bit;
            y = y ^ row;
        }
        bit = bit >> 1u;
        row = row ^ (row >> 1u);
    }
    return vec2(unit_float(x), unit_float(y));
}

// Equal areas of the unit square, [0, 1]², to equal areas of the unit disc.
KILN_FN vec2 disc_of_square(vec2 p) {
    float a = 2.0f * p.x - 1.0f;
    float b = 2.0f * p.y - 1.0f;
    bool along = abs(a) > abs(b);
    float r = along ? a : b;
    if (r == 0.0f) return vec2(0.0f, 0.0f);
    float angle = along ? 0.25f * kPi * (b / a) : 0.5f * kPi - 0.25f * kPi * (a / b);
    return vec2(r * cos(angle), r * sin(angle));
}

// Unit, around +Z.
KILN_FN vec3 cosine_direction(vec2 on_square) {
    vec2 d = disc_of_square(on_square);
    return vec3(d.x, d.y, sqrt(max(1.0f - d.x * d.x - d.y * d.y, 0.0f)));
}

#ifdef __cplusplus
}  // namespace kiln::render::shade
#endif

#endif
