// SPDX-License-Identifier: MIT
// The scenes that come with Kiln: scenes/*.kiln.json, built into the library.
#pragma once

#include <span>
#include <string_view>

namespace kiln::scene {

struct BundledScene {
    std::string_view name, json;
};

struct BundledModel {
    std::string_view name;
    std::span<const unsigned char> bytes;
};

/// By name.
std::span<const BundledScene> bundled_files();
bool is_bundled(std::string_view scene);
/// A model file that a bundled scene names; empty: there is none, or the scene is not bundled.
std::span<const unsigned char> bundled_model(std::string_view scene, std::string_view file);

}  // namespace kiln::scene
