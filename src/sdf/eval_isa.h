// SPDX-License-Identifier: MIT
// Raw entry points of each instruction set (eval_entry.inl), and what every eval_*.cpp includes before opening its namespace.
#pragma once

#include "sdf/program.h"

#include <cmath>
#include <cstddef>
#include <cstdint>

#define KILN_DECLARE_ISA(name)                                                                                         \
    namespace kiln::sdf::name {                                                                                        \
    void evaluate_points(const uint32_t* code, size_t count, const float* params, const float* samples,                \
                         const float* x, const float* y, const float* z, int points, float* out);                      \
    void evaluate_mixes(const uint32_t* code, size_t count, const float* params, const float* samples, const float* x, \
                        const float* y, const float* z, int points, float* out, float* id0, float* id1, float* share,  \
                        int slot);                                                                                     \
    }
KILN_DECLARE_ISA(scalar)
KILN_DECLARE_ISA(sse4)
KILN_DECLARE_ISA(avx2)
KILN_DECLARE_ISA(avx512)
#undef KILN_DECLARE_ISA

// Texts shared with GLSL name parameters they do not always use.
#pragma GCC diagnostic ignored "-Wunused-parameter"
