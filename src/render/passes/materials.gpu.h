// SPDX-License-Identifier: MIT
// The table of materials as kernels see it: entry i says which row the material of number i has, and holds row i. The two have nothing to
// do with each other; side by side they take one binding, and none moves when the table grows.

#ifdef __cplusplus
#pragma once
#include "render/passes/frame.gpu.h"  // a kernel has it by itself
namespace kiln::render {
#endif

struct MaterialEntry {
    uint row_of_number;
    MaterialRecord row;
};

#ifdef __cplusplus
static_assert(sizeof(MaterialEntry) == 36);
}  // namespace kiln::render
#endif
