// SPDX-License-Identifier: MIT

#include "render/lib/tonemap.gpu.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

using namespace kiln::render::shade;
using kiln::vec3;

namespace {
const uint kAllCurves[] = {kToneMapNone, kToneMapExponential, kToneMapAces, kToneMapNeutral, kToneMapAgx};
}

// Gate G20.
TEST(ToneMap, GreysMatchTheTable) {
    const double rows[][5] = {{0.01, 0.00995, 0.00105, 0.00063, 0.00581}, {0.18, 0.16473, 0.10559, 0.14000, 0.21485},
                              {0.5, 0.39347, 0.37431, 0.46000, 0.42245},  {0.76, 0.53233, 0.52513, 0.72000, 0.51935},
                              {1, 0.63212, 0.61912, 0.87085, 0.58292},    {4, 0.98168, 0.90901, 0.98842, 0.84905},
                              {16, 1.0, 0.98994, 0.99885, 0.96036}};
    for (const auto& [x, exponential, aces, neutral, agx] : rows) {
        const vec3 c{float(x), float(x), float(x)};
        EXPECT_NEAR(tone_map(kToneMapExponential, c).y, exponential, 1e-4) << x;
        EXPECT_NEAR(tone_map(kToneMapAces, c).y, aces, 1e-4) << x;
        EXPECT_NEAR(tone_map(kToneMapNeutral, c).y, neutral, 1e-4) << x;
        EXPECT_NEAR(tone_map(kToneMapAgx, c).y, agx, 1e-4) << x;
        const vec3 grey = tone_map(kToneMapAgx, c);  // its matrices leave a tenth of a step of eight bits of colour
        EXPECT_LE(std::max({grey.x, grey.y, grey.z}) - std::min({grey.x, grey.y, grey.z}), 5e-4) << x;
    }
}

TEST(ToneMap, SaturatedColorsMatchTheTable) {
    const vec3 aces = tone_map(kToneMapAces, {4, 0.1f, 0.1f}), neutral = tone_map(kToneMapNeutral, {4, 0.1f, 0.1f});
    EXPECT_NEAR(aces.x, 1.0, 1e-4);
    EXPECT_NEAR(aces.y, 0.24097, 1e-4);
    EXPECT_NEAR(aces.z, 0.11856, 1e-4);
    EXPECT_NEAR(neutral.x, 0.98842, 1e-4);
    EXPECT_NEAR(neutral.y, 0.31898, 1e-4);
    EXPECT_NEAR(neutral.z, 0.31898, 1e-4);
}

TEST(ToneMap, NeutralKeepsBaseColorsBelowItsShoulder) {
    for (float x = 0.12f; x <= 0.76f; x += 0.02f) {
        const vec3 out = tone_map(kToneMapNeutral, {x, 0.1f, 0.2f});
        EXPECT_NEAR(out.x, x - 0.04f, 1e-6);
        EXPECT_NEAR(out.y, 0.06f, 1e-6);
        EXPECT_NEAR(out.z, 0.16f, 1e-6);
    }
}

TEST(ToneMap, IsMonotoneAndContinuousOnGreys) {
    for (const uint kind : kAllCurves) {
        double before = -1;
        for (double e = -10; e <= 10; e += 0.001) {
            const float x = float(std::exp2(e));
            const double y = tone_map(kind, {x, x, x}).x;
            // AgX's polynomial cancels to 1e-5 in floats: a thousandth of a display's step.
            EXPECT_GE(y, before - (kind == kToneMapAgx ? 2e-5 : 1e-6)) << "map " << kind << " at " << x;
            if (before >= 0) {
                EXPECT_LE(y - before, 1e-3 * (1 + x)) << "map " << kind << " jumps at " << x;
            }
            before = y;
        }
    }
}

TEST(ToneMap, StaysInGamutForAnyLight) {
    const float inf = std::numeric_limits<float>::infinity(), nan = std::numeric_limits<float>::quiet_NaN();
    const float values[] = {-inf, -1, 0, 1e-30f, 1e-4f, 0.05f, 0.5f, 0.8f, 1, 10, 1e4f, 65504, 1e20f, 3e38f, inf, nan};
    for (const uint kind : kAllCurves) {
        for (const float r : values) {
            for (const float g : values) {
                for (const float b : values) {
                    const vec3 c = tone_map(kind, {r, g, b});
                    EXPECT_TRUE(c.x >= 0 && c.x <= 1 && c.y >= 0 && c.y <= 1 && c.z >= 0 && c.z <= 1)
                        << "map " << kind << " of " << r << " " << g << " " << b << ": " << c.x << " " << c.y << " "
                        << c.z;
                }
            }
        }
    }
}
