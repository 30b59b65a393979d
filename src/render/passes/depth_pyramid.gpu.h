// SPDX-License-Identifier: MIT
// A pyramid of the depth of a tile: level k has the least (farthest, since depth is reversed) of every 2^k x 2^k pixels, for k from 1 until one
// value is left. Sides are rounded up, so each pixel of a picture of any size is in exactly one value of each level. All levels lie in one
// buffer, the finest first, rows from the top.

#ifdef __cplusplus
#pragma once
#endif
#include "math/math.gpu.h"
#ifdef __cplusplus
namespace kiln::render {
#endif

KILN_CONST int kPyramidTile = 64;       // pixels along a side of what a workgroup reduces to one value
KILN_CONST int kPyramidAtOnce = 6;      // levels that it writes on the way
KILN_CONST float kPyramidNone = 3e38f;  // nearer than anything: of no pixel

KILN_FN int pyramid_side(int pixels, int level) { return (pixels + (1 << level) - 1) >> level; }

KILN_FN int pyramid_levels(int width, int height) {
    int level = 1;
    while ((1 << level) < width || (1 << level) < height) ++level;
    return level;
}

// Where a level begins.
KILN_FN int pyramid_first(int width, int height, int level) {
    int first = 0;
    for (int k = 1; k < level; ++k) first += pyramid_side(width, k) * pyramid_side(height, k);
    return first;
}

struct DepthPyramidPush {
    int width, height;  // pixels
    int from;           // level that is reduced; 0: the picture
    int levels;
};

#ifdef __cplusplus
}  // namespace kiln::render
#endif
