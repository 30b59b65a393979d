// SPDX-License-Identifier: MIT
// Formulas: the text and the .vm reader against independent evaluators, intervals against samples, and the shape `expression` on the
// tape against the judge, over every instruction set, pruned and whole.

#include "feed.h"
#include "formulas.h"

#include "sdf/eval.h"
#include "sdf/expression_code.h"
#include "sdf/judge.h"
#include "sdf/prune.h"

#include <kiln/shapes.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <limits>

namespace kiln::sdf {
namespace {

Formula parsed(const std::string& text) {
    auto formula = parse_formula(text);
    EXPECT_TRUE(formula) << text << "\n" << (formula ? "" : formula.error().message);
    return formula ? std::move(*formula) : Formula{{FormulaNode{}}};
}

Edit edit_of(const std::string& text, vec3 half_extents = {1, 1, 1}, float lipschitz = 0) {
    Edit edit;
    edit.node.shape = Expression{.expression = text, .lipschitz = lipschitz, .half_extents = half_extents};
    return edit;
}

Result<Program> compiled(const Edit& edit) { return compile({std::span(&edit, 1), {}, {}}); }

// A formula whose operands all stay alive: the sum of many products, taken in an order that no allocator can shorten.
struct ManyAlive {
    std::string names, value;
    std::string text() const { return names + value; }
};
ManyAlive many_alive(int count) {
    std::string names, sum = "0", mirror = "0";
    for (int i = 0; i < count; ++i) {
        const std::string n = std::to_string(i);
        names += "a" + n + " = sin(" + n + "*x + y);";
        sum = "max(" + sum + ", a" + n + ")";
        mirror = "min(" + mirror + " + 0.01*z, a" + std::to_string(count - 1 - i) + ")";
    }
    return {names, sum + " + " + mirror};
}

// ---- Text.

struct Known {
    const char* text;
    double value;
};

class EachText : public testing::TestWithParam<Known> {};
TEST_P(EachText, HasItsValue) {
    // At the point (0.5, -2, 3).
    EXPECT_NEAR(evaluate(parsed(GetParam().text), {0.5, -2, 3}), GetParam().value,
                1e-6 * (1 + std::fabs(GetParam().value)))
        << GetParam().text;
}
INSTANTIATE_TEST_SUITE_P(
    Formula, EachText,
    testing::Values(Known{"1 + 2*3", 7}, Known{"(1 + 2)*3", 9}, Known{"8/2/2", 2}, Known{"8 - 2 - 2", 4},
                    Known{"-x^2", -0.25}, Known{"2^3^2", 512}, Known{"2^-2", 0.25}, Known{"-2*-y", -4},
                    Known{"+x", 0.5}, Known{"x - -y", -1.5}, Known{"- - x", 0.5}, Known{"1e2 + .5", 100.5},
                    Known{"p.x + p.y + p.z", 1.5}, Known{"p.zyx.x", 3}, Known{"length(p.xz)", std::sqrt(9.25)},
                    Known{"length(vec2(3, 4))", 5}, Known{"length(-3)", 3}, Known{"dot(p, vec3(1, 2, 3))", 5.5},
                    Known{"cross(vec3(1, 0, 0), vec3(0, 1, 0)).z", 1},
                    Known{"cross(p, vec3(1, 2, 3)).y", 3 * 1 - 0.5 * 3}, Known{"normalize(vec3(0, 3, 4)).z", 0.8},
                    Known{"distance(p, vec3(0.5, -2, 0))", 3}, Known{"max(p, 0).x + max(p, 0).y", 0.5},
                    Known{"(p*2).z", 6}, Known{"(p + p).y", -4}, Known{"(2/p).x", 4}, Known{"min(3, 1, 2)", 1},
                    Known{"max(y, x, z, 0)", 3}, Known{"mod(-0.5, 2)", 1.5}, Known{"mod(5, 3)", 2},
                    Known{"floor(-0.5)", -1}, Known{"ceil(-0.5)", 0}, Known{"round(2.5)", 3},
                    Known{"fract(-0.25)", 0.75}, Known{"clamp(y, -1, 1)", -1}, Known{"mix(1, 3, x)", 2},
                    Known{"smoothstep(0, 1, x)", 0.5}, Known{"smin(1, 1, 0.4)", 0.9}, Known{"smax(1, 1, 0.4)", 1.1},
                    Known{"smin(1, 5, 0.4)", 1}, Known{"sqrt(y)", 0}, Known{"square(y)", 4}, Known{"pow(z, 4)", 81},
                    Known{"pow(z, 0.5)", std::sqrt(3.0)}, Known{"z^1.5", std::pow(3.0, 1.5)}, Known{"z^0", 1},
                    Known{"z^-1", 1.0 / 3}, Known{"exp(1)", std::exp(1.0)}, Known{"log(z)", std::log(3.0)},
                    Known{"ln(z)", std::log(3.0)}, Known{"tan(x)", std::tan(0.5)}, Known{"asin(x)", std::asin(0.5)},
                    Known{"acos(x)", std::acos(0.5)}, Known{"atan(y)", std::atan(-2.0)},
                    Known{"atan2(y, x)", std::atan2(-2.0, 0.5)}, Known{"cos(pi)", -1}, Known{"abs(y)", 2},
                    Known{"r = length(p.xz); h = y + 1; r*h", -std::sqrt(9.25)}, Known{"a = 2; b = a*a; a + b", 6}));

TEST(Formula, TextEqualsAnEvaluatorOfItsOwn) {
    for (uint32_t seed = 0; seed < 400; ++seed) {
        FormulaMaker make(seed);
        const RandomFormula one = make.make(5, false);
        const Formula formula = parsed(one.text);
        for (int i = 0; i < 20; ++i) {
            const double x = make.in(-2, 2), y = make.in(-2, 2), z = make.in(-2, 2);
            const double expected = one.value(x, y, z);
            const double got = evaluate(formula, {x, y, z});
            // A constant rounded to float may fall on the other side of a jump: jumps aside, values agree.
            if (one.text.find("floor") != std::string::npos || one.text.find("mod") != std::string::npos ||
                one.text.find("atan2") != std::string::npos)
                continue;
            ASSERT_NEAR(got, expected, 2e-6 * (1 + std::fabs(expected))) << one.text << " seed " << seed;
        }
    }
}

TEST(Formula, EqualPartsAreOneNodeAndConstantsAreFolded) {
    EXPECT_EQ(parsed("sin(x*y) + sin(y*x)*sin(x*y)").nodes.size(), 6u);  // x y * sin square +
    EXPECT_EQ(parsed("2*3 + pi*0").nodes.size(), 1u);
    EXPECT_EQ(parsed("a = length(p); 0*1 + 5").nodes.size(), 1u);
    EXPECT_EQ(parsed("min(x, x)").nodes.size(), 1u);
}

struct WrongFormula {
    const char* text;
    const char* place;
    const char* what;
    const char* mend;
};
class EachWrongText : public testing::TestWithParam<WrongFormula> {};
TEST_P(EachWrongText, IsAnErrorWithPlaceAndMend) {
    const auto formula = parse_formula(GetParam().text);
    ASSERT_FALSE(formula) << GetParam().text;
    const std::string& message = formula.error().message;
    EXPECT_TRUE(message.starts_with(std::string(GetParam().place) + ": ")) << message;
    EXPECT_NE(message.find(GetParam().what), std::string::npos) << message;
    EXPECT_NE(message.find(GetParam().mend), std::string::npos) << message;
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
}
INSTANTIATE_TEST_SUITE_P(
    Formula, EachWrongText,
    testing::Values(WrongFormula{"", "1:1", "a value is missing before the end", "write one"},
                    WrongFormula{"x +", "1:4", "a value is missing before the end", "write one"},
                    WrongFormula{"x + * y", "1:5", "a value is missing before \"*\"", "write one"},
                    WrongFormula{"x\n  + q", "2:5", "there is no name \"q\"", "use x y z p pi"},
                    WrongFormula{"sine(x)", "1:1", "there is no function \"sine\"", "did you mean \"sin\"?"},
                    WrongFormula{"lenght(p) - 1", "1:1", "there is no function \"lenght\"", "did you mean \"length\"?"},
                    WrongFormula{"frobnicate(x)", "1:1", "there is no function \"frobnicate\"", "use abs sqrt"},
                    WrongFormula{"radius = 1; length(p) - radiu", "1:25", "there is no name \"radiu\"",
                                 "did you mean \"radius\"?"},
                    WrongFormula{"sin x", "1:4", "sin is a function", "in brackets"},
                    WrongFormula{"sin(x, y)", "1:1", "sin has 2 operands", "takes 1 operand"},
                    WrongFormula{"min(x)", "1:1", "min has 1 operand", "takes 2 or more"},
                    WrongFormula{"sin()", "1:5", "has no operands", "takes 1"},
                    WrongFormula{"(x + 1", "1:1", "not closed", "add \")\""},
                    WrongFormula{"x + 1)", "1:6", "no bracket is open", "take \")\" out"},
                    WrongFormula{"x, y", "1:2", "a comma outside", "take it out"},
                    WrongFormula{"(x, y)", "1:3", "a comma outside", "take it out"},
                    WrongFormula{"2x", "1:2", "follows a number", "write *"},
                    WrongFormula{"x y", "1:3", "is not an operator", "use + - * / ^"},
                    WrongFormula{"x % 2", "1:3", "is not an operator", "use + - * / ^"},
                    WrongFormula{"p", "1:1", "a vector of 3", "one number"},
                    WrongFormula{"p.w", "1:2", "no component", "use .x"},
                    WrongFormula{"x.y", "1:2", "of a number", "take it out"},
                    WrongFormula{"p.xy.z", "1:5", "vector of 2", "no such component"},
                    WrongFormula{"p.", "1:2", "follow a dot", "p.x"},
                    WrongFormula{"(p + vec2(1, 2)).x", "1:4", "a vector of 3 meets a vector of 2", "same size"},
                    WrongFormula{"vec3(p, 1, 2).x", "1:6", "made of numbers", "one component"},
                    WrongFormula{"1/0", "1:2", "no finite number", "change"},
                    WrongFormula{"x/0", "1:2", "no finite number", "change"},
                    WrongFormula{"1e40", "1:1", "out of range", "below 1e30"},
                    WrongFormula{"1e20 * 1e20", "1:6", "no finite number", "change"},
                    WrongFormula{"a = 1;", "1:7", "missing", "write one"},
                    WrongFormula{"a = 1", "1:6", "nothing follows", "end it with"},
                    WrongFormula{"x = 1; x", "1:1", "has a meaning", "choose another"},
                    WrongFormula{"a = 1; a = 2; a", "1:8", "has a meaning", "choose another"},
                    WrongFormula{"x; y", "1:2", "stands alone", "name"},
                    WrongFormula{"cross(p.xy, p).x", "1:1", "two vectors of 3", "vec3"},
                    WrongFormula{"é", "1:1", "a value is missing before \"é\"", "write one"},
                    WrongFormula{"1 + é", "1:5", "a value is missing", "write one"},
                    WrongFormula{"x ? 1", "1:3", "is not an operator", "use"}));

TEST(Formula, NestingIsLimitedByMemoryOnly) {
    const size_t deep = 100000;
    EXPECT_DOUBLE_EQ(evaluate(parsed(std::string(deep, '(') + "x" + std::string(deep, ')')), {0.5, 0, 0}), 0.5);
    EXPECT_DOUBLE_EQ(evaluate(parsed(std::string(deep, '-') + "x"), {0.5, 0, 0}), 0.5);
    std::string sums, calls;
    for (int i = 0; i < 20000; ++i) {
        sums += "(x + ";
        calls += "sin(";
    }
    EXPECT_NEAR(evaluate(parsed(sums + "x" + std::string(20000, ')')), {0.5, 0, 0}), 10000.5, 1e-6);
    EXPECT_TRUE(parse_formula(calls + "x" + std::string(20000, ')')));
    // Deep code compiles, and needs no more registers than any other.
    Edit edit = edit_of(sums + "y*x - 7" + std::string(20000, ')'));
    const auto program = compiled(edit);
    ASSERT_TRUE(program) << program.error().message;
    EXPECT_NEAR(
        evaluate(view(*program), dvec3{0.25, 0, 0}),
        std::max((5000.0 - 7) / double((*prepare_formula(edit.node.shape.data, {1, 1, 1}, 0))->lipschitz), -0.75),
        1e-4);
    // Too much of it is an error.
    std::string many;
    for (int i = 0; i < 110000; ++i) many += "sin(x + " + std::to_string(i) + ") + ";
    const auto full = parse_formula(many + "1");
    ASSERT_FALSE(full);
    EXPECT_NE(full.error().message.find("more than 100000 operations"), std::string::npos);
}

TEST(Formula, AnyBytesAreReadOrRefusedWithAPlace) {
    const std::string start =
        "r = length(p.xz) - 0.5; g = max(abs(y), -2.5e-1*sin(8*x)); smin(r, g, 0.1) + atan2(y, x)^2";
    const std::string letters = "xyzp.+-*/^(),;= 0123456789esincoqrtab\n\t\"#\\%";
    std::mt19937 random(7);
    int accepted = 0;
    for (int i = 0; i < 20000; ++i) {
        std::string text = start.substr(0, random() % (start.size() + 1));
        if (i % 2 == 0) text += start.substr(random() % start.size());
        for (auto n = random() % 6; n > 0 && !text.empty(); --n) {
            const size_t at = random() % text.size();
            if (random() % 3 == 0) {
                text.erase(at, 1 + random() % 4);
            } else {
                text.insert(at, 1, random() % 4 == 0 ? char(random() % 256) : letters[random() % letters.size()]);
            }
        }
        const auto formula = parse_formula(text);
        accepted += formula ? 1 : 0;
        ASSERT_EQ(formula_complaint(formula), "");
    }
    EXPECT_GT(accepted, 50);
}

// ---- .vm models.

TEST(Model, LinesComputeWhatTheySay) {
    const auto model = read_vm(
        "# a drop\n_0 var-x\n_1 var-y\n_2 var-z\n_3 square _0\n_4 square _1\n_5 add _3 _4\n_6 square _2\n"
        "_7 add _5 _6\n\n_8 sqrt _7   # radius\n_9 const 1.5\n_a sub _8 _9\n_b neg _a\n_c abs _b\n_d sin _0\n_e cos "
        "_1\n"
        "_f mul _d _e\n_10 exp _f\n_11 ln _10\n_12 max _c _11\n_13 const 3\n_14 min _12 _13\n_15 div _14 _13\n"
        "_16 floor _0\n_17 mod _0 _13\n_18 atan2 _17 _13\n_19 add _18 _15\n_1a add _19 _16\n");
    ASSERT_TRUE(model) << model.error().message;
    FormulaMaker random(1);
    for (int i = 0; i < 100; ++i) {
        const double x = random.in(-3, 3), y = random.in(-3, 3), z = random.in(-3, 3);
        const double drop = std::max(std::fabs(std::sqrt(x * x + y * y + z * z) - 1.5), std::sin(x) * std::cos(y));
        const double expected = std::atan2(x - 3 * std::floor(x / 3), 3) + std::min(drop, 3.0) / 3 + std::floor(x);
        EXPECT_NEAR(evaluate(*model, {x, y, z}), expected, 1e-12);
    }
}

TEST(Model, OrderOfLinesAndNamesDoNotMatterBeyondTheLast) {
    const auto model = read_vm("foo var-x\r\nunused const 7\r\nlast neg foo\r\n");
    ASSERT_TRUE(model);
    EXPECT_EQ(model->nodes.size(), 2u);
    EXPECT_EQ(evaluate(*model, {3, 0, 0}), -3);
}

class EachWrongModel : public testing::TestWithParam<WrongFormula> {};
TEST_P(EachWrongModel, IsAnErrorWithPlaceAndMend) {
    const auto model = read_vm(GetParam().text);
    ASSERT_FALSE(model) << GetParam().text;
    const std::string& message = model.error().message;
    EXPECT_TRUE(message.starts_with(std::string(GetParam().place) + ": ")) << message;
    EXPECT_NE(message.find(GetParam().what), std::string::npos) << message;
    EXPECT_NE(message.find(GetParam().mend), std::string::npos) << message;
}
INSTANTIATE_TEST_SUITE_P(
    Model, EachWrongModel,
    testing::Values(WrongFormula{"", "1:1", "no operation", "write lines"},
                    WrongFormula{"# only this\n", "1:1", "no operation", "write lines"},
                    WrongFormula{"_0 var-x\n_1", "2:3", "\"_1\" has no operation", "write"},
                    WrongFormula{"_0 frob", "1:4", "no operation \"frob\"", "use one of"},
                    WrongFormula{"_0 var-x\n_1 squre _0", "2:4", "no operation \"squre\"", "did you mean \"square\"?"},
                    WrongFormula{"_0 var-x\n_1 add _0", "2:10", "add takes 2 operands, here are 1", "2 operands"},
                    WrongFormula{"_0 var-x\n_1 neg _0 _0", "2:11", "neg takes 1 operand, here are 2", "1 operand"},
                    WrongFormula{"_0 add _1 _2", "1:8", "no value \"_1\" above", "lines before"},
                    WrongFormula{"_0 var-x\n_0 var-y", "2:1", "named twice", "another name"},
                    WrongFormula{"_0 const x", "1:10", "no number", "write"},
                    WrongFormula{"_0 const 1e39", "1:10", "no number below", "write"},
                    WrongFormula{"_0 const 0\n_1 const 1\n_2 div _1 _0", "3:1", "no finite", "change"},
                    WrongFormula{"_0 var-x 3", "1:10", "takes 0 operands", "0"},
                    WrongFormula{"_0 var-x\n_1 max _0 _0 _0 _0", "2:14", "more than 2", "takes 2"}));

TEST(Model, AnyBytesAreReadOrRefusedWithAPlace) {
    const std::string start = "_0 const 2.95\n_1 var-x\n_2 mul _1 _0\n_3 sqrt _2\n_4 max _3 _1\n# note\n_5 sub _4 _0\n";
    const std::string letters = "_0123456789abcdef \n\tconstvar-xyzmulsqrtmaxsub.e#\r";
    std::mt19937 random(8);
    int accepted = 0;
    for (int i = 0; i < 20000; ++i) {
        std::string text = start.substr(0, random() % (start.size() + 1));
        for (auto n = random() % 4; n > 0 && !text.empty(); --n) {
            const size_t at = random() % text.size();
            if (random() % 3 == 0) {
                text.erase(at, 1 + random() % 4);
            } else {
                text.insert(at, 1, random() % 4 == 0 ? char(random() % 256) : letters[random() % letters.size()]);
            }
        }
        const auto model = read_vm(text);
        accepted += model ? 1 : 0;
        ASSERT_EQ(formula_complaint(model), "");
    }
    EXPECT_GT(accepted, 50);
}

// ---- Intervals and slopes.

TEST(FormulaRange, HoldsEveryValueAndEverySlope) {
    for (uint32_t seed = 0; seed < 600; ++seed) {
        FormulaMaker make(5000 + seed);
        const Formula formula = parsed(make.make(5, seed % 2 == 0).text);
        const float size = float(std::pow(10, make.in(-2, 0.3)));
        const vec3 middle{float(make.in(-2, 2)), float(make.in(-2, 2)), float(make.in(-2, 2))};
        const Box3 box{middle - vec3{size, size, size} * 0.5f, middle + vec3{size, size, size} * 0.5f};
        const FormulaRange range = range_over(formula, box);
        for (int i = 0; i < 40; ++i) {
            double at[3], to[3];
            const double lo[3] = {double(box.min.x), double(box.min.y), double(box.min.z)},
                         hi[3] = {double(box.max.x), double(box.max.y), double(box.max.z)};
            for (int k = 0; k < 3; ++k) {
                at[k] = make.in(lo[k], hi[k]);
                to[k] = make.in(lo[k], hi[k]);
            }
            const double value = evaluate(formula, {at[0], at[1], at[2]});
            ASSERT_GE(value, range.low) << "seed " << seed;
            ASSERT_LE(value, range.high) << "seed " << seed;
            // Secants: along an axis they lie between the partial slopes, anywhere below the steepest.
            for (size_t k = 0; k < 3; ++k) {
                double other[3] = {at[0], at[1], at[2]};
                other[k] = to[k];
                const double rise = evaluate(formula, {other[0], other[1], other[2]}) - value, run = to[k] - at[k];
                const double error = 1e-11 * (1 + std::fabs(value));
                if (run > 0) {
                    ASSERT_GE(rise, range.slope_low[k] * run - error) << "seed " << seed << " axis " << k;
                    ASSERT_LE(rise, range.slope_high[k] * run + error) << "seed " << seed << " axis " << k;
                }
            }
            const double gap = std::sqrt((at[0] - to[0]) * (at[0] - to[0]) + (at[1] - to[1]) * (at[1] - to[1]) +
                                         (at[2] - to[2]) * (at[2] - to[2]));
            ASSERT_LE(std::fabs(evaluate(formula, {to[0], to[1], to[2]}) - value),
                      range.steepest * gap + 1e-11 * (1 + std::fabs(value)))
                << "seed " << seed;
        }
    }
}

TEST(FormulaLipschitz, IsNearlyTheLargestSlope) {
    struct Case {
        const char* text;
        double slope;
    };
    for (const Case& c :
         {Case{"length(p) - 1", 1}, Case{"x", 1}, Case{"3*x - 4*z", 5}, Case{"length(p) - 1 - 0.1*sin(8*x)", 1.8},
          Case{"x^2", 2}, Case{"max(length(p.xz) - 0.5, abs(y) - 0.3)", 1}, Case{"sqrt(0.01 + x*x + y*y)", 1},
          Case{"2", 1}, Case{"length(vec2(length(p.xz) - 0.6, y)) - 0.2", 1},
          Case{"length(max(abs(p) - 0.3, 0))", 1}}) {
        const auto slope = formula_lipschitz(parsed(c.text), {1, 1, 1}, 0);
        ASSERT_TRUE(slope) << c.text << ": " << slope.error().message;
        EXPECT_GE(double(*slope), c.slope * 0.99) << c.text;
        EXPECT_LE(double(*slope), c.slope * 1.02) << c.text;
    }
}

TEST(FormulaLipschitz, AsksWhereThereIsNoBoundAndRefusesWhatDoesNotHold) {
    for (const char* text : {"floor(3*x)", "1/x", "sqrt(x)", "atan2(y, x)", "mod(x, 0.3)", "log(x)", "x/length(p)"}) {
        const auto slope = formula_lipschitz(parsed(text), {1, 1, 1}, 0);
        ASSERT_FALSE(slope) << text;
        const std::string& message = slope.error().message;
        const bool asks =
            message.find("\"lipschitz\"") != std::string::npos && message.find("near (") != std::string::npos;
        const bool pole =
            message.find("at (") != std::string::npos && message.find("not a finite number") != std::string::npos;
        EXPECT_TRUE(asks || (pole && std::string_view(text).find('/') != std::string_view::npos)) << message;
        // Nor does any number make a jump or a pole less steep.
        EXPECT_FALSE(formula_lipschitz(parsed(text), {1, 1, 1}, 5)) << text;
    }
    // A triangle wave is steep nowhere, though intervals cannot know.
    const Formula wave = parsed("abs(mod(x, 0.5) - 0.25) - 0.1");
    EXPECT_FALSE(formula_lipschitz(wave, {1, 1, 1}, 0));
    const auto declared = formula_lipschitz(wave, {1, 1, 1}, 1);
    ASSERT_TRUE(declared) << declared.error().message;
    EXPECT_EQ(*declared, 1.0f);
    const auto refused = formula_lipschitz(parsed("length(p) - 1 - 0.1*sin(8*x)"), {1, 1, 1}, 1.5f);
    ASSERT_FALSE(refused);
    double x = 0, y = 0, z = 0, slope = 0;
    ASSERT_EQ(std::sscanf(refused.error().message.c_str(),
                          "lipschitz 1.5 does not hold: at (%lf, %lf, %lf) the slope is %lf", &x, &y, &z, &slope),
              4)
        << refused.error().message;
    const auto f = [](double u, double v, double w) {
        return std::sqrt(u * u + v * v + w * w) - 0.1 * std::sin(8 * u);
    };
    const double h = 1e-5;
    const double dx = f(x + h, y, z) - f(x - h, y, z), dy = f(x, y + h, z) - f(x, y - h, z),
                 dz = f(x, y, z + h) - f(x, y, z - h);
    EXPECT_GT(std::sqrt(dx * dx + dy * dy + dz * dz) / (2 * h), 1.5) << refused.error().message;
    EXPECT_TRUE(formula_lipschitz(parsed("length(p) - 1 - 0.1*sin(8*x)"), {1, 1, 1}, 1.81f));
}

// ---- On the tape.

struct Cloud {
    std::vector<float> x, y, z;
    Points points() const { return {x.data(), y.data(), z.data(), int(x.size())}; }
    void add(vec3 p) {
        x.push_back(p.x);
        y.push_back(p.y);
        z.push_back(p.z);
    }
};

struct Made {
    std::vector<Edit> edits;
    Program program;
    std::vector<Instruction> own_code{};  // instead of the program's, where there is some
    std::vector<float> own_params{};

    TapeView tape() const { return own_code.empty() ? view(program) : TapeView{own_code, own_params.data(), nullptr}; }
};

// Worlds of several expressions, in trees and under transforms and warps.
std::vector<Made> random_worlds(uint32_t seed, int count) {
    std::vector<Made> out;
    for (uint32_t n = 0; int(out.size()) < count; ++n) {
        FormulaMaker make(seed + 7919 * n);
        Made made;
        for (int e = 0; e < 3; ++e) {
            Edit edit = edit_of("(" + make.make(5, true).text + ") - 0.1",
                                {float(make.in(0.3, 1)), float(make.in(0.3, 1)), float(make.in(0.3, 1))});
            edit.node.transform.position = {float(make.in(-1, 1)), float(make.in(-1, 1)), float(make.in(-1, 1))};
            if (make.below(2) == 0)
                edit.node.transform.rotation =
                    axis_angle(normalize(vec3{1, float(make.in(-1, 1)), 0.3f}), float(make.in(-3, 3)));
            if (make.below(3) == 0) edit.node.transform.scale = {1.5f, 0.75f, 1};
            if (make.below(3) == 0) edit.node.domain.push_back(Twist{.rate = 0.7f});
            if (make.below(4) == 0) edit.node.domain.push_back(Mirror{});
            edit.op = e == 0 ? Op::Union : Op(make.below(3));
            edit.blend_radius = make.below(2) == 0 ? 0.0f : 0.1f;
            edit.node.material = MaterialId{uint32_t(e), 0};
            made.edits.push_back(edit);
        }
        auto program = compile({made.edits, {}, {}});
        if (!program) {
            // Some need a declared slope: that is not what is tested here.
            EXPECT_NE(program.error().message.find("lipschitz"), std::string::npos) << program.error().message;
            continue;
        }
        made.program = std::move(*program);
        out.push_back(std::move(made));
    }
    return out;
}

vec3 random_point(FormulaMaker& random, double size) {
    return {float(random.in(-size, size)), float(random.in(-size, size)), float(random.in(-size, size))};
}

TEST(ExpressionShape, TapeEqualsTheJudgeAndIsOneLipschitz) {
    for (const Made& made : random_worlds(100, 30)) {
        const auto judge = Judge::create({made.edits, {}, {}});
        ASSERT_TRUE(judge);
        FormulaMaker random(3);
        for (int i = 0; i < 200; ++i) {
            const vec3 p = random_point(random, i % 5 == 0 ? 20 : 2);
            const double d = evaluate(view(made.program), dvec3{p.x, p.y, p.z});
            ASSERT_NEAR(d, judge->distance({p.x, p.y, p.z}), 2e-5 * (1 + std::fabs(d)));
            const vec3 q = p + random_point(random, i % 2 == 0 ? 0.05 : 1);
            const double gap = std::sqrt(double(dot(p - q, p - q)));
            ASSERT_LE(std::fabs(d - evaluate(view(made.program), dvec3{q.x, q.y, q.z})), gap * (1 + 1e-5) + 1e-6)
                << made.edits[0].node.shape.data;
        }
    }
}

TEST(ExpressionShape, IsCutToItsHalfExtents) {
    const auto program = compiled(edit_of("-1", {0.5f, 0.25f, 1}));
    ASSERT_TRUE(program);
    EXPECT_NEAR(evaluate(view(*program), dvec3{0, 0, 0}), -0.25, 1e-6);
    EXPECT_NEAR(evaluate(view(*program), dvec3{1.5, 0, 0}), 1, 1e-6);
    EXPECT_EQ(program->bounds.max.y, 0.25f);
    // Outside, the box's distance where the solid reaches it, and more where it does not.
    const auto ball = compiled(edit_of("length(p) - 1", {1, 1, 1}));
    ASSERT_TRUE(ball);
    EXPECT_NEAR(evaluate(view(*ball), dvec3{3, 0, 0}), 2, 1e-2);
    EXPECT_NEAR(evaluate(view(*ball), dvec3{0.5, 0, 0}), -0.5, 1e-2);
}

TEST(ExpressionShape, EveryInstructionSetGivesTheSameBytesAndStaysNearDouble) {
    auto worlds = random_worlds(200, 20);
    // One that keeps values in memory, and one with every function, jumps included.
    for (const std::string& text : {many_alive(40).text(),
                                    std::string("sin(x)+cos(y)+exp(z)+log(x+2)+sqrt(y)+abs(z)+floor(3*x)+mod(y, "
                                                "0.3)+atan2(x, y)+x/(y*y+1)-min(x, y)*max(y, z)"),
                                    std::string("sin(1e9*x) + 1/x + sqrt(-1-x*x) + 0*exp(88*x)*exp(88*x)*exp(88*x)")}) {
        const bool jumps = text[0] == 's';
        Made made;
        made.edits.push_back(edit_of(jumps ? "x" : text));
        auto program = compile({made.edits, {}, {}});
        ASSERT_TRUE(program) << program.error().message;
        made.program = std::move(*program);
        if (jumps) {
            // Behind the reader's back: code that no check would let through must not differ either.
            const FormulaCode code = formula_code(parsed(text), 16);
            made.own_code.push_back(Instruction::make(Opcode::PointCell, 0, 0, 0, 0, 0));
            made.own_code.insert(made.own_code.end(), code.code.begin(), code.code.end());
            made.own_params = code.params;
            made.own_code.push_back(
                Instruction::make(Opcode::Result, 0, 0, code.result, 0, uint32_t(made.own_params.size())));
            made.own_params.insert(made.own_params.end(), {1.0f, 0.0f, 0.0f});
            ASSERT_EQ(code.memory_slots, 0u);
        } else {
            EXPECT_GT(made.program.memory_slots, 0u);
        }
        worlds.push_back(std::move(made));
    }
    for (const Made& made : worlds) {
        FormulaMaker random(4);
        Cloud cloud;
        for (int i = 0; i < 1003; ++i) cloud.add(random_point(random, i % 3 == 0 ? 20 : 1.5));
        std::vector<float> one(1003), other(1003);
        std::vector<MaterialMix> one_mix(1003), other_mix(1003);
        evaluate(made.tape(), cloud.points(), one.data(), Isa::Scalar);
        evaluate_materials(made.tape(), cloud.points(), other.data(), one_mix.data(), false, Isa::Scalar);
        EXPECT_EQ(std::memcmp(one.data(), other.data(), 4 * one.size()), 0);
        for (Isa isa : {Isa::Sse4, Isa::Avx2, Isa::Avx512}) {
            if (!has_isa(isa)) continue;
            evaluate(made.tape(), cloud.points(), other.data(), isa);
            ASSERT_EQ(std::memcmp(one.data(), other.data(), 4 * one.size()), 0)
                << "isa " << int(isa) << " " << made.edits[0].node.shape.data;
            evaluate_materials(made.tape(), cloud.points(), other.data(), other_mix.data(), false, isa);
            for (size_t i = 0; i < one.size(); ++i) {
                ASSERT_EQ(one_mix[i].id0, other_mix[i].id0);
                ASSERT_EQ(one_mix[i].weight, other_mix[i].weight);
            }
        }
    }
    for (size_t w = 0; w < 20; ++w) {
        FormulaMaker random(5);
        for (int i = 0; i < 100; ++i) {
            const vec3 p = random_point(random, 2);
            float d = 0;
            evaluate(view(worlds[w].program), Points{&p.x, &p.y, &p.z, 1}, &d);
            ASSERT_NEAR(double(d), evaluate(view(worlds[w].program), dvec3{p.x, p.y, p.z}), 2e-5);
        }
    }
}

TEST(ExpressionShape, AnyNumberOfRegistersGivesTheSameBits) {
    FormulaMaker random(6);
    std::vector<std::string> texts{many_alive(60).text()};
    for (int i = 0; i < 40; ++i) texts.push_back(random.make(7, true).text);
    for (const std::string& text : texts) {
        const Formula formula = parsed(text);
        std::vector<float> first;
        for (const uint32_t most : {22u, 16u, 5u, kFewestFormulaRegisters}) {
            const FormulaCode code = formula_code(formula, most);
            EXPECT_LE(code.registers, most);
            std::vector<Instruction> tape{Instruction::make(Opcode::PointCell, 0, 0, 0, 0, 0)};
            tape.insert(tape.end(), code.code.begin(), code.code.end());
            std::vector<float> params = code.params;
            tape.push_back(Instruction::make(Opcode::Result, 0, 0, code.result, 0, uint32_t(params.size())));
            params.insert(params.end(), {1.0f, 0.0f, 0.0f});
            const TapeView view{tape, params.data(), nullptr, code.memory_slots};
            FormulaMaker points(7);
            std::vector<float> values(100);
            for (float& v : values) {
                const vec3 p = random_point(points, 2);
                evaluate(view, Points{&p.x, &p.y, &p.z, 1}, &v);
                ASSERT_NEAR(double(v), evaluate(formula, {p.x, p.y, p.z}), 1e-4 * (1 + std::fabs(double(v)))) << text;
            }
            if (first.empty()) first = values;
            ASSERT_EQ(std::memcmp(first.data(), values.data(), 4 * values.size()), 0) << most << " registers: " << text;
        }
    }
}

TEST(ExpressionShape, PrunedTapeHasTheFullTapesBitsInItsBall) {
    auto worlds = random_worlds(300, 20);
    // A formula with many branches, some of them in memory.
    for (int n : {1, 2}) {
        std::string text = "9";
        for (int i = 0; i < 60; ++i) {
            FormulaMaker at(uint32_t(1000 * n + i));
            text = "min(" + text + ", length(p - vec3(" + std::to_string(at.in(-0.9, 0.9)) + ", " +
                   std::to_string(at.in(-0.9, 0.9)) + ", " + std::to_string(at.in(-0.9, 0.9)) + ")) - 0.05)";
        }
        if (n == 2) text = many_alive(30).names + "max(" + text + ", -(" + many_alive(30).value + ")*0.05)";
        Made made;
        made.edits.push_back(edit_of(text));
        auto program = compile({made.edits, {}, {}});
        ASSERT_TRUE(program) << program.error().message;
        made.program = std::move(*program);
        worlds.push_back(std::move(made));
    }
    size_t full = 0, kept = 0;
    for (const Made& made : worlds) {
        const bool branches = made.edits.size() == 1;
        FormulaMaker random(8);
        PruneScratch scratch;
        std::vector<Instruction> coarse, fine;
        for (int ball = 0; ball < 40; ++ball) {
            const vec3 center = random_point(random, 1.2);
            const float radius = float(random.in(0.02, 0.4));
            prune(view(made.program), center, radius, coarse, scratch);
            const vec3 inner = center + random_point(random, 0.3 * double(radius));
            const float inner_radius = 0.4f * radius;
            prune(view(made.program, coarse), inner, inner_radius, fine, scratch);
            if (branches) {
                full += made.program.tape().size();
                kept += fine.size();
            }
            Cloud cloud;
            while (cloud.x.size() < 64) {
                const vec3 offset = random_point(random, double(inner_radius));
                if (length(offset) <= inner_radius) cloud.add(inner + offset);
            }
            std::vector<float> a(64), b(64);
            std::vector<MaterialMix> mix_a(64), mix_b(64);
            evaluate_materials(view(made.program), cloud.points(), a.data(), mix_a.data());
            evaluate_materials(view(made.program, fine), cloud.points(), b.data(), mix_b.data());
            ASSERT_EQ(std::memcmp(a.data(), b.data(), 4 * a.size()), 0)
                << made.edits[0].node.shape.data << " ball " << ball;
            for (size_t i = 0; i < a.size(); ++i) {
                ASSERT_EQ(mix_a[i].id0, mix_b[i].id0);
                ASSERT_EQ(mix_a[i].weight, mix_b[i].weight);
            }
        }
    }
    EXPECT_LT(kept, full / 3) << "pruning should keep little of " << full;
}

TEST(ExpressionShape, FaultsNameTheEditAndWhatToDo) {
    Fault fault;
    const Edit edits[] = {edit_of("x"), edit_of("x +")};
    const auto bad = compile({edits, {}, {}}, &fault);
    ASSERT_FALSE(bad);
    EXPECT_EQ(fault.edit, 1u);
    EXPECT_NE(bad.error().message.find("expression 1:4: a value is missing"), std::string::npos) << bad.error().message;
    const auto missing = compiled(edit_of("file:a.vm"));
    ASSERT_FALSE(missing);
    EXPECT_NE(missing.error().message.find("not loaded"), std::string::npos);
    const auto model = compiled(edit_of("vm:_0 var-x\n_1 frob _0\n"));
    ASSERT_FALSE(model);
    EXPECT_NE(model.error().message.find("model 2:4: there is no operation"), std::string::npos)
        << model.error().message;
}

}  // namespace
}  // namespace kiln::sdf
