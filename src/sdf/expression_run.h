// SPDX-License-Identifier: MIT
// Code of one formula alone, with as many registers as it wants: what expression_image.cpp runs.
#pragma once

#include <cstdint>

namespace kiln::sdf {

/// Registers 0, 1, 2 hold x, y, z and are never written.
struct FormulaOp {
    uint8_t fn = 0;  ///< Fn; Constant and Copy among them
    uint8_t number_a = 0, number_b = 0;
    uint8_t is_choice = 0;  ///< Min or Max
    uint32_t dst = 0, a = 0, b = 0;
    float number = 0;
};

inline constexpr int kTileLanes = 16;  ///< tiles in one interval run

}  // namespace kiln::sdf
