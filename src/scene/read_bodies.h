// SPDX-License-Identifier: MIT
// Reads the sections of what is not an edit: meshes, bodies, characters; of a whole scene, or alone, as commands give them.
#pragma once

#include "scene/read_values.h"
#include "scene/scene_file.h"

#include <functional>
#include <string_view>
#include <unordered_map>
#include <vector>

namespace kiln::scene {

/// Ids of a list, to their places in it.
using Ids = std::unordered_map<std::string_view, uint32_t>;

/// What the names in these sections mean. Those of the section that is read itself say nothing.
struct BodyNames {
    const NameNumbers& materials;
    std::function<bool(std::string_view)> edit;                ///< whether there is one
    std::function<std::vector<std::string_view>()> all_edits;  ///< to suggest one; may be empty
    Ids meshes, bodies, characters;
};

// All return false after a fault, with `in.error` set.
/// Ids of the list at `at`, each once and none empty.
bool read_ids(ValueReader& in, JsonIndex at, Ids& out);
bool read_meshes(ValueReader& in, JsonIndex at, const BodyNames& names, std::vector<SceneMesh>& out);
bool read_bodies(ValueReader& in, JsonIndex at, const BodyNames& names, std::vector<SceneBody>& out);
bool read_characters(ValueReader& in, JsonIndex at, const BodyNames& names, std::vector<SceneCharacter>& out);

}  // namespace kiln::scene
