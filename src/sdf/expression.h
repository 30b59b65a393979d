// SPDX-License-Identifier: MIT
// Formulas: what the shape `expression` is written in, as text or as a line-per-operation `.vm` model, compiled to one graph of
// numbers of the local point. Equal subexpressions are one node, constants are folded, every node is used.
//
// Text, or GLSL where it has braces (expression_glsl.h):   statements `name = value;`, then one value: the distance.
//   numbers  x y z p pi, names given before;  + - * /  unary -  ^ (right, before unary minus)  ( )  .x .y .z and swizzles (p.xz)
//   of each component:  abs sqrt square sin cos tan asin acos atan exp log ln floor ceil round fract;  min max (two or more),
//   mod(a, b) (sign of b), pow, atan2(y, x), clamp(v, low, high), mix(a, b, t), smoothstep(low, high, v), smin(a, b, k), smax(a, b, k)
//   of vectors:  vec2 vec3 length distance dot cross normalize
// a ^ n and pow(a, n): by multiplication where n is a constant whole number up to 64, else exp(n log a), meant for a > 0.
// sqrt(v) is 0 and log(v) is log(1e-37) for every v below; so no value inside the float range makes a NaN.
#pragma once

#include "sdf/expression_fn.h"

#include <kiln/math.h>
#include <kiln/result.h>

#include <cstdint>
#include <string_view>
#include <vector>

namespace kiln::sdf {

std::string_view fn_name(Fn fn);

/// Operands have lower indices. A constant is held as every lane type will see it: rounded to float.
struct FormulaNode {
    Fn fn = Fn::Constant;
    uint32_t a = 0, b = 0;
    float constant = 0;
};

struct Formula {
    std::vector<FormulaNode> nodes;  ///< the last one is the value
};

inline constexpr size_t kMaxFormulaNodes = 100000;

/// Errors read "LINE:COLUMN: what is wrong; what would be right", counted from 1 in `text`.
Result<Formula> parse_formula(std::string_view text);
/// A `.vm` model: lines `NAME OPERATION OPERANDS`, `#` begins a comment; the last line is the value. Errors as above.
Result<Formula> read_vm(std::string_view text);

/// The value at a point, in double precision with the standard library's functions: the judge's.
double evaluate(const Formula& formula, dvec3 p);

/// Values and slopes of a formula over a box, by interval arithmetic (Moore, "Interval Analysis", 1966) in double precision.
struct FormulaRange {
    double low = 0, high = 0;                ///< every value lies between
    double slope_low[3]{}, slope_high[3]{};  ///< every partial derivative lies between; infinite where nothing is known
    double steepest = 0;                     ///< no two points of the box differ by more than this per metre
};
FormulaRange range_over(const Formula& formula, const Box3& box);

/// A bound of the slope over the box |x| <= half_extents: the largest found by subdivision, at most 0.5 % above the steepest point seen
/// where the budget allows it. `declared` > 0 is checked instead and returned: each error names a place where it does not hold.
Result<float> formula_lipschitz(const Formula& formula, vec3 half_extents, float declared);

}  // namespace kiln::sdf
