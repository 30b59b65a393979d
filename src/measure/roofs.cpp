// SPDX-License-Identifier: MIT
#include "measure/roofs.h"

#include "measure/contest.h"
#include "sdf/eval.h"

#include <cstdint>
#include <cstring>
#include <immintrin.h>

#pragma GCC diagnostic ignored "-Wuninitialized"  // GCC 12: false alarms inside its own AVX-512 header (GCC bug 105593)
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"

namespace kiln::measure {
namespace {

constexpr int kLoops = 200000;
constexpr int kChains = 12;  // independent operations that hide each other's latency

// Keeps a vector alive without a store.
template <typename V>
inline void keep(V& v) {
    asm volatile("" : "+x"(v));
}
template <typename V>
inline void keep_wide(V& v) {
    asm volatile("" : "+v"(v));
}

__attribute__((target("avx512f"))) void roots_avx512() {
    __m512 v[kChains];
    for (auto& one : v) one = _mm512_set1_ps(2);
    for (int i = 0; i < kLoops; ++i) {
        for (auto& one : v) one = _mm512_sqrt_ps(one);
    }
    for (auto& one : v) keep_wide(one);
}
__attribute__((target("avx512f"))) void flops_avx512() {
    __m512 v[kChains];
    const __m512 a = _mm512_set1_ps(0.999f);
    for (auto& one : v) one = _mm512_set1_ps(1);
    for (int i = 0; i < kLoops; ++i) {
        for (auto& one : v) one = _mm512_fmadd_ps(one, a, a);
    }
    for (auto& one : v) keep_wide(one);
}
__attribute__((target("avx512f"))) void gathers_avx512(const float* table) {
    __m512i at = _mm512_mullo_epi32(_mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15),
                                    _mm512_set1_epi32(13));
    __m512 sum = _mm512_setzero_ps();
    for (int i = 0; i < kLoops; ++i) {
        sum = _mm512_add_ps(sum, _mm512_i32gather_ps(at, table, 4));
        keep_wide(at);
    }
    keep_wide(sum);
}

__attribute__((target("avx2,fma"))) void roots_avx2() {
    __m256 v[kChains];
    for (auto& one : v) one = _mm256_set1_ps(2);
    for (int i = 0; i < kLoops; ++i) {
        for (auto& one : v) one = _mm256_sqrt_ps(one);
    }
    for (auto& one : v) keep(one);
}
__attribute__((target("avx2,fma"))) void flops_avx2() {
    __m256 v[kChains];
    const __m256 a = _mm256_set1_ps(0.999f);
    for (auto& one : v) one = _mm256_set1_ps(1);
    for (int i = 0; i < kLoops; ++i) {
        for (auto& one : v) one = _mm256_fmadd_ps(one, a, a);
    }
    for (auto& one : v) keep(one);
}
__attribute__((target("avx2,fma"))) void gathers_avx2(const float* table) {
    __m256i at = _mm256_setr_epi32(0, 13, 26, 39, 52, 65, 78, 91);
    __m256 sum = _mm256_setzero_ps();
    for (int i = 0; i < kLoops; ++i) {
        sum = _mm256_add_ps(sum, _mm256_i32gather_ps(table, at, 4));
        keep(at);
    }
    keep(sum);
}

void roots_sse() {
    __m128 v[kChains];
    for (auto& one : v) one = _mm_set1_ps(2);
    for (int i = 0; i < kLoops; ++i) {
        for (auto& one : v) one = _mm_sqrt_ps(one);
    }
    for (auto& one : v) keep(one);
}
void flops_sse() {
    __m128 v[kChains];
    const __m128 a = _mm_set1_ps(0.999f);
    for (auto& one : v) one = _mm_set1_ps(1);
    for (int i = 0; i < kLoops; ++i) {
        for (auto& one : v) one = _mm_add_ps(_mm_mul_ps(one, a), a);
    }
    for (auto& one : v) keep(one);
}
void loads_sse(const float* table) {
    for (int i = 0; i < kLoops; ++i) {
        for (int k = 0; k < 4; ++k) {
            float v = table[(i * 13 + k * 7) & 255];
            asm volatile("" : "+x"(v));
        }
    }
}

Roofs measured() {
    alignas(64) float table[256];
    for (int i = 0; i < 256; ++i) table[i] = float(i);
    const sdf::Isa isa = sdf::best_isa();
    const bool avx512 = isa == sdf::Isa::Avx512, avx2 = isa == sdf::Isa::Avx2;
    const double lanes = avx512 ? 16 : avx2 ? 8 : 4;
    const auto roots = avx512 ? roots_avx512 : avx2 ? roots_avx2 : roots_sse;
    const auto flops = avx512 ? flops_avx512 : avx2 ? flops_avx2 : flops_sse;
    const auto loads = avx512 ? gathers_avx512 : avx2 ? gathers_avx2 : loads_sse;
    const std::vector<double> least =
        least_seconds(7, {[&] { return seconds_of(roots); }, [&] { return seconds_of(flops); },
                          [&] { return seconds_of([&] { loads(table); }); }});
    return {lanes * kChains * kLoops / least[0], 2 * lanes * kChains * kLoops / least[1], lanes * kLoops / least[2]};
}

}  // namespace

const Roofs& roofs() {
    static const Roofs once = measured();
    return once;
}

}  // namespace kiln::measure
