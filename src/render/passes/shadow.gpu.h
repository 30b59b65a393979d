// SPDX-License-Identifier: MIT
// What the shadow and light kernels share with C++. The lights of a tile's list are taken sixteen at a time.

#ifdef __cplusplus
#pragma once
#endif
#include "render/lib/lights.gpu.h"
#ifdef __cplusplus
namespace kiln::render {
using shade::LightRecord;
using uint = uint32_t;
#endif

KILN_CONST uint kLightsAtOnce = 16u;

struct ShadowPush {
    uint first_light;  // of this batch, in the list of each tile
    uint more;         // 1: batches follow, sums are kept for them
    uint pad_0, pad_1;
};

#ifdef __cplusplus
static_assert(sizeof(ShadowPush) == 16);
}  // namespace kiln::render
#endif
