// SPDX-License-Identifier: MIT
// What every reader of formulas promises of any bytes, for the deterministic tests and for libFuzzer: the broken promise, or nothing.
#pragma once

#include "sdf/expression.h"
#include "sdf/expression_glsl.h"

#include <cstdio>
#include <string>

namespace kiln::sdf {

// A graph whose operands stand before what uses them, or an error with a line and a column, both from 1.
inline std::string formula_complaint(const Result<Formula>& formula) {
    if (!formula) {
        const std::string& message = formula.error().message;
        size_t line = 0, column = 0;
        if (std::sscanf(message.c_str(), "%zu:%zu: ", &line, &column) != 2 || line < 1 || column < 1)
            return "no place: " + message;
        return message.find('\n') == std::string::npos ? "" : "several lines: " + message;
    }
    const auto& nodes = formula->nodes;
    if (nodes.empty() || nodes.size() > kMaxFormulaNodes) return std::to_string(nodes.size()) + " operations";
    for (size_t n = 0; n < nodes.size(); ++n) {
        const int count = operands(nodes[n].fn);
        if ((count > 0 && nodes[n].a >= n) || (count > 1 && nodes[n].b >= n)) return "an operand after its use";
    }
    return "";
}

}  // namespace kiln::sdf
