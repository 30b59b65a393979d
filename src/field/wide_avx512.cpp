// SPDX-License-Identifier: MIT
// Points and rays through host bricks for AVX-512 (F, BW, DQ, VL): 16 lanes.

#include "field/wide_isa.h"

#include <immintrin.h>

#pragma GCC diagnostic ignored "-Wuninitialized"  // GCC 12: false alarms inside its own AVX-512 header (GCC bug 105593)
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"

namespace kiln::field::wide_avx512 {

constexpr int kLanes = 16;
typedef float F __attribute__((vector_size(64)));
typedef int32_t I __attribute__((vector_size(64)));
using M = __mmask16;

static inline __m512 f(F v) { return (__m512)v; }
static inline __m512i i(I v) { return (__m512i)v; }

static inline M lt(F a, F b) { return _mm512_cmp_ps_mask(f(a), f(b), _CMP_LT_OQ); }
static inline M le(F a, F b) { return _mm512_cmp_ps_mask(f(a), f(b), _CMP_LE_OQ); }
static inline M eq(F a, F b) { return _mm512_cmp_ps_mask(f(a), f(b), _CMP_EQ_OQ); }
static inline M lt(I a, I b) { return _mm512_cmplt_epi32_mask(i(a), i(b)); }
static inline M eq(I a, I b) { return _mm512_cmpeq_epi32_mask(i(a), i(b)); }
static inline F select(M m, F a, F b) { return (F)_mm512_mask_blend_ps(m, f(b), f(a)); }
static inline I select(M m, I a, I b) { return (I)_mm512_mask_blend_epi32(m, i(b), i(a)); }
static inline M all() { return M(0xffff); }
static inline M none() { return M(0); }
static inline bool any(M m) { return m != 0; }
static inline M both(M a, M b) { return M(a & b); }
static inline M either(M a, M b) { return M(a | b); }
static inline M without(M a, M b) { return M(a & ~b); }
static inline F min(F a, F b) { return (F)_mm512_min_ps(f(b), f(a)); }  // as std::min
static inline F max(F a, F b) { return (F)_mm512_max_ps(f(b), f(a)); }
static inline F floor(F a) { return (F)_mm512_roundscale_ps(f(a), _MM_FROUND_TO_NEG_INF | _MM_FROUND_NO_EXC); }
static inline F sqrt(F a) { return (F)_mm512_sqrt_ps(f(a)); }
static inline int count(M m) { return __builtin_popcount(m); }
static inline uint32_t bits(M m) { return m; }

struct Pointers {
    __m512i low, high;  // of the first and the last eight lanes
};
static inline Pointers same_pointer(const std::byte* p) {
    const __m512i all_of_it = _mm512_set1_epi64(reinterpret_cast<intptr_t>(p));
    return {all_of_it, all_of_it};
}
static inline Pointers select(M m, const Pointers& a, const Pointers& b) {
    return {_mm512_mask_blend_epi64(__mmask8(m), b.low, a.low),
            _mm512_mask_blend_epi64(__mmask8(m >> 8), b.high, a.high)};
}
static inline Pointers gather_pages(const WidePage* const* table, I index) {
    return {_mm512_i32gather_epi64(_mm512_castsi512_si256(i(index)), table, 8),
            _mm512_i32gather_epi64(_mm512_extracti64x4_epi64(i(index), 1), table, 8)};
}
static inline Pointers moved(const Pointers& p, I bytes) {
    return {_mm512_add_epi64(p.low, _mm512_cvtepi32_epi64(_mm512_castsi512_si256(i(bytes)))),
            _mm512_add_epi64(p.high, _mm512_cvtepi32_epi64(_mm512_extracti64x4_epi64(i(bytes), 1)))};
}
static inline Pointers gather_entries(const Pointers& at, I& flags) {
    const __m512i low = _mm512_i64gather_epi64(at.low, nullptr, 1), high = _mm512_i64gather_epi64(at.high, nullptr, 1);
    const __m512i odd = _mm512_setr_epi32(1, 3, 5, 7, 9, 11, 13, 15, 17, 19, 21, 23, 25, 27, 29, 31);
    flags = (I)_mm512_permutex2var_epi32(low, odd, high);
    const __m512i address = _mm512_set1_epi64(int64_t(kWideAddress));
    return {_mm512_and_si512(low, address), _mm512_and_si512(high, address)};
}
template <int kBytes>
static inline I gather_from(const Pointers& p) {
    const void* const base = reinterpret_cast<const void*>(ptrdiff_t(kBytes));
    const __m256i low = _mm512_i64gather_epi32(p.low, base, 1), high = _mm512_i64gather_epi32(p.high, base, 1);
    return (I)_mm512_inserti64x4(_mm512_castsi256_si512(low), high, 1);
}

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

#include "field/wide.inl"

}  // namespace kiln::field::wide_avx512
