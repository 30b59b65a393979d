// SPDX-License-Identifier: MIT
// Functions in GLSL: each beside the same in C++, and what is wrong with others.

#include "sdf/expression_glsl.h"

#include "feed.h"
#include "sdf/custom.h"
#include "sdf/eval.h"
#include "sdf/expression_code.h"
#include "sdf/judge.h"

#include <kiln/shapes.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <regex>

namespace kiln::sdf {
namespace {

struct Twin {
    const char* name;
    const char* text;
    double (*value)(double x, double y, double z);
};

const Twin kTwins[] = {
    {"ball", "float f(vec3 p) { return length(p) - 1.0; }",
     [](double x, double y, double z) { return std::sqrt(x * x + y * y + z * z) - 1; }},
    {"box",
     "const vec3 half_size = vec3(0.5, 0.25f, 1);\n"
     "float box(vec3 p, vec3 b) {\n"
     "    vec3 q = abs(p) - b;  // how far out, an axis\n"
     "    return length(max(q, 0.0)) + min(max(q.x, max(q.y, q.z)), 0.0);\n"
     "}\n"
     "float f(in vec3 p) { /* moved */ p.x -= 0.25; return box(p, half_size); }",
     [](double x, double y, double z) {
         const double q[3] = {std::fabs(x - 0.25) - 0.5, std::fabs(y) - 0.25, std::fabs(z) - 1};
         double out = 0;
         for (const double v : q) out += std::max(v, 0.0) * std::max(v, 0.0);
         return std::sqrt(out) + std::min(std::max({q[0], q[1], q[2]}), 0.0);
     }},
    {"ternary", "float f(vec3 p) { return p.x < 0.5 ? p.y : p.x >= 0.75 && p.z != p.y ? 2.0 : p.z; }",
     [](double x, double y, double z) { return x < 0.5               ? y
                                               : x >= 0.75 && z != y ? 2
                                                                     : z; }},
    {"early_return",
     "float f(vec3 p) { float d = p.x; if (p.y > 0.0) { d += 1.0; if (p.z > 0.0) return d; d *= 2.0; } else d = -d; "
     "return d - p.z; }",
     [](double x, double y, double z) {
         double d = x;
         if (y > 0) {
             d += 1;
             if (z > 0) return d;
             d *= 2;
         } else {
             d = -d;
         }
         return d - z;
     }},
    {"loops",
     "float f(vec3 p) { float sum = 0.; for (int i = 0; i < 5; i++) { if (i == 1) continue; for (int j = i; j > 0; "
     "--j) sum += p.y; "
     "if (sum > 3.0) break; sum += p.x * float(i); } return sum; }",
     [](double x, double y, double) {
         double sum = 0;
         for (int i = 0; i < 5; ++i) {
             if (i == 1) continue;
             for (int j = i; j > 0; --j) sum += y;
             if (sum > 3) break;
             sum += x * i;
         }
         return sum;
     }},
    {"return_in_loop",
     "float f(vec3 p) { for (int i = 1; i <= 4; i += 1) { if (p.x * float(i) > 1.0) return float(i) + p.y; } return "
     "-1.0; }",
     [](double x, double y, double) {
         for (int i = 1; i <= 4; ++i)
             if (x * i > 1) return i + y;
         return -1.0;
     }},
    {"two_breaks",
     "float f(vec3 p) { float s = 0.0; for (int i = 0; i < 4; i++) { if (p.x < float(i)) break; s += 1.0; if (p.y < "
     "float(i)) break; } return s; }",
     [](double x, double y, double) {
         double s = 0;
         for (int i = 0; i < 4; ++i) {
             if (x < i) break;
             s += 1;
             if (y < i) break;
         }
         return s;
     }},
    {"skip_a_round",
     "float f(vec3 p) { float s = 0.0; for (int i = 0; i < 3; i++) { if (p.z < float(i) - 1.0) continue; s += 1.0; } "
     "return s; }",
     [](double, double, double z) {
         double s = 0;
         for (int i = 0; i < 3; ++i) {
             if (z < i - 1) continue;
             s += 1;
         }
         return s;
     }},
    {"inout",
     "void turn(inout vec2 v, float a) { v = mat2(cos(a), sin(a), -sin(a), cos(a)) * v; if (a > 1.0) return; v.x += "
     "10.0; }\n"
     "float f(vec3 p) { turn(p.xz, 0.5); turn(p.yx, 2.0); return p.x + 2.0 * p.y + 3.0 * p.z; }",
     [](double x, double y, double z) {
         const auto turn = [](double& u, double& v, double a) {
             const double nu = std::cos(a) * u - std::sin(a) * v, nv = std::sin(a) * u + std::cos(a) * v;
             u = nu, v = nv;
             if (a > 1) return;
             u += 10;
         };
         turn(x, z, 0.5);
         turn(y, x, 2.0);
         return x + 2 * y + 3 * z;
     }},
    {"out_after_some_returned",
     "void g(float a, out float b) { b = 1.0; if (a > 0.0) return; b = 2.0; }\nfloat f(vec3 p) { float b; g(p.x, b); "
     "return b; }",
     [](double x, double, double) { return x > 0 ? 1.0 : 2.0; }},
    {"overloads",
     "float dot2(vec2 v) { return dot(v, v); } float dot2(vec3 v) { return dot(v, v); }\n"
     "float f(vec3 p) { return dot2(p) - dot2(p.zx) + dot2(vec2(1)); }",
     [](double, double y, double) { return y * y + 2; }},
    {"matrices",
     "float f(vec3 p) { mat3 m = mat3(1, 2, 3, 4, 5, 6, 7, 8, 10); vec3 a = m * p, b = p * m; mat2 n = mat2(2.0) * "
     "mat2(1, 2, 3, 4); "
     "return dot(a, vec3(1, 10, 100)) + b.y + n[1].x + m[2][0] + (transpose(m) * p).z; }",
     [](double x, double y, double z) {
         const double a[3] = {x + 4 * y + 7 * z, 2 * x + 5 * y + 8 * z, 3 * x + 6 * y + 10 * z};
         return a[0] + 10 * a[1] + 100 * a[2] + (4 * x + 5 * y + 6 * z) + 6 + 7 + (7 * x + 8 * y + 10 * z);
     }},
    {"functions",
     "float f(vec3 p) { vec4 v = vec4(p, 1); v.wz = v.zw; return sign(p.x) + step(0.25, p.y) * trunc(3.0 * p.z) + "
     "mod(p.x, 0.5) + fract(v.w)"
     " + smoothstep(-1.0, 1.0, p.y) + mix(p.x, p.y, 0.25) + clamp(p.z, -0.5, 0.5) + radians(90.0) + exp2(p.x) + "
     "atan(p.y, p.x)"
     " + pow(abs(p.x) + 1.0, 1.5) + inversesqrt(4.0) + distance(p, p.yzx) + length(cross(p, p.zxy)) + normalize(p + "
     "3.0).x"
     " + reflect(p, vec3(0, 1, 0)).y + float(int(2.5 * p.x)) + float(7 / 2) + v.b; }",
     [](double x, double y, double z) {
         const double t = std::clamp((y + 1) / 2, 0.0, 1.0);
         const double cross[3] = {y * y - z * x, z * z - x * y, x * x - y * z};
         const double size = std::sqrt((x + 3) * (x + 3) + (y + 3) * (y + 3) + (z + 3) * (z + 3));
         return (x > 0   ? 1
                 : x < 0 ? -1
                         : 0) +
                (y >= 0.25 ? std::trunc(3 * z) : 0) + (x - 0.5 * std::floor(x / 0.5)) + (z - std::floor(z)) +
                t * t * (3 - 2 * t) + (x + (y - x) * 0.25) + std::clamp(z, -0.5, 0.5) + std::acos(-1.0) / 2 +
                std::exp2(x) + std::atan2(y, x) + std::pow(std::fabs(x) + 1, 1.5) + 0.5 +
                std::hypot(x - y, y - z, z - x) + std::hypot(cross[0], cross[1], cross[2]) + (x + 3) / size - y +
                std::trunc(2.5 * x) + 3 + 1;
     }},
    {"scopes",
     "float a = 2.0;\nfloat g(float a) { { float a = 5.0; a += 1.0; } return a; }\n"
     "float f(vec3 p) { float b = a; { float a = 3.0; b += a; } return b + g(p.x) + (true ^^ false ? 1.0 : 0.0) + "
     "(!(p.x > 9.) || false ? 4. : 0.); }",
     [](double x, double, double) { return 2 + 3 + x + 1 + 4; }},
    {"the_last_that_fits",
     "float f(vec3 p) { return 1.0; } float g(vec3 q) { return f(q) + q.y; } vec3 h(vec3 p) { return p; }",
     [](double, double y, double) { return 1 + y; }},
};

class EachGlsl : public testing::TestWithParam<Twin> {};
TEST_P(EachGlsl, HasTheValueOfTheSameInCpp) {
    const auto formula = read_glsl(GetParam().text);
    ASSERT_TRUE(formula) << formula.error().message;
    std::mt19937 random(7);
    const auto in = [&] { return 4 * (double(random()) / 4294967296.0) - 2; };
    for (int i = 0; i < 500; ++i) {
        const double p[3] = {in(), in(), in()};
        const double wanted = GetParam().value(p[0], p[1], p[2]);
        ASSERT_NEAR(evaluate(*formula, {p[0], p[1], p[2]}), wanted, 2e-6 * (1 + std::fabs(wanted)))
            << p[0] << " " << p[1] << " " << p[2];
    }
}
INSTANTIATE_TEST_SUITE_P(Glsl, EachGlsl, testing::ValuesIn(kTwins), [](const auto& twin) { return twin.param.name; });

TEST(Glsl, ComparesAtEqualNumbersAsItSays) {
    const auto at = [](const char* text, double x) { return evaluate(*read_glsl(text), {x, 0, 0}); };
    EXPECT_EQ(at("float f(vec3 p) { return p.x >= 1.0 ? 1.0 : 0.0; }", 1), 1);
    EXPECT_EQ(at("float f(vec3 p) { return p.x > 1.0 ? 1.0 : 0.0; }", 1), 0);
    EXPECT_EQ(at("float f(vec3 p) { return p.x <= 1.0 ? 1.0 : 0.0; }", 1), 1);
    EXPECT_EQ(at("float f(vec3 p) { return p.x < 1.0 ? 1.0 : 0.0; }", 1), 0);
    EXPECT_EQ(at("float f(vec3 p) { return p.x == 1.0 ? 1.0 : 0.0; }", 1), 1);
    EXPECT_EQ(at("float f(vec3 p) { return p.x == 1.0 ? 1.0 : 0.0; }", 1 + 1e-9), 0);
    EXPECT_EQ(at("float f(vec3 p) { return step(1.0, p.x); }", 1), 1);
    EXPECT_EQ(at("float f(vec3 p) { return sign(p.x); }", 0), 0);
}

TEST(Glsl, ConstantConditionsCostNothing) {
    const auto plain = read_glsl("float f(vec3 p) { return p.x + p.y; }");
    const auto looped = read_glsl(
        "float f(vec3 p) { float s = p.x; for (int i = 0; i < 10; ++i) { if (i == 3) { s += p.y; break; } if (i > 7) "
        "return 1.0; } return s; }");
    ASSERT_TRUE(plain && looped) << looped.error().message;
    EXPECT_EQ(looped->nodes.size(), plain->nodes.size());
}

struct Wrong {
    const char* text;
    const char* says;
};
const Wrong kWrong[] = {
    {"float f(vec3 p) { return length(p) - 1.0 }", "1:42: \";\" is missing before \"}\""},
    {"float f(vec3 p) { return q.x; }", "1:26: there is no variable \"q\" here"},
    {"float g(vec3 p) { return d; } float f(vec3 p) { float d = 1.0; return g(p); }",
     "1:26: there is no variable \"d\""},
    {"float f(vec3 p) { return foo(p); }", "1:26: there is no function \"foo\" here; declare it before"},
    {"float f(vec3 p) { return lenght(p); }", "there is no function \"lenght\" here; did you mean \"length\"?"},
    {"float f(vec3 p) { return length(vec(1.0)); }", "there is no function \"vec\" here; did you mean \"vec2\"?"},
    {"float lump(vec3 p) { return p.x; } float f(vec3 p) { return lunp(p); }", "did you mean \"lump\"?"},
    {"float f(vec3 p) { float radius = 1.0; return length(p) - raduis; }", "did you mean \"radius\"?"},
    {"float f(vec3 p) { float radius = 1.0; raduis = 2.0; return radius; }", "did you mean \"radius\"?"},
    {"float f(vec3 p) { mat2 m = mat2(1.0); return determinant(m); }", "there is no function \"determinant\""},
    {"float f(vec3 p) { return p; }", "1:26: a vec3 where a float belongs"},
    {"float f(vec3 p) { return p.x + p.xy + p; }", "a vec2 meets a vec3"},
    {"float f(vec3 p) { return p.xy.z; }", "it has no such component"},
    {"float f(vec3 p) { vec2 a = vec2(1.0); return a[2]; }", "a component's number is a constant, 0 to 1"},
    {"float f(vec3 p) {\n  int i = 1;\n  while (i > 0) {}\n  return 1.0; }", "3:3: \"while\" is not read"},
    {"float f(vec3 p) { for (int i = 0; float(i) < p.x; i++) {} return 1.0; }",
     "how often this loop runs depends on the point"},
    {"float f(vec3 p) { for (int i = 0; i < 1; ) {} return 1.0; }", "calls, rounds of loops and statements"},
    {"float g(vec3 p) { return g(p); } float f(vec3 p) { return g(p); }", "calls itself"},
    {"float f(vec3 p) { float d = 1.0; }", "f returns nothing"},
    {"float f(vec3 p) { if (p.x > 0.0) return 1.0; else return 2.0 }", "\";\" is missing"},
    {"float f(vec3 p) { if (p.x) return 1.0; return 2.0; }", "a float where a bool belongs"},
    {"float f(vec3 p) { const float a = 1.0; a = 2.0; return a; }", "a is a constant"},
    {"#define A 1\nfloat f(vec3 p) { return 1.0; }", "1:1: # lines are not read"},
    {"void f(vec3 p) { }", "no function takes a point and returns a distance"},
    {"float f(vec3 p, float r) { return length(p) - r; }", "has 1 parameters after the point; 0 are given"},
    {"float f(vec3 p) { return 1.0 / 0.0; }", "no finite number"},
    {"float f(vec3 p) { float a[3]; return 1.0; }", "arrays are not read"},
    {"float f(vec3 p) { return vec2(1.0, 2.0, 3.0).x; }", "too many numbers"},
    {"float f(vec3 p) { return vec3(1.0, 2.0).x; }", "vec3 of 2 numbers; it takes 3"},
    {"float f(vec3 p) { return clamp(p.x, 1.0); }", "clamp has 2 operands here; it takes 3"},
    {"void g(out float a) { a = 1.0; } float f(vec3 p) { g(1.0); return 1.0; }", "g writes to its operand 1"},
    {"float f(vec3 p) { /* return 1.0; }", "this comment has no end"},
    {"float f(vec3 p) { return 1.0;", "this bracket is not closed"},
    {"float f(vec3 p) { break; return 1.0; }", "outside a loop"},
    {"float f(vec3 p) { return p.x > 0.0; }", "a bool where a float belongs"},
    {"f(vec3 p) { return 1.0; }", "\"f\" begins no function"},
    {"float f(vec3 p) { return 1.0 ? 2.0 : 3.0; }", "is no condition"},
    {"float f(vec3 p) { return $; }", "\"$\" is not of this language"},
};
class EachWrongGlsl : public testing::TestWithParam<Wrong> {};
TEST_P(EachWrongGlsl, IsAnErrorWithPlaceAndMend) {
    const auto formula = read_glsl(GetParam().text);
    ASSERT_FALSE(formula) << GetParam().text;
    const std::string& message = formula.error().message;
    EXPECT_THAT(message, testing::HasSubstr(GetParam().says)) << GetParam().text;
    EXPECT_TRUE(std::regex_match(message, std::regex("[0-9]+:[0-9]+: .*"))) << message;
}
INSTANTIATE_TEST_SUITE_P(Glsl, EachWrongGlsl, testing::ValuesIn(kWrong));

TEST(Glsl, AnyBytesAreReadOrRefusedWithAPlace) {
    std::mt19937 random(3);
    const auto below = [&](size_t n) { return size_t(random()) % n; };
    const char* const words[] = {"if",  "(", ")", "{", "}", ";",  "for",   "return", "p", ".x", "float", "vec3",
                                 "1.0", "<", "?", ":", "=", "+=", "break", "mat2",   "[", "]",  "-",     ","};
    int read = 0;
    for (int i = 0; i < 6000; ++i) {
        std::string text = kTwins[below(std::size(kTwins))].text;
        for (size_t n = 1 + below(3); n-- > 0;) {
            const size_t at = below(text.size() + 1);
            switch (below(4)) {
            case 0:
                text.insert(at, words[below(std::size(words))]);
                break;
            case 1:
                if (at < text.size()) text.erase(at, 1 + below(8));
                break;
            case 2:
                if (at < text.size()) text[at] = char(below(256));
                break;
            default:
                text.resize(at);
                break;
            }
        }
        const auto formula = read_glsl(text);
        read += formula ? 1 : 0;
        ASSERT_EQ(formula_complaint(formula), "");
    }
    EXPECT_GT(read, 30);
    const std::string deep =
        "float f(vec3 p) { return " + std::string(100000, '(') + "1.0" + std::string(100000, ')') + "; }";
    EXPECT_THAT(read_glsl(deep).error().message, testing::HasSubstr("nested too deeply"));
    const std::string signs = "float f(vec3 p) { return " + std::string(100000, '-') + "1.0; }";
    EXPECT_FALSE(read_glsl(signs));
    std::string doubling = "float f0(vec3 p) { return p.x; }";
    for (int i = 1; i < 60; ++i) {
        const std::string n = std::to_string(i), before = std::to_string(i - 1);
        doubling += "float f" + n + "(vec3 p) { return max(f" + before + "(p), f" + before + "(p)); }";
    }
    EXPECT_THAT(read_glsl(doubling).error().message, testing::HasSubstr("calls, rounds of loops"));
    std::string blocks = "float f(vec3 p) { ";
    for (int i = 0; i < 100000; ++i) blocks += "if (p.x > 0.0) ";
    EXPECT_FALSE(read_glsl(blocks + "return 1.0; return 2.0; }"));
}

TEST(Glsl, IsAShapeWhoseTapeIsTheJudges) {
    std::vector<Edit> edits(2);
    Expression shape;
    shape.half_extents = {1, 1, 1};
    edits[0].node.shape = shape;
    edits[0].node.shape.data = "float f(vec3 p) { vec2 q = vec2(length(p.xz) - 0.5, p.y); return length(q) - 0.2; }";
    edits[1].node.shape = Sphere{.radius = 0.3f};
    edits[1].op = Op::Subtract;
    const auto program = compile({edits, {}, {}});
    ASSERT_TRUE(program) << program.error().message;
    for (const Instruction& in : program->tape()) EXPECT_FALSE(in.cpu_only());
    const auto torus = [](dvec3 p) { return std::hypot(std::hypot(p.x, p.z) - 0.5, p.y) - 0.2; };
    for (int i = 0; i < 200; ++i) {
        const dvec3 p{std::sin(i * 1.7) * 0.9, std::sin(i * 2.3) * 0.3, std::sin(i * 3.1) * 0.9};
        const double wanted = std::max(torus(p), 0.3 - std::sqrt(p.x * p.x + p.y * p.y + p.z * p.z));
        EXPECT_NEAR(evaluate(view(*program), p), wanted, 1e-5);
    }
}

TEST(Glsl, IsAShapeOfTheProgramsOwnWithParameters) {
    auto made = register_shape({.name = "test_glsl_ball",
                                .parameters = {{.name = "radius", .value = 0.5f, .least = 0.01f, .most = 10}},
                                .half_extents =
                                    [](const float* w) {
                                        return vec3{1, 1, 1} * (1.5f * w[0]);
                                    },
                                .glsl = "float ball(vec3 p, float radius) { return length(p) - radius; }"});
    ASSERT_TRUE(made) << made.error().message;
    std::vector<Edit> edits(2);
    edits[0].node.shape = *made;
    edits[1].node.shape = *made;
    edits[1].node.shape.params[0] = 0.25f;
    edits[1].node.transform.position = {2, 0, 0};
    const auto program = compile({edits, {}, {}});
    ASSERT_TRUE(program) << program.error().message;
    for (const Instruction& in : program->tape()) EXPECT_FALSE(in.cpu_only()) << "the GPU runs it";
    const auto judge = Judge::create({edits, {}, {}});
    ASSERT_TRUE(judge);
    for (const dvec3 p : {dvec3{0, 0.7, 0}, dvec3{2, 0.35, 0}, dvec3{0.3, 0.5, 0.2}}) {
        const double wanted = std::min(std::hypot(p.x, p.y, p.z) - 0.5, std::hypot(p.x - 2, p.y, p.z) - 0.25);
        EXPECT_NEAR(evaluate(view(*program), p), wanted, 1e-6);
        EXPECT_NEAR(judge->distance(p), wanted, 1e-6);
    }

    const auto refused = [](CustomShape shape) { return register_shape(std::move(shape)).error().message; };
    const auto extents = [](const float*) { return vec3{1, 1, 1}; };
    EXPECT_THAT(refused({.name = "test_no_glsl", .half_extents = extents, .glsl = "float f(vec3 p) { return q; }"}),
                testing::HasSubstr("glsl 1:26: there is no variable \"q\""));
    EXPECT_THAT(refused({.name = "test_both",
                         .distance = [](const CustomShape::Points&, const float*, double*) {},
                         .half_extents = extents,
                         .glsl = "float f(vec3 p) { return p.x; }"}),
                testing::HasSubstr("one of them"));
}

}  // namespace
}  // namespace kiln::sdf
