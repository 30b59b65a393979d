// SPDX-License-Identifier: MIT
// PNG files. Reading: every colour type, 8 and 16 bits; palettes become RGB, fewer than 8 bits become 8. Any thread.
#pragma once

#include "image/image.h"

#include <kiln/result.h>

#include <span>
#include <string>

namespace kiln::image {

// Errors are of kind Input and begin with the file's name.
Result<Pixels> read_png(const std::string& path);
// The same from memory; `name` is for errors.
Result<Pixels> decode_png(std::span<const std::byte> bytes, const std::string& name);

// Writes 8-bit sRGB values (1, 3 or 4 channels) or 16-bit grey, marked as sRGB. The file appears whole or not at all.
// The same pixels give the same bytes.
Result<void> write_png(const std::string& path, const Pixels& pixels);
// 8-bit RGBA, four bytes a pixel.
Result<void> write_png(const std::string& path, int width, int height, std::span<const uint8_t> rgba);

}  // namespace kiln::image
