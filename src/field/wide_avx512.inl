// SPDX-License-Identifier: MIT
// One register of AVX-512 (F, BW, DQ, VL): 16 lanes. Included inside a namespace.

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
static inline M below(I a, int32_t b) { return _mm512_cmplt_epu32_mask(i(a), _mm512_set1_epi32(b)); }  // both as uint32_t
static inline F select(M m, F a, F b) {
    __m512 out = _mm512_mask_blend_ps(m, f(b), f(a));
    asm("" : "+v"(out));
    return (F)out;
}
static inline I select(M m, I a, I b) {
    __m512i out = _mm512_mask_blend_epi32(m, i(b), i(a));
    asm("" : "+v"(out));
    return (I)out;
}
static inline M all() { return M(0xffff); }
static inline M none() { return M(0); }
static inline bool any(M m) { return m != 0; }
static inline M both(M a, M b) { return M(a & b); }
static inline M either(M a, M b) { return M(a | b); }
static inline M without(M a, M b) { return M(a & ~b); }
static inline F min(F a, F b) { return (F)_mm512_min_ps(f(b), f(a)); }  // as std::min
static inline F max(F a, F b) { return (F)_mm512_max_ps(f(b), f(a)); }
static inline F floor(F a) { return (F)_mm512_roundscale_ps(f(a), _MM_FROUND_TO_NEG_INF | _MM_FROUND_NO_EXC); }
static inline I floor_to_int(F a) {
    return (I)_mm512_cvt_roundps_epi32(f(a), _MM_FROUND_TO_NEG_INF | _MM_FROUND_NO_EXC);
}
static inline F sqrt(F a) { return (F)_mm512_sqrt_ps(f(a)); }
template <int kScale = 1>
static inline I gather_bytes(const void* base, I index) {
    return (I)_mm512_i32gather_epi32(i(index), base, kScale);
}
template <int kScale>
static inline I gather_bytes(M m, const void* base, I index, I others) {
    return (I)_mm512_mask_i32gather_epi32(i(others), m, i(index), base, kScale);
}
static inline int count(M m) { return __builtin_popcount(m); }
static inline uint32_t bits(M m) { return m; }
// Lanes of a mask moved to the front, in their order.
struct Packing {
    M m;
    explicit Packing(M of) : m(of) {}
    I operator()(I v) const { return (I)_mm512_maskz_compress_epi32(m, i(v)); }
    F operator()(F v) const { return (F)_mm512_maskz_compress_ps(m, f(v)); }
};

// See wide_avx2.cpp: of lanes k, k + 4, k + 8, k + 12.
static inline F rows_from(const float* const (&at)[kLanes], int k, int first) {
    const __m512 a = _mm512_insertf32x4(_mm512_castps128_ps512(_mm_load_ps(at[k] + first)), _mm_load_ps(at[k + 4] + first), 1);
    return (F)_mm512_insertf32x4(_mm512_insertf32x4(a, _mm_load_ps(at[k + 8] + first), 2), _mm_load_ps(at[k + 12] + first), 3);
}
static inline void rows_to(float* const (&at)[kLanes], int k, int first, F rows) {
    _mm_store_ps(at[k] + first, _mm512_castps512_ps128(f(rows)));
    _mm_store_ps(at[k + 4] + first, _mm512_extractf32x4_ps(f(rows), 1));
    _mm_store_ps(at[k + 8] + first, _mm512_extractf32x4_ps(f(rows), 2));
    _mm_store_ps(at[k + 12] + first, _mm512_extractf32x4_ps(f(rows), 3));
}
static inline F low_in_turns(F a, F b) { return (F)_mm512_unpacklo_ps(f(a), f(b)); }
static inline F high_in_turns(F a, F b) { return (F)_mm512_unpackhi_ps(f(a), f(b)); }
static inline F low_pairs(F a, F b) { return (F)_mm512_shuffle_ps(f(a), f(b), 0x44); }
static inline F high_pairs(F a, F b) { return (F)_mm512_shuffle_ps(f(a), f(b), 0xee); }

struct Pointers {
    __m512i low, high;  // of the first and the last eight lanes
};
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

#include "field/wide_vectors.inl"
