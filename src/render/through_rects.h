// SPDX-License-Identifier: MIT
// Where on the screen something may let light through: the parts of a tile that are drawn with bent rays.
#pragma once

#include "render/lib/camera.gpu.h"

#include <kiln/math.h>

#include <span>
#include <vector>

namespace kiln::render {

struct PixelRect {
    int x = 0, y = 0, width = 0, height = 0;
    friend bool operator==(const PixelRect&, const PixelRect&) = default;
};

// Covers what the camera sees of boxes (metres from the eye) in that part of the picture: rectangles that share no pixel, in bands of at most
// `most` pixels, the upper first; none where it sees none. Each costs passes of its own, so two are one where that adds fewer than `apart`
// (above 0) pixels, and there are never more than a few. The order of the boxes changes nothing.
std::vector<PixelRect> through_rects(std::span<const Box3> boxes, const shade::CameraParams& camera,
                                     const PixelRect& tile, int most, int apart);

}  // namespace kiln::render
