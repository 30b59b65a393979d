// SPDX-License-Identifier: MIT
// Small scenes for tests.
#pragma once

#include "scene/scene_file.h"

#include <gtest/gtest.h>

#include <string>

namespace kiln::scene {

/// A scene with these edits (comma-separated) and whatever else is given as members.
inline std::string scene_with(const std::string& edits, const std::string& more = "") {
    return "{\"format\": 1" + (more.empty() ? "" : ", " + more) + ", \"edits\": [" + edits + "]}";
}

/// The reader's message, or the compiler's; "" when the scene is fine.
inline std::string fault_of(const std::string& text) {
    const auto world = World::parse(text, "s.json");
    return world ? "" : world.error().message;
}

}  // namespace kiln::scene
