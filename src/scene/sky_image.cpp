// SPDX-License-Identifier: MIT

#include "scene/sky_image.h"

#include "image/exr_file.h"

#include "base/format.h"

#include <cmath>

namespace kiln::scene {

Result<image::FloatPixels> load_sky_image(const std::string& path) {
    auto image = image::read_exr(path, kMostSkyPixels);
    if (!image) return Error{image.error().message + "; name an equirectangular OpenEXR image", ErrorKind::Input};
    for (int y = 0; y < image->height; ++y) {
        for (int x = 0; x < image->width; ++x) {
            for (int c = 0; c < std::min(image->channels, 3); ++c) {
                if (std::isfinite(image->at(x, y, c))) continue;
                return Error{formatted("{}: pixel ({}, {}) is {}; the radiance of a sky must be finite", path, x, y,
                                       std::isnan(image->at(x, y, c)) ? "NaN" : "infinite"),
                             ErrorKind::Input};
            }
        }
    }
    return image;
}

}  // namespace kiln::scene
