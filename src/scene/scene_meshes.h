// SPDX-License-Identifier: MIT
// The triangle meshes of a scene, read for drawing. One that cannot be drawn is told of and left out; the rest of the scene stays.
#pragma once

#include "model/drawable.h"
#include "scene/scene_file.h"

#include <kiln/renderer.h>

#include <memory>
#include <string>
#include <vector>

namespace kiln::scene {

struct SceneMeshes {
    std::vector<std::shared_ptr<const model::Drawable>> models;  ///< by SceneData::meshes; null: cannot be drawn
    std::vector<std::string> faults;                             ///< errors as the reader writes them, with their place
    std::vector<std::string> notes;                              ///< what of a model is not drawn

    bool drawn(const SceneData& scene, size_t mesh) const { return models[mesh] && !scene.meshes[mesh].hidden; }
    /// What a frame draws of them: all that are not hidden.
    std::vector<MeshInstance> instances(const SceneData& scene) const;
    /// World box of what is drawn.
    Box3 bounds(const SceneData& scene) const;
};

/// Reads every file once.
SceneMeshes load_meshes(const SceneData& scene);

}  // namespace kiln::scene
