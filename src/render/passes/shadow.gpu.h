// SPDX-License-Identifier: MIT
// What the shadow and light kernels share with C++. Lights are taken four at a time.

#ifdef __cplusplus
#pragma once
#endif
#include "render/lib/lights.gpu.h"
#ifdef __cplusplus
namespace kiln::render {
using shade::LightRecord;
using uint = uint32_t;
#endif

KILN_CONST uint kLightsAtOnce = 4u;

struct ShadowPush {
    uint first_light;
    uint pad_0, pad_1, pad_2;
};

#ifdef __cplusplus
static_assert(sizeof(ShadowPush) == 16);
}  // namespace kiln::render
#endif
