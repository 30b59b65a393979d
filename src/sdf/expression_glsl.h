// SPDX-License-Identifier: MIT
// Distance functions written in GLSL, as people share them, read into formulas: so they run in every lane type, on intervals and on
// the GPU, without a compiler at run time.
//
// Read:   float, int, bool, vec2, vec3, vec4, mat2, mat3; functions with in, out and inout parameters; constants outside functions;
//         declarations, = += -= *= /= ++ --, swizzles on both sides, if and else, return, for, break and continue; ?: and every operator of
//         numbers, comparisons and logic; the built-in functions of numbers and vectors; comments.
// Not:    arrays, structures, samplers, while, switch, # lines, recursion; a loop's condition must come to a constant.
// All is worked out: both sides of an `if` or ?: that the point decides are computed and one is chosen, so a side that divides by 0 where
// it is not chosen spoils the value; loops are unrolled, calls inlined.
#pragma once

#include "sdf/expression.h"

#include <span>
#include <string_view>

namespace kiln::sdf {

/// The last function of `text` that takes a vec3 first and returns a float; `arguments` are its further (float) parameters.
/// Errors as parse_formula's.
Result<Formula> read_glsl(std::string_view text, std::span<const float> arguments = {});

/// Whether a formula's text is GLSL: formulas of the other kind have no braces.
inline bool is_glsl(std::string_view text) { return text.find('{') != std::string_view::npos; }

}  // namespace kiln::sdf
