// SPDX-License-Identifier: MIT
// What a frame needs of the one before it: where in its pixels it looks, and how the camera moved.
#pragma once

#include "render/passes/motion.gpu.h"

#include <kiln/renderer.h>

#include <cstdint>

namespace kiln::render {

inline constexpr uint32_t kJitterRound = 16;  // frames until the places repeat

// Offset from a pixel's middle, pixels, [-1/2, 1/2): Halton's points of bases 2 and 3 (Halton, 1964).
vec2 jitter_of(uint64_t frame, uint32_t round = kJitterRound);
// As many places for a shown pixel where rays are fewer: `scale` of them along each side.
uint32_t jitter_round(float scale);
// The camera whose rays pass there.
shade::CameraParams jittered(shade::CameraParams camera, vec2 offset_px);

// Does `now` show what `before` did, from nearly there? If not, the picture begins anew.
bool follows(const Camera& now, const Camera& before);

MotionParams motion_params(const Camera& now, const Camera& before, int width, int height);

}  // namespace kiln::render
