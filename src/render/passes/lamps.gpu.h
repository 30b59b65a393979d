// SPDX-License-Identifier: MIT
// Shadow maps of meshes round lamps and spots: a face each for a spot, six for a lamp. A face's plane is a unit before the light; a map holds
// how near what is first there is, kLampNear over metres along the face's axis, 0 where there is nothing. What is flat is linear in that.

#ifdef __cplusplus
#pragma once
#endif
#include "math/math.gpu.h"
#ifdef __cplusplus
namespace kiln::render {
using uint = uint32_t;
#endif

KILN_CONST uint kMostFaces = 48u;    // of all lights together
KILN_CONST float kLampNear = 2e-3f;  // metres: what is nearer to the light casts nothing

struct LampFace {
    vec4 u, v,
        w;  // unit axes: across the map, and ahead; u.w: half of the map on the plane; v.w: the light's range, metres, 0: none
    vec4 at;  // the light, metres from the eye
};

struct LampCullPush {
    uint clusters;  // in the list of casters: those without holes first
    uint solid;     // … so many
    uint faces;
    uint pad_0;
};

struct LampDrawPush {
    uint first;  // of the list
    uint face;
    uint pad_0, pad_1;
};

#ifdef __cplusplus
static_assert(sizeof(LampFace) == 64 && sizeof(LampCullPush) == 16 && sizeof(LampDrawPush) == 16);
}  // namespace kiln::render
#endif
