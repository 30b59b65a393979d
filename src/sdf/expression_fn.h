// SPDX-License-Identifier: MIT
// The functions that formulas are made of: nodes of their graphs (expression.h) and Arithmetic instructions of tapes (program.h).
#pragma once

#include <cstdint>

namespace kiln::sdf {

// tape.glsl has the same numbers. Stored on no disk: order is free.
enum class Fn : uint8_t {
    X,  // of the local point
    Y,
    Z,
    Constant,
    Store,  // of tapes only: R[a] to memory, memory to R[dst], R[a] to R[dst]
    Load,
    Copy,
    Negate,  // from here on computed from one operand
    Abs,
    Sqrt,  // 0 for every operand below
    Square,
    Floor,
    Sin,
    Cos,
    Exp,  // cut off outside [-87, 88]
    Log,  // of 1e-37 for every operand below
    Add,  // from here on from two
    Sub,
    Mul,
    Div,
    Min,
    Max,
    Atan2,  // 0 at the origin
    Mod,    // a - b floor(a / b)
};
inline constexpr int operands(Fn fn) { return fn < Fn::Copy ? 0 : fn < Fn::Add ? 1 : 2; }

}  // namespace kiln::sdf
