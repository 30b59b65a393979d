// SPDX-License-Identifier: MIT
// The scenes that come with Kiln: scenes/*.kiln.json, built into the library.
#pragma once

#include "scene/scene_file.h"

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
/// Whether it came from a bundled scene: its name is one's, and it is in no folder.
bool is_bundled(const SceneData& scene);
/// A model file that a bundled scene names, the only files that they have; empty: there is none, or the scene is not bundled.
std::span<const unsigned char> bundled_model(const SceneData& scene, std::string_view file);

}  // namespace kiln::scene
