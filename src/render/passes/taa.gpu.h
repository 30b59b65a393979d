// SPDX-License-Identifier: MIT
#ifdef __cplusplus
#pragma once
#endif
#include "math/math.gpu.h"
#ifdef __cplusplus
namespace kiln::render {
using uint = uint32_t;
#endif

KILN_CONST int kTaaGroup = 8;

struct TaaPush {
    int width, height;
    uint valid;  // 1: there is a history
    uint pad_0;
};

#ifdef __cplusplus
static_assert(sizeof(TaaPush) == 16);
}  // namespace kiln::render
#endif
