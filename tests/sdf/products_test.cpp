// SPDX-License-Identifier: MIT
// Roots and quotients that are found by products have the bits of those that the processor divides for, and bricks whose numbers are
// beyond the bounds of that have them too.
#include "random_scenes.h"
#include "rounds.h"
#include "sdf/eval.h"

#include <gtest/gtest.h>

#include <immintrin.h>

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>

namespace kiln::sdf {
namespace {

// The texts of both widths. Which of so many answers differ from the processor's.
#define KILN_PRODUCTS
#define KILN_LANES 16
#pragma GCC push_options
#pragma GCC target("avx512f,avx512bw,avx512dq,avx512vl")
namespace sixteen {
#include "sdf/lang/simd.h"

uint32_t wrong_roots(const float* x) {
    const __m512 from = _mm512_loadu_ps(x), expected = _mm512_maskz_sqrt_ps(0xffff, from);
    return _mm512_cmpneq_epi32_mask(_mm512_castps_si512(expected), __m512i(sqrt(real(lane_f(from))).v));
}
uint32_t wrong_quotients(const float* n, float k) {
    const __m512 from = _mm512_loadu_ps(n), expected = _mm512_div_ps(from, _mm512_set1_ps(k));
    return _mm512_cmpneq_epi32_mask(_mm512_castps_si512(expected), __m512i(part_of(real(lane_f(from)), k).v));
}
}  // namespace sixteen
#pragma GCC pop_options
#undef KILN_LANES
#undef KILN_SDF
#undef KILN_C
#define KILN_LANES 8
#pragma GCC push_options
#pragma GCC target("avx2,fma,f16c")
namespace eight {
#include "sdf/lang/simd.h"

uint32_t others(__m256 a, __m256 b) {
    const __m256i same = _mm256_cmpeq_epi32(_mm256_castps_si256(a), _mm256_castps_si256(b));
    return 0xffu & ~uint32_t(_mm256_movemask_ps(_mm256_castsi256_ps(same)));
}
uint32_t wrong_roots(const float* x) {
    const __m256 from = _mm256_loadu_ps(x);
    return others(_mm256_sqrt_ps(from), __m256(sqrt(real(lane_f(from))).v));
}
// From inverses that are off by as much as any processor's estimate may be, or by part of it.
uint32_t wrong_roots_from_afar(const float* x) {
    const __m256 from = _mm256_loadu_ps(x);
    const lane_f root = lane_f(_mm256_sqrt_ps(from));
    uint32_t wrong = 0;
    for (const float off : {-0x1.8p-12f, -0x1.1p-13f, 0.0f, 0x1.7p-14f, 0x1.8p-12f})
        wrong |= others(__m256(root), __m256(sqrt_from(real(lane_f(from)), real((1 + off) / root)).v));
    return wrong;
}
uint32_t wrong_quotients(const float* n, float k) {
    const __m256 from = _mm256_loadu_ps(n);
    return others(_mm256_div_ps(from, _mm256_set1_ps(k)), __m256(part_of(real(lane_f(from)), k).v));
}
}  // namespace eight
#pragma GCC pop_options
#undef KILN_LANES
#undef KILN_PRODUCTS
#undef KILN_SDF
#undef KILN_C

// fn(numbers), as many as lanes, of all mantissas of some exponents. Two binades have all roots there are; what is four times as large has twice the root.
template <size_t kLanes, typename Fn>
void each_number(Fn&& fn) {
    for (const uint32_t exponent : {127u - 90, 127u - 89, 126u, 127u, 127u + 98, 127u + 99}) {
        for (uint32_t mantissa = 0; mantissa < 1u << 23; mantissa += uint32_t(kLanes) * (kSanitized ? 8 : 1)) {
            std::array<float, kLanes> x;
            for (uint32_t i = 0; i < kLanes; ++i) x[i] = std::bit_cast<float>(exponent << 23 | (mantissa + i));
            ASSERT_EQ(fn(x.data()), 0u) << "from " << x[0];
        }
    }
}

// fn(parts, whole) of a blend, as many as lanes.
template <size_t kLanes, typename Fn>
void each_part(Fn&& fn) {
    Random random(7);
    for (int round = 0; round < 3000; ++round) {
        // Of all sizes; often with the mantissas that quotients are hardest with.
        float k = std::ldexp(random.in(1, 2), random.below(118) - 59);
        if (round % 5 == 0)
            k = std::bit_cast<float>((std::bit_cast<uint32_t>(k) | 0x7fffffu) - uint32_t(random.below(3)));
        if (round % 7 == 0)
            k = std::bit_cast<float>((std::bit_cast<uint32_t>(k) & ~0x7fffffu) + uint32_t(random.below(3)));
        for (int at = 0; at < 200; ++at) {
            std::array<float, kLanes> n;
            for (float& part : n) {
                const float off =
                    at % 3 == 0 ? k * (1 - std::ldexp(random.in(0, 1), -random.below(24))) : k * random.in(0, 1);
                part = std::fmax(k - off, 0.0f);
            }
            ASSERT_EQ(fn(n.data(), k), 0u) << "k " << k;
        }
    }
}

TEST(Products, EveryRootHasTheProcessorsBits) {
    if (!has_isa(Isa::Avx2)) GTEST_SKIP() << "no AVX2";
    const std::array<float, 16> zeros{};
    each_number<8>(eight::wrong_roots);
    EXPECT_EQ(eight::wrong_roots(zeros.data()), 0u);
    if (!has_isa(Isa::Avx512)) return;
    each_number<16>(sixteen::wrong_roots);
    EXPECT_EQ(sixteen::wrong_roots(zeros.data()), 0u);
}

TEST(Products, RootsDoNotAskMuchOfTheEstimateTheyBeginWith) {
    if (!has_isa(Isa::Avx2)) GTEST_SKIP() << "no AVX2";
    each_number<8>(eight::wrong_roots_from_afar);
}

TEST(Products, EveryPartOfABlendHasTheProcessorsBits) {
    if (!has_isa(Isa::Avx2)) GTEST_SKIP() << "no AVX2";
    each_part<8>(eight::wrong_quotients);
    if (has_isa(Isa::Avx512)) each_part<16>(sixteen::wrong_quotients);
}

TEST(Products, BricksOfAnySizeHaveTheScalarBits) {
    for (uint32_t seed = 0; seed < 200; ++seed) {
        Random random(seed);
        const float size = std::ldexp(1.0f, random.below(160) - 100);
        std::vector<Edit> edits(4);
        for (Edit& e : edits) {
            const vec3 half{random.in(0.1f, 0.4f) * size, random.in(0.1f, 0.4f) * size, random.in(0.1f, 0.4f) * size};
            if (random.below(2) == 0) {
                e.node.shape = Sphere{.radius = half.x};
            } else {
                e.node.shape = Box{.half_extents = half};
            }
            const vec3 at = random.point(0.5f);
            // Some middles nearly on an axis: squares of such numbers have no room.
            e.node.transform.position = {random.below(3) == 0 ? 1e-30f : at.x * size, at.y * size, at.z * size};
            e.blend_radius = random.below(2) == 0 ? 0.0f : 0.2f * size;
        }
        const Result<Program> program = compile({edits, {}, {}});
        ASSERT_TRUE(program) << program.error().message;
        std::array<float, 8> x, y, z;
        for (size_t i = 0; i < 8; ++i) {
            x[i] = (float(i) - 4) * 0.05f * size;
            y[i] = (float(i) - 3) * 0.05f * size;
            z[i] = (float(i) - 2) * 0.05f * size;
        }
        const TapeView tape = view(*program);
        std::array<float, 512> expected, got;
        const float least = evaluate_brick(tape, x.data(), y.data(), z.data(), expected.data(), Isa::Scalar);
        for (const Isa isa : {Isa::Sse4, Isa::Avx2, Isa::Avx512}) {
            if (!has_isa(isa)) continue;
            EXPECT_EQ(evaluate_brick(tape, x.data(), y.data(), z.data(), got.data(), isa), least) << "seed " << seed;
            for (size_t i = 0; i < 512; ++i)
                ASSERT_EQ(std::bit_cast<uint32_t>(got[i]), std::bit_cast<uint32_t>(expected[i]))
                    << "seed " << seed << " isa " << int(isa) << " size " << size;
        }
    }
}

}  // namespace
}  // namespace kiln::sdf
