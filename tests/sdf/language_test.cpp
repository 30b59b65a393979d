// SPDX-License-Identifier: MIT
// The words of the shape language in float: accuracy of the polynomials, ties, and integers.

#include "texts.h"

namespace kiln::sdf {
namespace {

TEST(Language, SineAndCosineAreWithinTheirStatedError) {
    double worst = 0;
    RandomValues random(1);
    for (int i = 0; i < 400000; ++i) {
        const float x = float(i % 2 == 0 ? random.in(-1e4, 1e4) : random.in(-7, 7));
        worst = std::max(worst, std::fabs(double(text32::sin_of(x)) - std::sin(double(x))));
        worst = std::max(worst, std::fabs(double(text32::cos_of(x)) - std::cos(double(x))));
    }
    EXPECT_LT(worst, 5e-7);
}

TEST(Language, ArcTangentIsWithinItsStatedErrorInEveryQuadrant) {
    double worst = 0;
    RandomValues random(2);
    for (int i = 0; i < 400000; ++i) {
        const float y = float(random.in(-1, 1) * std::pow(10, random.in(-6, 6)));
        const float x = float(random.in(-1, 1) * std::pow(10, random.in(-6, 6)));
        worst = std::max(worst, std::fabs(double(text32::atan_of(y, x)) - std::atan2(double(y), double(x))));
    }
    EXPECT_LT(worst, 4e-7);
    EXPECT_EQ(text32::atan_of(0.0f, 0.0f), 0.0f);
    EXPECT_NEAR(text32::atan_of(0.0f, -1.0f), M_PI, 4e-7);
    EXPECT_NEAR(text32::atan_of(1.0f, 0.0f), M_PI / 2, 4e-7);
    EXPECT_NEAR(text32::atan_of(-1.0f, 0.0f), -M_PI / 2, 4e-7);
}

TEST(Language, ExponentialAndLogarithmAreWithinTheirStatedErrorAndCutOffOutside) {
    double worst_exp = 0, worst_log = 0;
    RandomValues random(3);
    for (int i = 0; i < 400000; ++i) {
        const float x = float(i % 2 == 0 ? random.in(-87, 88) : random.in(-1, 1));
        worst_exp = std::max(worst_exp, std::fabs(double(text32::exp_of(x)) / std::exp(double(x)) - 1));
        const float y = float(i % 2 == 0 ? std::pow(10, random.in(-36, 37)) : random.in(0.5, 2));
        const double log = std::log(double(y));
        worst_log = std::max(worst_log, std::fabs(double(text32::log_of(y)) - log) / (1 + std::fabs(log)));
    }
    EXPECT_LT(worst_exp, 2e-7);
    EXPECT_LT(worst_log, 1e-7);
    EXPECT_EQ(text32::exp_of(-1e9f), text32::exp_of(-87.0f));
    EXPECT_EQ(text32::exp_of(1e9f), text32::exp_of(88.0f));
    EXPECT_EQ(text32::log_of(0.0f), text32::log_of(1e-37f));
    EXPECT_EQ(text32::log_of(-5.0f), text32::log_of(1e-37f));
    EXPECT_EQ(text32::log_of(1.0f), 0.0f);
    EXPECT_EQ(text32::exp_of(0.0f), 1.0f);
}

TEST(Language, MinAndMaxKeepTheirFirstOperandInATie) {
    EXPECT_TRUE(std::signbit(text32::min(-0.0f, 0.0f)));
    EXPECT_FALSE(std::signbit(text32::min(0.0f, -0.0f)));
    EXPECT_TRUE(std::signbit(text32::max(-0.0f, 0.0f)));
    EXPECT_FALSE(std::signbit(text32::max(0.0f, -0.0f)));
}

TEST(Language, WholesWrapWhenNegative) {
    EXPECT_EQ(text32::whole_of(-1.0f), 0xffffffffu);
    EXPECT_EQ(text32::whole_of(-1e9f), uint32_t(-1000000000));
    EXPECT_EQ(text32::real_of(16777215u), 16777215.0f);
}

}  // namespace
}  // namespace kiln::sdf
