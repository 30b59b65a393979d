// SPDX-License-Identifier: MIT
// The public face of the image metrics.

#include "image/metrics.h"

#include <kiln/world.h>

namespace kiln {

Result<ImageDifference> compare_images(const std::string& a, const std::string& b) {
    const auto d = image::compare_files(a, b);
    if (!d) return d.error();
    return ImageDifference{.flip = d->flip, .psnr = d->psnr, .ssim = d->ssim, .max_abs = d->max_abs};
}

}  // namespace kiln
