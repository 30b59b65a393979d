// SPDX-License-Identifier: MIT
// Points and rays through host bricks for every x86-64 processor: 4 lanes.

#include "field/wide_isa.h"

#include <immintrin.h>

namespace kiln::field::wide_scalar {

constexpr int kLanes = 4;
typedef float F __attribute__((vector_size(16)));
typedef int32_t I __attribute__((vector_size(16)));

#include "field/wide_masks.inl"

#include "field/wide_vectors.inl"

#include "field/wide_four.inl"

// For |a| < 2^31, which positions in a grid are.
static inline F floor(F a) {
    const F down = __builtin_convertvector(__builtin_convertvector(a, I), F);
    return down > a ? down - 1.0f : down;
}

static inline I floor_to_int(F a) { return to_int(floor(a)); }

#include "field/wide_math.inl"

#include "field/wide_points.inl"

#include "field/wide_one.inl"

#include "field/wide_polish.inl"

#include "field/wide_rays.inl"

}  // namespace kiln::field::wide_scalar
