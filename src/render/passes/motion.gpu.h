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
    uint moved_count;                 // of edits
    uint changed_count;               // of boxes
    uint pad_0, pad_1;
};

// An edit that has moved: from where its points are now to where they were, metres, both from the eye as it is now.
struct MovedRecord {
    vec4 before_x, before_y, before_z;
};

// Where nothing was what it is now: metres from the eye as it is now.
struct ChangedBox {
    float low_x, low_y, low_z, pad_0;
    float high_x, high_y, high_z, pad_1;
};

#ifdef __cplusplus
static_assert(sizeof(MotionParams) == 160 && sizeof(MovedRecord) == 48 && sizeof(ChangedBox) == 32);
}  // namespace kiln::render
#endif
