// SPDX-License-Identifier: MIT
#include "field/codes.gpu.h"
#include "sdf/eval.h"
#include "worlds.h"

#include <cmath>
#include <limits>

namespace kiln::field {
namespace {

// The compiler's own conversion, which rounds to nearest even.
uint16_t half_bits(float v) {
    const _Float16 half = static_cast<_Float16>(v);
    return std::bit_cast<uint16_t>(half);
}

TEST(Codes, HalvesAreRoundedToNearestEven) {
    for (uint32_t bits = 0x38800000u; bits <= 0x40800000u; bits += 97) {  // 2^-14 … 4
        const float v = std::bit_cast<float>(bits);
        ASSERT_EQ(half_code(v), half_bits(v)) << v;
        ASSERT_EQ(half_code(-v), half_bits(-v)) << -v;
    }
    // Ties, both ways.
    for (uint32_t code = 0x0400; code < 0x4400; ++code) {
        const float v = half_value(code), next = half_value(code + 1);
        ASSERT_EQ(half_code(v), code);
        ASSERT_EQ(half_code(0.5f * (v + next)), (code & 1u) == 0 ? code : code + 1) << code;
        ASSERT_EQ(half_value(half_code(-v)), -v);
    }
}

TEST(Codes, LanesMakeTheSameHalves) {
    std::vector<float> values{0.0f,
                              -0.0f,
                              4.0f,
                              -4.0f,
                              1e30f,
                              -1e30f,
                              std::numeric_limits<float>::quiet_NaN(),
                              std::numeric_limits<float>::infinity(),
                              1e-30f,
                              -1e-30f,
                              6.1e-5f,
                              -6.2e-5f};
    for (uint32_t bits = 0x33000000u; bits <= 0x40900000u; bits += 6151) {
        values.push_back(std::bit_cast<float>(bits));
        values.push_back(-values.back());
    }
    for (uint32_t code = 0x0400; code < 0x4400; ++code)
        values.push_back(0.5f * (half_value(code) + half_value(code + 1)));
    while (values.size() % 64 != 0) values.push_back(1);
    std::vector<uint16_t> codes(values.size());
    std::vector<uint64_t> solid(values.size() / 64);
    const float scale = 3.7f;
    for (const sdf::Isa isa : {sdf::Isa::Scalar, sdf::Isa::Sse4, sdf::Isa::Avx2, sdf::Isa::Avx512}) {
        if (!sdf::has_isa(isa)) continue;
        for (const float by : {1.0f, scale}) {
            sdf::store_halves(values, by, kBandVoxels, kHalfStepVoxels, codes.data(), solid.data(), isa);
            for (size_t i = 0; i < values.size(); ++i) {
                ASSERT_EQ(codes[i], half_code(values[i] * by)) << values[i] << " isa " << int(isa);
                ASSERT_EQ((solid[i / 64] >> (i % 64) & 1u) != 0, half_value(codes[i]) <= 0)
                    << values[i] << " isa " << int(isa);
            }
        }
    }
}

TEST(Codes, Snorm8IsRoundedToNearestEven) {
    for (int i = -500000; i <= 500000; ++i) {
        const float v = float(i) * 8e-6f;
        int expected = int(std::nearbyint(std::min(std::max(v * 31.75f, -127.0f), 127.0f)));
        if (expected == 0 && v != 0) expected = v < 0 ? -1 : 1;
        ASSERT_EQ(int(int8_t(snorm8_code(v))), expected) << v;
        ASSERT_NEAR(snorm8_value(snorm8_code(v)), double(expected) * 4 / 127, 1e-6);
    }
    for (int k = 0; k < 126; k += 2) {
        const float tie = (float(k) + 0.5f) / 31.75f;
        if (tie * 31.75f == float(k) + 0.5f && k > 0) {
            EXPECT_EQ(snorm8_code(tie), uint32_t(k));
        }
    }
}

TEST(Codes, TheSignNeverChangesAndTheZeroSetNeverGrows) {
    worlds::Random r(1);
    for (int i = 0; i < 200000; ++i) {
        const float v = std::ldexp(r.in(-1, 1), -r.below(60));
        for (const float stored : {stored_half(v), stored_snorm8(v)}) {
            ASSERT_EQ(stored < 0, v < 0) << v;
            ASSERT_EQ(stored == 0, v == 0) << v;
        }
    }
    for (const float zero : {0.0f, -0.0f}) {
        EXPECT_EQ(half_code(zero), 0u);
        EXPECT_EQ(snorm8_code(zero), 0u);
    }
    const float tiny = std::numeric_limits<float>::denorm_min();
    EXPECT_EQ(half_code(tiny), 0x0400u);
    EXPECT_EQ(half_code(-tiny), 0x8400u);
    EXPECT_EQ(snorm8_code(-1e-30f), 255u);
}

TEST(Codes, ClampsToTheBand) {
    const float infinity = std::numeric_limits<float>::infinity();
    for (const float v : {4.0f, 4.001f, 1e30f, infinity, std::numeric_limits<float>::quiet_NaN()}) {
        EXPECT_EQ(stored_half(v), 4.0f) << v;
        EXPECT_NEAR(stored_snorm8(v), 4.0f, 1e-6f) << v;
    }
    EXPECT_EQ(stored_half(-1e30f), -4.0f);
    EXPECT_NEAR(stored_snorm8(-infinity), -4.0f, 1e-6f);
    EXPECT_EQ(snorm8_value(128), snorm8_value(129)) << "-128 reads as -127, as hardware has it";
}

TEST(Codes, MaterialWordsRoundTrip) {
    for (uint32_t a = 0; a < 16; ++a) {
        for (uint32_t b = 0; b < 16; ++b) {
            for (int i = 0; i <= 255; ++i) {
                const float share = float(i) / 510.0f;
                const uint32_t word = material_word(a, b, share);
                ASSERT_LE(word, 0xffffu);
                ASSERT_EQ(material_slot0(word), a);
                ASSERT_EQ(material_slot1(word), b);
                ASSERT_NEAR(material_share(word), share, 1e-6f);
            }
        }
    }
    EXPECT_EQ(material_word(1, 2, 0.9f), material_word(1, 2, 0.5f));
    EXPECT_EQ(material_word(1, 2, -1.0f), material_word(1, 2, 0.0f));
}

}  // namespace
}  // namespace kiln::field
