// SPDX-License-Identifier: MIT
// Raw entry points of each instruction set (eval_entry.inl), and what every eval_*.cpp includes before opening its namespace.
#pragma once

#include "sdf/eval.h"
#include "sdf/expression_run.h"

#include <kiln/shapes.h>

#include <cmath>
#include <cstddef>
#include <cstdint>

#define KILN_DECLARE_ISA(name)                                                                                         \
    namespace kiln::sdf::name {                                                                                        \
    void evaluate_points(const uint32_t* code, size_t count, const float* params, const float* samples,                \
                         const float* x, const float* y, const float* z, int points, float* out, void* memory);        \
    void evaluate_mixes(const uint32_t* code, size_t count, const float* params, const float* samples, const float* x, \
                        const float* y, const float* z, int points, float* out, float* id0, float* id1, float* share,  \
                        int slot, void* memory);                                                                       \
    void fold_list(const FoldEntry* entries, size_t count, const float* params, const float* samples,                  \
                   const Balls& balls, uint64_t* left, uint64_t* right, float* value, float* own, void* memory);       \
    float evaluate_brick(const uint32_t* code, size_t count, const float* params, const float* samples,                \
                         const float* x, const float* y, const float* z, float* out, void* memory);                    \
    float highest(const float* values);                                                                                \
    bool keeps_away(const uint32_t* code, size_t count, const float* params, const float* samples, const float* x,     \
                    const float* y, const float* z, const Away& from, void* memory);                                   \
    void store_halves(const float* values, size_t count, float scale, float limit, float least, uint16_t* codes,       \
                      uint64_t* solid);                                                                                \
    void run_formula_points(const FormulaOp* code, size_t count, void* registers, uint32_t result, float* out);        \
    void run_formula_tiles(const FormulaOp* code, size_t count, const float* bounds, void* registers, uint32_t result, \
                           uint16_t* choices, float* out);                                                             \
    }
KILN_DECLARE_ISA(scalar)
KILN_DECLARE_ISA(sse4)
KILN_DECLARE_ISA(avx2)
KILN_DECLARE_ISA(avx512)
#undef KILN_DECLARE_ISA

namespace kiln::sdf {
// Shapes whose leaves run over a whole brick in one loop.
inline constexpr uint32_t kFusedSphere = uint32_t(ShapeKind::Sphere);
inline constexpr uint32_t kFusedBox = uint32_t(ShapeKind::Box);
/// Are these the words of such a leaf: [point] [shape], moved and nothing more? Each file's own, since they are made for other processors.
[[maybe_unused]] static constexpr bool is_fused_leaf(uint32_t point, uint32_t shape) {
    const uint32_t move = point & 31u, kind = (shape >> 5) & 255u;
    return (move == uint32_t(Opcode::PointTranslate) || move == uint32_t(Opcode::PointCell)) &&
           (shape & 31u) == uint32_t(Opcode::Shape) && (kind == kFusedSphere || kind == kFusedBox);
}
/// Custom instructions' way out of the lanes (custom.h).
void custom_points(uint32_t index, const float* params, const double* x, const double* y, const double* z, int count,
                   double* out);
}  // namespace kiln::sdf

// Texts shared with GLSL name parameters they do not always use.
#pragma GCC diagnostic ignored "-Wunused-parameter"
