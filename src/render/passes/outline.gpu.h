// SPDX-License-Identifier: MIT
// Outlines of edits: what their kernels share with C++.

#ifdef __cplusplus
#pragma once
#endif
#include "math/math.gpu.h"
#ifdef __cplusplus
namespace kiln::render {
using uint = uint32_t;
#endif

KILN_CONST int kOutlineGroup = 8;
KILN_CONST uint kNoSeed = ~0u;  // else x | y << 16 of a pixel

struct OutlineRecord {
    float red, green, blue;  // linear
    float width_px;
    uint code_first, code_count;  // the edit alone, as `p_world -> distance in register 0`
    float blend;  // metres: how far from its own surface a blend may have moved what is its; see outline_mask.comp
    uint paints;  // 1: it changes no distance
    uint
        instance;  // whose object it is part of: its code then counts from the object's origin; kNoInstance: the field's
    uint pad_0, pad_1, pad_2;
};

struct OutlinePush {
    int width, height;
    int step;    // pixels
    uint count;  // of records
};

#ifdef __cplusplus
static_assert(sizeof(OutlineRecord) == 48 && sizeof(OutlinePush) == 16);
}  // namespace kiln::render
#endif
