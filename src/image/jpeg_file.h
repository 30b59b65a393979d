// SPDX-License-Identifier: MIT
// JPEG images in memory: baseline and progressive, grey or colour, 8 bits. Any thread.
#pragma once

#include "image/image.h"

#include <kiln/result.h>

#include <span>
#include <string>

namespace kiln::image {

/// Whether the bytes begin as a JPEG does.
bool is_jpeg(std::span<const std::byte> bytes);

/// One channel or three. Errors are of kind Input and begin with `name`; a picture that is cut short is one.
Result<Pixels> decode_jpeg(std::span<const std::byte> bytes, const std::string& name);

}  // namespace kiln::image
