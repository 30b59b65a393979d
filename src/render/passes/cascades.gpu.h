// SPDX-License-Identifier: MIT
// Shadow maps of meshes under one sun, see shadow_cascades.h. A map holds heights: how far up against the light its nearest triangle is, as a share
// of the casters' range; 0 where there is none.

#ifdef __cplusplus
#pragma once
#endif
#include "math/math.gpu.h"
#ifdef __cplusplus
namespace kiln::render {
using uint = uint32_t;
#endif

KILN_CONST uint kMostCascades = 4u;

struct CascadesBlock {
    vec4 u, v, w;     // unit axes; w.w: metres that the eye is above where casters begin
    vec4 squares[4];  // x, y: where the eye is on the map, -1 to 1; z: of the map, a metre; w: metres a texel
    vec4 casters[4];  // x, y: its middle, z: its half side, where the widest goes from -1 to 1
    float range;      // metres that a height of 1 is
    uint light;       // number of the light in the frame
    uint count;
    uint side;  // texels
};

// A part's places in light space: rows, dot(row.xyz, p) + row.w of its own places; u and v of the widest square, w as heights.
struct CascadePart {
    vec4 u, v, w;
};

struct CascadeDrawPush {
    uint first;     // of the list
    float u, v;     // the map's middle
    float per_map;  // of the map, a unit of the widest
};

struct CascadeCullPush {
    uint clusters;  // in the list of casters: those without holes first
    uint solid;     // … so many
    uint pad_0, pad_1;
};

// Arguments of a draw.
KILN_CONST uint kDrawWords = 4u;

#ifdef __cplusplus
static_assert(sizeof(CascadesBlock) == 192 && sizeof(CascadePart) == 48);
}  // namespace kiln::render
#endif
