// SPDX-License-Identifier: MIT
// The image of a scene's environment, read and checked.
#pragma once

#include "image/image.h"

#include <kiln/result.h>

#include <string>

namespace kiln::scene {

/// Most pixels of an image: beyond 8192 x 4096 they would take more than half a gigabyte while they are read.
inline constexpr int64_t kMostSkyPixels = 8192 * 4096;

/// Errors are of kind Input and name the file: missing, broken, too large, or with a pixel that is not finite.
Result<image::FloatPixels> load_sky_image(const std::string& path);

}  // namespace kiln::scene
