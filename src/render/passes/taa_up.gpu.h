// SPDX-License-Identifier: MIT
#ifdef __cplusplus
#pragma once
#endif
#include "math/math.gpu.h"
#ifdef __cplusplus
namespace kiln::render {
using uint = uint32_t;
#endif

struct TaaUpPush {
    int width, height;            // of what is shown
    int width_rays, height_rays;  // of what was lit
    float jitter_x, jitter_y;     // pixels of that: where in them it was looked
    float most_frames;            // that a pixel is made of
    uint valid;                   // 1: there is a history
};

struct UpPush {
    int width, height;
    int width_rays, height_rays;
};

#ifdef __cplusplus
static_assert(sizeof(TaaUpPush) == 32 && sizeof(UpPush) == 16);
}  // namespace kiln::render
#endif
