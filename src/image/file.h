// SPDX-License-Identifier: MIT
// A whole file as bytes.
#pragma once

#include <kiln/result.h>

#include <cstddef>
#include <string>
#include <vector>

namespace kiln::image {

// "cannot read a/b.png: No such file or directory", of kind Input. Any thread.
Result<std::vector<std::byte>> read_bytes(const std::string& path);

}  // namespace kiln::image
