// SPDX-License-Identifier: MIT
// Lists of lights: what the kernels that make and walk them share with C++. The picture is cut into tiles of 16 x 16 pixels; a tile
// has a bit a light, so no list is ever full.

#ifdef __cplusplus
#pragma once
#endif
#include "math/math.gpu.h"
#ifdef __cplusplus
namespace kiln::render {
using uint = uint32_t;
#endif

KILN_CONST int kClusterSide = 16;  // pixels
KILN_CONST uint kNoLight = ~0u;

#ifdef __cplusplus
}  // namespace kiln::render
#endif
