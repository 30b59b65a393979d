// SPDX-License-Identifier: MIT
// Points and rays through host bricks for AVX2: 8 lanes.

#include "field/wide_isa.h"

#include <immintrin.h>

namespace kiln::field::wide_avx2 {

constexpr int kLanes = 8;
typedef float F __attribute__((vector_size(32)));
typedef int32_t I __attribute__((vector_size(32)));

#include "field/wide_masks.inl"

#include "field/wide_vectors.inl"

static inline bool any(M m) { return _mm256_movemask_ps((__m256)m) != 0; }
static inline F min(F a, F b) { return (F)_mm256_min_ps((__m256)b, (__m256)a); }  // as std::min
static inline F max(F a, F b) { return (F)_mm256_max_ps((__m256)b, (__m256)a); }
static inline F floor(F a) { return (F)_mm256_floor_ps((__m256)a); }
static inline F sqrt(F a) { return (F)_mm256_sqrt_ps((__m256)a); }
template <int kScale = 1>
static inline I gather_bytes(const void* base, I index) {
    return (I)_mm256_i32gather_epi32(static_cast<const int*>(base), (__m256i)index, kScale);
}
template <int kScale>
static inline I gather_bytes(M m, const void* base, I index, I others) {
    return (I)_mm256_mask_i32gather_epi32((__m256i)others, static_cast<const int*>(base), (__m256i)index, (__m256i)m,
                                          kScale);
}
static inline uint32_t bits(M m) { return uint32_t(_mm256_movemask_ps((__m256)m)); }
static inline I widened(const uint8_t (&of)[kLanes]) {
    return (I)_mm256_cvtepu8_epi32(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(of)));
}
static inline int count(M m) { return __builtin_popcount(bits(m)); }

// Rows of four floats: those of lanes k and k + 4. In each half: the first two of a and b in turns, the last two; the first two of a, then
// of b, the last two.
static inline F rows_from(const float* const (&at)[kLanes], int k, int first) {
    return (F)_mm256_set_m128(_mm_load_ps(at[k + 4] + first), _mm_load_ps(at[k] + first));
}
static inline void rows_to(float* const (&at)[kLanes], int k, int first, F rows) {
    _mm_store_ps(at[k] + first, _mm256_castps256_ps128((__m256)rows));
    _mm_store_ps(at[k + 4] + first, _mm256_extractf128_ps((__m256)rows, 1));
}
static inline F low_in_turns(F a, F b) { return (F)_mm256_unpacklo_ps((__m256)a, (__m256)b); }
static inline F high_in_turns(F a, F b) { return (F)_mm256_unpackhi_ps((__m256)a, (__m256)b); }
static inline F low_pairs(F a, F b) { return (F)_mm256_shuffle_ps((__m256)a, (__m256)b, 0x44); }
static inline F high_pairs(F a, F b) { return (F)_mm256_shuffle_ps((__m256)a, (__m256)b, 0xee); }

struct Pointers {
    __m256i low, high;  // of the first and the last four lanes
};
static inline Pointers gather_pages(const WidePage* const* table, I index) {
    const auto* const from = reinterpret_cast<const long long*>(table);
    return {_mm256_i32gather_epi64(from, _mm256_castsi256_si128((__m256i)index), 8),
            _mm256_i32gather_epi64(from, _mm256_extracti128_si256((__m256i)index, 1), 8)};
}
static inline Pointers moved(const Pointers& p, I bytes) {
    return {_mm256_add_epi64(p.low, _mm256_cvtepi32_epi64(_mm256_castsi256_si128((__m256i)bytes))),
            _mm256_add_epi64(p.high, _mm256_cvtepi32_epi64(_mm256_extracti128_si256((__m256i)bytes, 1)))};
}
static inline Pointers gather_entries(const Pointers& at, I& flags) {
    const __m256i low = _mm256_i64gather_epi64(static_cast<const long long*>(nullptr), at.low, 1),
                  high = _mm256_i64gather_epi64(static_cast<const long long*>(nullptr), at.high, 1);
    // Odd halves of each 128 bits, then in order.
    const __m256 odd = _mm256_shuffle_ps(_mm256_castsi256_ps(low), _mm256_castsi256_ps(high), 0xdd);
    flags = (I)_mm256_permute4x64_epi64(_mm256_castps_si256(odd), 0xd8);
    const __m256i address = _mm256_set1_epi64x(int64_t(kWideAddress));
    return {_mm256_and_si256(low, address), _mm256_and_si256(high, address)};
}
template <int kBytes>
static inline I gather_from(const Pointers& p) {
    const auto* const base = reinterpret_cast<const int*>(ptrdiff_t(kBytes));
    return (I)_mm256_set_m128i(_mm256_i64gather_epi32(base, p.high, 1), _mm256_i64gather_epi32(base, p.low, 1));
}

// Halves of texels (0, 0) and (1, 0), (0, 1) and (1, 1) of this slice and the next, a word a pair, from where each lane's first one lies. Both pairs
// of a slice are in the 32 bytes that end with them, which never leave their brick: 12 bytes before its codes are its own too (brick_content.h).
// Gathers of so many lanes take processors far longer than loads of rows.
#define KILN_PAIRS_BY_ROWS
static inline void pairs_by_rows(const std::byte* const (&texel)[kLanes], I (&codes)[4]) {
    for (int z = 0; z < 2; ++z) {
        __m256i rows[kLanes];  // words 3 and 7 of each
        for (int lane = 0; lane < kLanes; ++lane)
            rows[lane] = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(texel[lane] + z * 128 - 12));
        const auto four = [&](int lane) {
            return _mm256_unpackhi_epi64(_mm256_unpackhi_epi32(rows[lane], rows[lane + 1]),
                                         _mm256_unpackhi_epi32(rows[lane + 2], rows[lane + 3]));
        };
        const __m256i low = four(0), high = four(4);
        codes[2 * z] = (I)_mm256_permute2x128_si256(low, high, 0x20);
        codes[2 * z + 1] = (I)_mm256_permute2x128_si256(low, high, 0x31);
    }
}

static inline I floor_to_int(F a) { return to_int(floor(a)); }

#include "field/wide_math.inl"

#include "field/wide_points.inl"

#include "field/wide_one.inl"

#include "field/wide_polish.inl"

#include "field/wide_rays.inl"

}  // namespace kiln::field::wide_avx2
