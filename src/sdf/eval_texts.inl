// SPDX-License-Identifier: MIT
// The shape language for KILN_LANES values at a time, and all texts in it. Included inside a namespace.
#include "sdf/lang/simd.h"
#define KILN_T param
#include "sdf/lang/trig.sdf.h"
#undef KILN_T
#define KILN_T real
#include "sdf/lang/trig.sdf.h"
#undef KILN_T
#include "sdf/lang/explog.sdf.h"
#include "sdf/lang/material.sdf.h"

#include "sdf/texts.gen.inl"
