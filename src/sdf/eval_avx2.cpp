// SPDX-License-Identifier: MIT
// The tape interpreter for AVX2 (with FMA and F16C): 8 lanes.

#include "sdf/eval_isa.h"

#include <immintrin.h>

#define KILN_LANES 8
#define KILN_VECTORS (64 / KILN_LANES)

namespace kiln::sdf::avx2 {
#include "sdf/eval_texts.inl"

// The same texts, whose roots are found by products: to the same bits, and beside others that wait for the divider.
#define KILN_PRODUCTS
namespace products {
#include "sdf/eval_texts.inl"
}  // namespace products

static inline real load(const float* from) {
    lane_f v;
    __builtin_memcpy(&v, from, sizeof v);
    return v;
}
static inline void store(float* to, real v) { __builtin_memcpy(to, &v.v, sizeof v.v); }

#include "sdf/eval_lanes.inl"

#define KILN_FEW
namespace few {  // the same on sixteen points
#undef KILN_VECTORS
#define KILN_VECTORS (16 / KILN_LANES)
#include "sdf/eval_lanes.inl"
#undef KILN_VECTORS
#define KILN_VECTORS (64 / KILN_LANES)
}  // namespace few

#include "sdf/eval_entry.inl"

#define KILN_HALVES
static inline void store_half_words(uint16_t* to, lane_f v) {
    const __m128i words = _mm256_cvtps_ph(__m256(v), _MM_FROUND_TO_NEAREST_INT);
    __builtin_memcpy(to, &words, sizeof words);
}
static inline lane_f load_half_words(const uint16_t* from) {
    __m128i words;
    __builtin_memcpy(&words, from, sizeof words);
    return lane_f(_mm256_cvtph_ps(words));
}
#include "sdf/eval_list.inl"
#include "sdf/expression_run.inl"
}  // namespace kiln::sdf::avx2
