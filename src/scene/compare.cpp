// SPDX-License-Identifier: MIT

#include "image/metrics.h"

#include <kiln/world.h>

namespace kiln {

Result<ImageDifference> compare_images(const std::string& a, const std::string& b) {
    const auto d = image::compare_files(a, b);
    if (!d) return d.error();
    return ImageDifference{d->flip, d->psnr, d->ssim, d->max_abs};
}

}  // namespace kiln
