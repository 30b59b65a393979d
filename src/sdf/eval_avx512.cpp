// SPDX-License-Identifier: MIT
// The tape interpreter for AVX-512 (F, BW, DQ, VL): 16 lanes.

#include "sdf/eval_isa.h"

#include <immintrin.h>

#define KILN_LANES 16
#define KILN_VECTORS (64 / KILN_LANES)

namespace kiln::sdf::avx512 {
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
    const __m256i words = _mm512_maskz_cvtps_ph(0xffff, __m512(v), _MM_FROUND_TO_NEAREST_INT | _MM_FROUND_NO_EXC);
    __builtin_memcpy(to, &words, sizeof words);
}
static inline lane_f load_half_words(const uint16_t* from) {
    __m256i words;
    __builtin_memcpy(&words, from, sizeof words);
    return lane_f(_mm512_maskz_cvtph_ps(0xffff, words));
}
#include "sdf/eval_list.inl"
#include "sdf/expression_run.inl"
}  // namespace kiln::sdf::avx512
