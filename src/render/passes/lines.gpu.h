// SPDX-License-Identifier: MIT
// Debug lines as kernels see them.

#ifdef __cplusplus
#pragma once
#endif
#include "render/lib/camera.gpu.h"
#ifdef __cplusplus
namespace kiln::render {
using shade::CameraParams;
using uint = uint32_t;
#endif

KILN_CONST int kLineGroup = 8;  // a workgroup is 8 x 8 pixels

// Ends count from the eye, metres.
struct LineRecord {
    float a_x, a_y, a_z;
    float width_px;
    float b_x, b_y, b_z;
    float hidden;
    float red, green, blue;
    float pad_0;
};

struct LineParams {
    CameraParams camera;  // without taa's jitter
    int width, height;    // pixels of the whole picture
    int tile_x, tile_y;   // of the tile's first pixel
    int tile_width, tile_height;
    int pad_0, pad_1;
};

struct LinePush {
    int width, height;
};

#ifdef __cplusplus
static_assert(sizeof(LineRecord) == 48 && sizeof(LineParams) == 96);
}  // namespace kiln::render
#endif
