// SPDX-License-Identifier: MIT
// OpenEXR files: linear light as 16-bit floats, depth as 32-bit floats (+infinity where nothing is). Any thread.
#pragma once

#include "image/image.h"

#include <kiln/result.h>

#include <span>
#include <string>

namespace kiln::image {

// RGB (3 channels; RGBA with an A) if the file has an R, G or B, missing ones 0; else its first channel alone (Y, Z, …).
// Errors are of kind Input and begin with the file's name; more than `most_pixels` is one, before room is made for them.
Result<FloatPixels> read_exr(const std::string& path, int64_t most_pixels = INT64_MAX);
Result<FloatPixels> decode_exr(std::span<const std::byte> bytes, const std::string& name,
                               int64_t most_pixels = INT64_MAX);

// 3 or 4 channels, stored as halves: beyond 65504 is stored as that, NaN as 0. The file appears whole or not at all.
Result<void> write_exr(const std::string& path, int width, int height, int channels, std::span<const float> values);
// One channel, Z, stored as it is in 32 bits.
Result<void> write_exr_depth(const std::string& path, int width, int height, std::span<const float> metres);

}  // namespace kiln::image
