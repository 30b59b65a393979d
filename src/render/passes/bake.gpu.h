// SPDX-License-Identifier: MIT
// What the bake kernels share with C++.

#ifdef __cplusplus
#pragma once
#endif
#include "field/words.gpu.h"
#ifdef __cplusplus
namespace kiln::render {
using uint = uint32_t;
#endif

KILN_CONST int kBakeThreads = 64;  // one workgroup a brick, one thread a row of 8 texels along x
KILN_CONST int kBakeCopyBytes =
    256;  // row of the copy path's buffer: as many bricks side by side as fit (every device can copy it)
KILN_CONST int kBakeCopyRows = 64;  // rows of such a group: 8 (y) of 8 (z)

struct BakePush {
    float voxel_size;  // metres
    float voxels_per_metre;
    uint params_first;      // in the numbers buffer
    uint atlas_bricks_x_y;  // as in GridParams
};

#ifdef __cplusplus
static_assert(sizeof(BakePush) == 16);
}  // namespace kiln::render
#endif
