// SPDX-License-Identifier: MIT
// Entry points of each instruction set, and what every wide_*.cpp includes before opening its namespace.
#pragma once

#include "field/brick_content.h"
#include "field/codes.gpu.h"
#include "field/ways.h"
#include "field/wide.h"

#include <bit>
#include <cmath>
#include <cstring>
#include <type_traits>

#define KILN_DECLARE_WIDE(name)                                                                 \
    namespace kiln::field::name {                                                               \
    float distance(const WideView& view, const vec3& p);                                        \
    void distances(const WideView& view, const sdf::Points& points, float* out);                \
    void march(const WideView& view, WideRay* rays, int count, MarchHit* hits, RayNote* notes); \
    void polish_looks(const RayPolish& rays, int count, float* x, float* y, float* z);          \
    int polish_steps(RayPolish& rays, int count, const float* metres);                          \
    void polish_places(RayPolish& rays, int count);                                             \
    }
KILN_DECLARE_WIDE(wide_scalar)
KILN_DECLARE_WIDE(wide_sse4)
KILN_DECLARE_WIDE(wide_avx2)
KILN_DECLARE_WIDE(wide_avx512)
#undef KILN_DECLARE_WIDE
