// SPDX-License-Identifier: MIT
// Where a sun's shadow maps lie: squares across its rays, each some times as wide as the one before, the last round everything that casts.
//
// A square's half side follows from what casts and from the camera's angle and reach, not from where the camera looks, and its middle moves by
// whole texels: a camera that turns or moves sees the same texels (Valient, "Stable Rendering of Cascaded Shadow Maps", ShaderX 6, 2008).
// The smaller squares hold the spheres round what the camera sees up to a distance. Nothing casts beyond the last, so it has no end.
#pragma once

#include "render/passes/cascades.gpu.h"

#include <kiln/renderer.h>

#include <span>
#include <vector>

namespace kiln::render {

// Light space: u and v across the rays, w against them, world metres from the world's origin.
struct ShadowCascades {
    dvec3 u{}, v{}, w{};
    double half = 0;                    // of the widest square; those of the others are a power of two less
    double middle_u = 0, middle_v = 0;  // of the widest
    double low = 0, range = 0;          // along w: where casters begin, and how far up they are
    int side = 0;                       // texels, a power of two
    struct Square {
        double u = 0, v = 0;  // its middle: whole texels from the widest's
        double half = 0;
    };
    std::vector<Square> squares = {};  // the smallest first; at most kMostCascades

    double texel(size_t square) const { return 2 * squares[square].half / side; }
};

// `casters`: their boxes, world metres; at least one that is not empty. `towards`: where the sun's light goes.
ShadowCascades fit_cascades(std::span<const Box3> casters, vec3 towards, const Camera& camera, double aspect, int side);

// As kernels see them: places count from the eye.
CascadesBlock cascades_block(const ShadowCascades& cascades, vec3 eye, uint32_t light);

// Texels a side that suit a picture: as many as its larger side has pixels, as a power of two from 512 to 2048.
int shadow_map_side(int width, int height);

}  // namespace kiln::render
