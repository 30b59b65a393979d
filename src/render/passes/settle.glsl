// SPDX-License-Identifier: MIT
// Visibility words whose t is where refine found the surface. The including kernel declares first: FrameParams frame, utexture2D refined (not read
// without kFrameRefine).

#include "render/passes/refine.gpu.h"

uvec4 settled(uvec4 seen, ivec2 pixel) {
    uint state = seen.y >> 28u;
    if ((state != kSeenBrick && state != kSeenInstance) || (frame.flags & kFrameRefine) == 0u) return seen;
    uint asked = texelFetch(refined, pixel, 0).x;
    if (asked != kNotRefined) seen.x = asked;
    return seen;
}
