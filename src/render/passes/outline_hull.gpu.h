// SPDX-License-Identifier: MIT
// Outlines by the hull of a mesh: what its kernels share with C++.

#ifdef __cplusplus
#pragma once
#include <cstdint>
namespace kiln::render {
using uint = uint32_t;
#endif

struct HullPush {
    float middle_x, middle_y, middle_z;  // of the mesh, from the eye, metres
    uint first;                          // of its clusters
    float red, green, blue;              // linear
    uint owner;                          // of its pixels in the mask
};

#ifdef __cplusplus
static_assert(sizeof(HullPush) == 32);
}  // namespace kiln::render
#else
const float kHullScale = 1.02;
#endif
