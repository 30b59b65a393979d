// SPDX-License-Identifier: MIT
// What the exposure kernels share with C++.

#ifdef __cplusplus
#pragma once
#endif
#include "render/lib/exposure.gpu.h"
#ifdef __cplusplus
namespace kiln::render {
using shade::ExposureState;
#endif

KILN_CONST int kExposureGroup = 16;  // a workgroup counts 16 x 16 threads' pixels, one a bin afterwards
KILN_CONST int kExposureStep = 4;    // pixels a thread counts along each axis

struct ExposurePush {
    float seconds;     // since the picture before; 0: an eye that is used to it at once
    float correction;  // the camera's exposure
    int width, height;
};

#ifdef __cplusplus
static_assert(sizeof(ExposurePush) == 16);
}  // namespace kiln::render
#endif
