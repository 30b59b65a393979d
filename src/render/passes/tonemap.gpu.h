// SPDX-License-Identifier: MIT
// What the tone map's kernel shares with C++.

#ifdef __cplusplus
#pragma once
#include "field/words.gpu.h"
namespace kiln::render {
using uint = uint32_t;
#else
#include "field/words.gpu.h"
#endif

KILN_CONST int kToneGroup = 8;  // a workgroup is 8 x 8 pixels

struct TonePush {
    int width, height;
    float scattered;  // share of the light that the pyramid's glow takes
    float added;      // of the Gaussian's glow, at full size
    uint tone_map;    // kiln::ToneMap
    uint pad_0, pad_1, pad_2;
};

#ifdef __cplusplus
static_assert(sizeof(TonePush) == 32);
}  // namespace kiln::render
#endif
