// SPDX-License-Identifier: MIT
// Points through host bricks for AVX-512: 16 lanes.

#include "field/wide_isa.h"

#include <immintrin.h>

#pragma GCC diagnostic ignored "-Wuninitialized"  // GCC 12: false alarms inside its own AVX-512 header (GCC bug 105593)
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"

namespace kiln::field::wide_avx512 {

#include "field/wide_avx512.inl"

#include "field/wide_math.inl"

// A slice of a brick in registers: any of its 64 codes is looked up without a read. 32 lanes of 16 bits: codes at x, then at x + 1.
#define KILN_WIDE_SLICES
struct SliceTable {
    __m512i low, high;
};
template <bool Half>
static inline SliceTable slice_table(const std::byte* codes) {
    if constexpr (Half) {
        return {_mm512_loadu_si512(codes), _mm512_loadu_si512(codes + 64)};
    } else {
        const auto wide = [codes](int at) {
            return _mm512_cvtepi8_epi16(_mm256_loadu_si256(reinterpret_cast<const __m256i*>(codes + at)));
        };
        return {wide(0), wide(32)};
    }
}
struct Words {
    __m512i v;
};
static inline Words pair_of(I texel) {
    const __m256i x = _mm512_cvtepi32_epi16(i(texel));
    return {_mm512_inserti64x4(_mm512_castsi256_si512(x), _mm256_add_epi16(x, _mm256_set1_epi16(1)), 1)};
}
static inline Words looked_up(const SliceTable& table, Words texel, int offset, M m, Words others) {
    const __mmask32 both = __mmask32(m) | __mmask32(m) << 16;
    const __m512i at = _mm512_add_epi16(texel.v, _mm512_set1_epi16(short(offset)));
    return {_mm512_mask_blend_epi16(both, others.v, _mm512_permutex2var_epi16(table.low, at, table.high))};
}
template <bool Half>
static inline void values_of(Words codes, F& a, F& b) {
    const __m256i x = _mm512_castsi512_si256(codes.v), next = _mm512_extracti64x4_epi64(codes.v, 1);
    if constexpr (Half) {
        a = (F)_mm512_cvtph_ps(x);
        b = (F)_mm512_cvtph_ps(next);
    } else {
        const __m512i least = _mm512_set1_epi32(-127), step = _mm512_castps_si512(_mm512_set1_ps(kSnorm8StepVoxels));
        a = (F)_mm512_mul_ps(_mm512_cvtepi32_ps(_mm512_max_epi32(_mm512_cvtepi16_epi32(x), least)),
                             _mm512_castsi512_ps(step));
        b = (F)_mm512_mul_ps(_mm512_cvtepi32_ps(_mm512_max_epi32(_mm512_cvtepi16_epi32(next), least)),
                             _mm512_castsi512_ps(step));
    }
}

#include "field/wide_points.inl"

#include "field/wide_one.inl"

#include "field/wide_polish.inl"

}  // namespace kiln::field::wide_avx512
