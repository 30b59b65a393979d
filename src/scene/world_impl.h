// SPDX-License-Identifier: MIT
// What a World holds: the scene's data, ids of edits, and what was compiled from them.
#pragma once

#include "scene/heights.h"
#include "scene/scene_file.h"

#include "field/field.h"
#include "field/host_bricks.h"

#include <kiln/world.h>

#include <memory>
#include <mutex>
#include <string>
#include <unordered_map>
#include <vector>

namespace kiln {

struct World::Impl {
    struct Slot {
        uint32_t position = UINT32_MAX;  ///< in data.edits; UINT32_MAX when free
        uint32_t generation = 0;
    };

    scene::SceneData data;
    std::vector<EditId> ids;  ///< by position
    std::vector<Slot> slots;
    std::vector<uint32_t> free_slots;
    std::unordered_map<std::string, uint32_t> names;  ///< of edits, to positions

    void number_all();
    EditId new_id(uint32_t position);
    std::optional<uint32_t> position(EditId id) const;
    std::optional<uint32_t> position_of(std::string_view name) const;
    void rename(const std::string& old_name, const std::string& name, uint32_t position);
    void erase(uint32_t position);
    std::string free_name(const Edit& edit) const;
    /// Why an edit given by code is refused.
    std::optional<Error> edit_fault(const Edit& edit);
    std::optional<Error> compile_fault(const Edit& edit);

    /// What the field is made with, after defaults.
    struct Resolution {
        float voxel_size = 0;
        Box3 bounds;
    };
    Resolution resolution(const sdf::Program& program, const FieldSettings& settings) const;

    struct Built {
        std::shared_ptr<const field::Field> field;
        int coarsened = 0;
    };

    // Made when asked; under the mutex, because const functions may be called from any thread.
    std::mutex mutex;
    std::shared_ptr<const sdf::Program> program;
    Built built;
    FieldSettings built_with;
    bool stale = false;                               ///< `built` is of an older program
    std::shared_ptr<const field::HostBricks> bricks;  ///< of some revision of the field
    scene::Grids grids;

    void changed();
    Result<std::shared_ptr<const sdf::Program>> compiled();
    Result<Built> field(const FieldSettings& settings);
    /// Trilinear in bricks, exact elsewhere; false when there is no field.
    bool sample_bricks(std::span<const vec3> points, const FieldSettings& settings, FieldSample* answers);
};

}  // namespace kiln
