// SPDX-License-Identifier: MIT
// The scenes that come with Kiln: scenes/*.kiln.json, built into the library.
#pragma once

#include <span>
#include <string_view>

namespace kiln::scene {

struct BundledScene {
    std::string_view name, json;
};

/// By name.
std::span<const BundledScene> bundled_files();

}  // namespace kiln::scene
