// SPDX-License-Identifier: MIT
// What lets light through, as kernels see it. Kernels include frame.gpu.h first.

#ifdef __cplusplus
#pragma once
#include "render/passes/frame.gpu.h"
namespace kiln::render {
#endif

// By the number of the instance; 0 of those that are solid. As large as an InstanceNode: shadow_glass.comp reads both from one buffer.
struct GlassRecord {
    float ior;
    float opacity;       // share of light that stays outside
    float absorbed_red;  // a metre: light falls as exp(-absorbed metres)
    float alpha;         // of its surface: roughness²
    float absorbed_green, absorbed_blue;
    float pad_1, pad_2;
};

// What a pixel's ray does, beside the share of light that it brings.
KILN_CONST float kRayRests = 0.0f;  // nothing: it has met what is solid, or the sky
KILN_CONST float kRayGoes = 1.0f;
KILN_CONST float kRayParted = 2.0f;  // likewise; what it threw back where it left glass first goes its own way

// A step of rays through what is transparent, see through_bend.comp.
KILN_CONST uint kThroughCamera = 1u;  // the first of the camera's rays, for which what is solid is lit already
KILN_CONST uint kThroughParts = 2u;   // rays part: what glass mirrors, and what it throws back from inside
KILN_CONST uint kThroughLast = 4u;    // what else lets light through is not looked at
KILN_CONST uint kThroughBegins = 8u;  // no ray has ended yet

// A visibility word's state along rays inside glass: they leave it past an edge too thin for a voxel, unbent.
KILN_CONST uint kSeenGlassLeft = 8u;

// A part of the tile where something may let light through, a picture of its own.
struct ThroughPush {
    int from_x, from_y;  // its first pixel in the tile
    int width, height;
    uint step;     // some of kThrough…
    uint passed;   // steps before this one
    uint picture;  // of a row of them that become one over time
    uint pad_0;
};

// Lobes of rough glass have as many rays, one a pixel, of four by four neighbours.
KILN_CONST int kLobeSide = 4;
// A lobe narrower than that many pixels is taken for a mirror's.
KILN_CONST float kLobePixels = 2.0f;

struct MeshTracePush {
    uint through;  // 1: what blends is looked for, 0: what is solid
    uint pad_0, pad_1, pad_2;
};

#ifdef __cplusplus
static_assert(sizeof(GlassRecord) == 32 && sizeof(ThroughPush) == 32 && sizeof(MeshTracePush) == 16);
}  // namespace kiln::render
#endif
