// SPDX-License-Identifier: MIT
// From light to what a screen shows: bloom (what a lens scatters), exposure, tone map, sRGB. The plan of the bloom pyramid, and the host's
// way through all of it: for pictures that no GPU made, for those drawn in tiles, and to judge the kernels.
#pragma once

#include "render/lib/exposure.gpu.h"

#include <kiln/renderer.h>

#include <span>
#include <vector>

namespace kiln::render {

// Level i of the pyramid has size / 2^(i + 1) texels. `coarser`: how much of level i's mix is what lies below it.
struct BloomLevel {
    int width = 0, height = 0;
    float coarser = 0;
};
// Each level is half as large as the one before, rounded up: a texel is always two by two of the finer ones (beyond an odd edge, of its
// continuation). A scale that were a little off 2 would drift across the filter's taps, which then count some texels twice and others never.
// Octaves of a glow whose widest is `size` of the picture's height: each finer one has three quarters of the next coarser one's light, and
// the finest all that would be finer still. So the glow is as large, seen from the eye, at any resolution.
std::vector<BloomLevel> bloom_levels(int width, int height, float size);

// Passes of the ping-pong Gaussian, every second one along y.
inline constexpr int kBlurPasses = 10;

bool needs_whole_picture(const Camera& camera);  // bloom or automatic exposure

// The exposure that follows from `rgba` (4 floats a pixel).
shade::ExposureState measured_exposure(std::span<const float> rgba, const Camera& camera, float seconds,
                                       const shade::ExposureState& was);
// The glow alone, a colour a pixel, times nothing. `multiplier`: the exposure, for a Gaussian's threshold.
std::vector<vec3> glow_of(const Picture& picture, const Camera& camera, float multiplier, int workers = 0);
// picture.srgb from picture.rgba, which stays as it is. Workers: 0 for all cores.
void develop(Picture& picture, const Camera& camera, const shade::ExposureState& exposure, int workers = 0);

}  // namespace kiln::render
