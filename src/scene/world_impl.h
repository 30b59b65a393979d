// SPDX-License-Identifier: MIT
// What a World holds: the scene's data, ids of edits, and what was compiled from them.
#pragma once

#include "scene/exact.h"
#include "scene/heights.h"
#include "scene/scene_file.h"
#include "scene/sky_image.h"

#include "base/paged_array.h"
#include "field/clipmap.h"
#include "field/field.h"
#include "field/host_bricks.h"
#include "render/lib/environment_map.h"

#include <kiln/world.h>

#include <memory>
#include <mutex>
#include <string>
#include <unordered_map>
#include <vector>

namespace kiln {

/// What a view holds; nothing in it changes.
struct WorldView::Impl {
    std::shared_ptr<const sdf::Program> program;
    scene::ExactField exact;
    PagedArray<uint32_t, 256> generations;  ///< by the number that a row's owner is

    Impl(std::shared_ptr<const sdf::Program> compiled, PagedArray<uint32_t, 256> slots)
        : program(std::move(compiled)), exact(*program), generations(std::move(slots)) {}
    /// Of a row of the program, as ExactField names edits.
    EditId id_of(EditId row) const {
        if (!row) return {};
        const uint32_t slot = program->edits[row.index].owner;
        return {slot, generations[slot]};
    }
};

struct World::Impl {
    struct Slot {
        uint32_t position = UINT32_MAX;  ///< in data.edits; UINT32_MAX when free
        uint32_t generation = 0;
        uint32_t row = field::kNoRow;  ///< in `list`
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
    /// Puts an edit given by code into the list, at the place `order`, or says why not.
    Result<uint32_t> compile_edit(const Edit& edit, uint64_t order, uint32_t owner);
    std::optional<Error> object_fault(const Edit& placed);
    /// The place in the list between the edits at two positions; makes room where there is none.
    uint64_t order_between(uint32_t before, uint32_t after);
    void move_position(uint32_t from, uint32_t to);
    void row_changed(uint32_t removed, uint32_t inserted);

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
    sdf::Program list;                             ///< what the edits compile to; kept up with every change
    std::shared_ptr<const sdf::Program> program;   ///< a snapshot of it
    std::shared_ptr<const WorldView::Impl> asked;  ///< answers about `program`
    PagedArray<uint32_t, 256> generations;         ///< of slots, shared with views
    Built built;
    FieldSettings built_with;
    std::vector<field::RowChange> changes;            ///< since `built`
    std::shared_ptr<const field::HostBricks> bricks;  ///< of some revision of the field
    std::optional<field::Clipmap> levels;             ///< of a world of several, where it was last looked at from
    FieldSettings levels_with;
    std::vector<field::RowChange> level_changes;  ///< since `levels`
    scene::Grids grids;

    /// The image of the environment: read when its name is first met, brought into shape when it is first drawn.
    struct SkyImage {
        std::string file;
        std::shared_ptr<const image::FloatPixels> pixels;  ///< until there is a map
        std::shared_ptr<const render::shade::EnvironmentMap> map;
    };
    SkyImage sky_image;
    Result<void> read_sky(const std::string& file);

    /// Compiles the whole list.
    Result<void> compile_all();
    std::shared_ptr<const sdf::Program> compiled();
    std::shared_ptr<const WorldView::Impl> view();
    Result<Built> field(const FieldSettings& settings);
    /// The levels around a place, after one frame's baking.
    Result<std::shared_ptr<const field::Clipmap>> levels_around(vec3 focus, const FieldSettings& settings,
                                                                const FrameBudget& budget);
    /// Trilinear in bricks, exact elsewhere; false when there is no field.
    bool sample_bricks(std::span<const vec3> points, const FieldSettings& settings, FieldSample* answers);
};

}  // namespace kiln
