// SPDX-License-Identifier: MIT
// Pictures of plane models: where a formula is below 0 on a grid of pixels. Intervals over tiles decide most of them at once and
// shorten the code for the others, sixteen tiles at a time (Keeter, "Massively Parallel Rendering of Complex Closed-Form Implicit
// Surfaces", 2020, does so on a GPU); what is left is evaluated point by point. The answer has the bits of evaluating every pixel.
#pragma once

#include "sdf/eval.h"
#include "sdf/expression.h"

#include <vector>

namespace kiln::sdf {

struct FormulaView {
    int size_px = 1024;    ///< a side
    float half_width = 1;  ///< the picture shows |x|, |y| <= half_width, +y up, pixel centres
    float z = 0;
};

struct FormulaImageStats {
    uint64_t interval_operations = 0;  ///< of sixteen tiles each
    uint64_t point_operations = 0;     ///< of one pixel each
    uint64_t copied_operations = 0;    ///< looked at to shorten code
};

/// 255 where the formula is below 0, else 0; row by row from the top. `workers`: threads, 0 for all cores.
std::vector<uint8_t> formula_image(const Formula& formula, const FormulaView& view, Isa isa = best_isa(),
                                   FormulaImageStats* stats = nullptr, int workers = 0);
/// The same, every operation at every pixel.
std::vector<uint8_t> formula_image_slow(const Formula& formula, const FormulaView& view, Isa isa = best_isa(),
                                        int workers = 0);

}  // namespace kiln::sdf
