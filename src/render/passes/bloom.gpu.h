// SPDX-License-Identifier: MIT
// What the bloom kernels share with C++.

#ifdef __cplusplus
#pragma once
#include "field/words.gpu.h"
namespace kiln::render {
using uint = uint32_t;
#else
#include "field/words.gpu.h"
#endif

KILN_CONST int kBloomGroup = 8;  // a workgroup is 8 x 8 texels
// The blur along one axis: a Gaussian of two texels' deviation, this many texels to each side.
KILN_CONST int kBlurReach = 6;

struct BloomPush {
    int width, height;  // of the target
    float coarser;      // up: share of the coarser levels
    float threshold;    // bright: exposed luminance above which light counts
    int along_x;        // blur: 1 along x, 0 along y
    int pad_0, pad_1, pad_2;
};

#ifdef __cplusplus
static_assert(sizeof(BloomPush) == 32);
}  // namespace kiln::render
#endif
