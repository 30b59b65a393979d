// SPDX-License-Identifier: MIT
// What the motion pass knows of two cameras, without their jitter.

#ifdef __cplusplus
#pragma once
#endif
#include "render/lib/camera.gpu.h"
#ifdef __cplusplus
namespace kiln::render {
using shade::CameraParams;
using uint = uint32_t;
#endif

struct MotionParams {
    CameraParams now, before;
    float moved_x, moved_y, moved_z;  // the eye, from the frame before to this one, metres
    uint still;                       // 1: both cameras are the same
};

#ifdef __cplusplus
static_assert(sizeof(MotionParams) == 144);
}  // namespace kiln::render
#endif
