// SPDX-License-Identifier: MIT
// The tape interpreter for one float at a time: the slow twin that every wider one must equal byte for byte.

#include "sdf/eval_isa.h"

#define KILN_SCALAR float
#define KILN_VECTORS 64

namespace kiln::sdf::scalar {
#include "sdf/lang/scalar.h"
#define KILN_T real
#include "sdf/lang/trig.sdf.h"
#undef KILN_T
#include "sdf/lang/explog.sdf.h"
#include "sdf/lang/material.sdf.h"

#include "sdf/texts.gen.inl"

static inline real load(const float* from) { return *from; }
static inline void store(float* to, real v) { *to = v; }

#include "sdf/eval_lanes.inl"
#include "sdf/eval_entry.inl"

#include "sdf/eval_list.inl"
#include "sdf/expression_run.inl"
}  // namespace kiln::sdf::scalar
