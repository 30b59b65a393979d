// SPDX-License-Identifier: MIT
// From a formula to instructions, and formulas as the shape `expression` holds them: read once, their slope bounded once.
#pragma once

#include "sdf/expression.h"
#include "sdf/program.h"

#include <memory>
#include <string>
#include <vector>

namespace kiln::sdf {

/// Arithmetic instructions over registers 0 … registers − 1; `param` counts within `params`.
struct FormulaCode {
    std::vector<Instruction> code;
    std::vector<float> params;
    uint32_t registers = 1;
    uint32_t memory_slots = 0;
    uint32_t result = 0;  ///< register of the value
};

/// Fewest registers that any formula can be written with: two operands that live on, and a result.
inline constexpr uint32_t kFewestFormulaRegisters = 3;

/// Values stay in registers as long as there are some; then the one that is wanted last moves to memory (Belady, "A study of
/// replacement algorithms for a virtual-storage computer", 1966). Coordinates are taken from the point again instead.
FormulaCode formula_code(const Formula& formula, uint32_t most_registers);

struct PreparedFormula {
    Formula formula;
    float lipschitz = 1;  ///< proven, or declared and not refuted, over the half extents
};

/// Shape::data of an expression: its text (a formula or GLSL), or the first of these and a `.vm` model's text, or the second and the name of
/// a file with a model or GLSL.
inline constexpr std::string_view kModelText = "vm:", kModelFile = "file:";

/// Reads the formula and bounds its slope. Answers are kept for the whole process: the same formula is prepared once. Any thread.
Result<std::shared_ptr<const PreparedFormula>> prepare_formula(const std::string& data, vec3 half_extents,
                                                               float declared);

}  // namespace kiln::sdf
