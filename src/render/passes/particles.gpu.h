// SPDX-License-Identifier: MIT
// Particles as kernels see them: in the order of their distance from the eye, and, for each part of the picture, which may be seen there.
// Kernels include frame.gpu.h first.

#ifdef __cplusplus
#pragma once
#include "render/passes/frame.gpu.h"
namespace kiln::render {
#endif

// Bins are squares of kParticleBin << (2 level) pixels; a particle is in those of the level where it meets few.
KILN_CONST int kParticleBin = 8;
KILN_CONST int kParticleLevels = 5;

// Counted from the eye, metres.
struct ParticleRecord {
    float x, y, z;
    float radius;
    float red, green, blue;  // of the light that it scatters
    float opacity;
    float glow_red, glow_green, glow_blue;
    float moved_x, moved_y, moved_z;  // to where it was in the frame before, from where the eye is now
    float pad_0, pad_1;
};

struct ParticlePush {
    int width, height;
    uint count;
    // A level each, and no arrays: HLSL would give their elements sixteen bytes.
    uint first_0, first_1, first_2, first_3, first_4;       // of its bins in the table of ends
    uint across_0, across_1, across_2, across_3, across_4;  // bins in a row
    uint behind;  // 1: there is something transparent, that hides particles behind it in part
    uint moves;   // 1: what they move is told
    uint sun;     // the light whose shadows fall on them; kNoSun: none
};
KILN_CONST uint kNoSun = ~0u;

#ifdef __cplusplus
static_assert(sizeof(ParticleRecord) == 64 && sizeof(ParticlePush) == 64);
}  // namespace kiln::render
#endif
