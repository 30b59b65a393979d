// SPDX-License-Identifier: MIT
// Which tiles of a picture a light may reach, by its range alone, whatever is there to be lit: how many lights a tile has at most,
// before the device has looked at any.
#pragma once

#include "render/lib/camera.gpu.h"

#include <kiln/renderer.h>

#include <cstdint>
#include <span>
#include <vector>

namespace kiln::render {

// In tiles of kClusterSide pixels, ends not included, 16 bits each: x first | end << 16, y first | end << 16.
struct LightRect {
    uint32_t x = 0, y = 0;
    friend bool operator==(const LightRect&, const LightRect&) = default;
};

struct LightRects {
    std::vector<LightRect> rects;  // a light each
    uint32_t most = 0;             // of one tile
    bool local = false;            // some light ends somewhere
};

// Of the part of the picture that begins at pixel (left, top). A light without a range reaches all of it.
LightRects light_rects(std::span<const Light> lights, const shade::CameraParams& camera, int left, int top, int width,
                       int height);
// Every light in every tile.
LightRects all_light_rects(size_t lights, int width, int height);

}  // namespace kiln::render
