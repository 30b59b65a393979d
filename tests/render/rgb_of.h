// SPDX-License-Identifier: MIT
// Pictures as what the perceptual metric compares.
#pragma once

#include "image/metrics.h"
#include "render/lib/color.gpu.h"
#include "render/reference.h"

#include <kiln/renderer.h>

#include <algorithm>

namespace kiln::render {

/// Without alpha, sRGB in [0, 1].
inline image::Rgb rgb_of(const Picture& picture) {
    image::Rgb out{picture.width, picture.height, {}};
    for (size_t i = 0; i < picture.srgb.size(); ++i)
        if (i % 4 != 3) out.values.push_back(float(picture.srgb[i]) / 255);
    return out;
}

/// What is brighter than white is white.
inline image::Rgb rgb_of(const ReferencePicture& p) {
    image::Rgb out{p.width, p.height, {}};
    for (size_t i = 0; i < p.rgba.size(); ++i)
        if (i % 4 != 3) out.values.push_back(shade::srgb_from_linear(std::clamp(p.rgba[i], 0.0f, 1.0f)));
    return out;
}

}  // namespace kiln::render
