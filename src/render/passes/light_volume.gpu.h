// SPDX-License-Identifier: MIT
// What the kernels that rasterise lights share with C++.

#ifdef __cplusplus
#pragma once
#endif
#include "render/passes/shadow.gpu.h"
#ifdef __cplusplus
namespace kiln::render {
#endif

KILN_CONST uint kVolumeCorners = 60u;  // of the twenty triangles of an icosahedron; others use fewer

#ifdef __cplusplus
}  // namespace kiln::render
#endif
