// SPDX-License-Identifier: MIT
// What every reader of pictures promises of any bytes, for the deterministic tests and for libFuzzer: the broken promise, or nothing.
#pragma once

#include "complaint.h"
#include "image/image.h"

#include <string>

namespace kiln::image {

// Pixels: Pixels or FloatPixels. `name` is the file's, as the reader was told.
template <typename Pixels>
std::string pixels_complaint(const Result<Pixels>& picture, const std::string& name) {
    if (!picture) return error_complaint(picture.error(), name);
    if (picture->width < 1 || picture->height < 1 || picture->width > kMaxSide || picture->height > kMaxSide)
        return "a picture of " + std::to_string(picture->width) + " x " + std::to_string(picture->height);
    if (picture->channels < 1 || picture->channels > 4) return std::to_string(picture->channels) + " channels";
    const size_t values = size_t(picture->width) * size_t(picture->height) * size_t(picture->channels);
    return picture->values.size() == values ? "" : "width x height x channels are not its values";
}

}  // namespace kiln::image
