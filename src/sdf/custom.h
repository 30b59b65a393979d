// SPDX-License-Identifier: MIT
// Shapes that a program brings itself (kiln/edit.h): their rows, and calls of their functions.
#pragma once

#include "sdf/expression.h"
#include "sdf/tables.h"

#include <kiln/edit.h>
#include <kiln/math.h>

#include <memory>

namespace kiln::sdf {

inline constexpr int kMostCustomShapes = 256;  // an instruction's aux

/// Built-in rows, then those of registered shapes; grows, and what was seen stays.
std::span<const KindRow> rows_with_custom(std::span<const KindRow> built_in);

/// Its number in instructions.
uint32_t custom_index(uint16_t kind);
/// Of a shape in C++. NaN everywhere when the function throws. Any thread.
void custom_distances(uint32_t index, const float* params, const CustomShape::Points& points, double* out);

struct CustomBounds {
    vec3 half_extents;
    float lipschitz = 1;
    std::shared_ptr<const Formula> formula{};  ///< with its parameters in it; none of a shape in C++
};
/// What the shape says of itself, checked by sampling; answers are kept. Any thread.
Result<CustomBounds> check_custom(const Shape& shape);

}  // namespace kiln::sdf
