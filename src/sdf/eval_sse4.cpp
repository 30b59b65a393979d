// SPDX-License-Identifier: MIT
// The tape interpreter for SSE4.1: 4 lanes.

#include "sdf/eval_isa.h"

#include <immintrin.h>

#define KILN_LANES 4
#define KILN_VECTORS (64 / KILN_LANES)

namespace kiln::sdf::sse4 {
#include "sdf/eval_texts.inl"

static inline real load(const float* from) {
    lane_f v;
    __builtin_memcpy(&v, from, sizeof v);
    return v;
}
static inline void store(float* to, real v) { __builtin_memcpy(to, &v.v, sizeof v.v); }

#include "sdf/eval_lanes.inl"

#define KILN_FEW
namespace few {  // the same on sixteen points
#undef KILN_VECTORS
#define KILN_VECTORS (16 / KILN_LANES)
#include "sdf/eval_lanes.inl"
#undef KILN_VECTORS
#define KILN_VECTORS (64 / KILN_LANES)
}  // namespace few

#include "sdf/eval_entry.inl"

#include "sdf/eval_list.inl"
#include "sdf/expression_run.inl"
}  // namespace kiln::sdf::sse4
