// SPDX-License-Identifier: MIT
// Points and rays through host bricks for AVX-512: 16 lanes.

#include "field/wide_isa.h"

#include <immintrin.h>

#pragma GCC diagnostic ignored "-Wuninitialized"  // GCC 12: false alarms inside its own AVX-512 header (GCC bug 105593)
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"

namespace kiln::field::wide_avx512 {

#include "field/wide_avx512.inl"

#include "field/wide_math.inl"

#include "field/wide_points.inl"

#include "field/wide_one.inl"

#include "field/wide_polish.inl"

#include "field/wide_rays.inl"

}  // namespace kiln::field::wide_avx512
