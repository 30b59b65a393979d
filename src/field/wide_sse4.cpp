// SPDX-License-Identifier: MIT
// Points and rays through host bricks for SSE4.1: 4 lanes.

#include "field/wide_isa.h"

#include <immintrin.h>

namespace kiln::field::wide_sse4 {

constexpr int kLanes = 4;
typedef float F __attribute__((vector_size(16)));
typedef int32_t I __attribute__((vector_size(16)));

#include "field/wide_masks.inl"

#include "field/wide_vectors.inl"

#include "field/wide_four.inl"

static inline F floor(F a) { return (F)_mm_floor_ps((__m128)a); }

static inline I floor_to_int(F a) { return to_int(floor(a)); }

#include "field/wide_math.inl"

#include "field/wide_points.inl"

#include "field/wide_one.inl"

#include "field/wide_polish.inl"

#include "field/wide_rays.inl"

}  // namespace kiln::field::wide_sse4
