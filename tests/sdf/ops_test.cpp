// SPDX-License-Identifier: MIT
// The kernel and the three operations made of it, against the closed form of the scene format.

#include "texts.h"

#include "sdf/program.h"

namespace kiln::sdf {
namespace {

// h = max(k - |a - b|, 0) / k; smin = min(a, b) - h² k / 4.
double closed_smin(double a, double b, double k) {
    const double h = k > 0 ? std::max(k - std::fabs(a - b), 0.0) / k : 0;
    return std::min(a, b) - h * h * k / 4;
}

double closed(Op op, double a, double b, double k) {
    switch (op) {
    case Op::Union:
        return closed_smin(a, b, k);
    case Op::Subtract:
        return -closed_smin(-a, b, k);
    default:
        return -closed_smin(-a, -b, k);
    }
}

constexpr Op kOps[] = {Op::Union, Op::Subtract, Op::Intersect};

struct Operands {
    double a, b, k;
    explicit Operands(RandomValues& random)
        : a(random.in(-2, 2)),
          b(random.one_in(4) ? a : random.in(-2, 2)),
          k(random.one_in(4) ? 0 : random.in(0.01, 3)) {}
};

TEST(Ops, AreTheClosedForm) {
    for_all("closed form", [](RandomValues& random) {
        const Operands o(random);
        for (Op op : kOps) {
            RC_ASSERT(std::fabs(text64::op_distance(uint32_t(op), o.a, o.b, o.k) - closed(op, o.a, o.b, o.k)) < 1e-14);
            const double f = double(text32::op_distance(uint32_t(op), float(o.a), float(o.b), float(o.k)));
            RC_ASSERT(std::fabs(f - closed(op, o.a, o.b, o.k)) < 1e-6);
        }
    });
}

TEST(Ops, ShareIsTheDerivativeByTheSecondOperand) {
    for_all("share", [](RandomValues& random) {
        const Operands o(random);
        const double h = 1e-6;
        if (std::fabs(std::fabs(o.a - o.b) - o.k) < 1e-4 || std::fabs(o.a - o.b) < 1e-4) return;  // kinks
        if (std::fabs(o.a + o.b) < 1e-4 || std::fabs(std::fabs(o.a + o.b) - o.k) < 1e-4) return;  // kinks of subtract
        for (Op op : kOps) {
            const auto at = [&](double a, double b) { return text64::op_distance(uint32_t(op), a, b, o.k); };
            const double by_a = (at(o.a + h, o.b) - at(o.a - h, o.b)) / (2 * h);
            const double by_b = std::fabs((at(o.a, o.b + h) - at(o.a, o.b - h)) / (2 * h));
            const double share = text64::op_share(uint32_t(op), o.a, o.b, o.k);
            RC_ASSERT(std::fabs(by_b - share) < 1e-6);
            RC_ASSERT(std::fabs(by_a + by_b - 1) < 1e-6);  // a convex combination: 1-Lipschitz operands stay so
        }
    });
}

TEST(Ops, TwoEqualOperandsShareHalfWhenSmooth) {
    EXPECT_EQ(text32::op_share(0, 0.3f, 0.3f, 0.5f), 0.5f);
    EXPECT_EQ(text32::op_share(0, 0.3f, 0.3f, 0.0f), 0.0f) << "a hard tie goes to the first";
}

TEST(Ops, ScaleWithTheirOperands) {
    for_all("smin(s a, s b, s k) = s smin(a, b, k)", [](RandomValues& random) {
        const Operands o(random);
        const double s = random.in(0.1, 10);
        for (Op op : kOps) {
            const double scaled = text64::op_distance(uint32_t(op), s * o.a, s * o.b, s * o.k);
            RC_ASSERT(std::fabs(scaled - s * text64::op_distance(uint32_t(op), o.a, o.b, o.k)) < 1e-13 * s * 4);
        }
    });
}

TEST(Ops, BeyondTheBlendKeepTheBitsOfTheHardOperation) {
    for_all("no blend where |a - b| >= k", [](RandomValues& random) {
        const float a = float(random.in(-2, 2));
        const float k = float(random.in(0, 1));
        const float b = a + (random.one_in(2) ? 1.0f : -1.0f) * (k + float(random.in(1e-3, 1)));
        RC_ASSERT(text32::op_distance(0, a, b, k) == std::min(a, b));
        RC_ASSERT(text32::op_distance(2, a, b, k) == std::max(a, b));
        RC_ASSERT(text32::op_distance(1, a, -b, k) == std::max(a, b));
    });
}

TEST(Ops, EmptySpaceIsNeutral) {
    for (float k : {0.0f, 0.1f, 10.0f}) {
        EXPECT_EQ(text32::op_distance(0, kEmpty, 0.25f, k), 0.25f);
        EXPECT_EQ(text32::op_distance(1, kEmpty, 0.25f, k), kEmpty);
        EXPECT_EQ(text32::op_distance(2, kEmpty, 0.25f, k), kEmpty);
    }
}

}  // namespace
}  // namespace kiln::sdf
