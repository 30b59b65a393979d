// SPDX-License-Identifier: MIT
// What a World holds: the scene's data, ids of edits, and what was compiled from them.
#pragma once

#include "scene/box_cover.h"
#include "scene/command.h"
#include "scene/edit_list.h"
#include "scene/exact.h"
#include "scene/heights.h"
#include "scene/history.h"
#include "scene/journal.h"
#include "scene/movers.h"
#include "scene/past.h"
#include "scene/scene_file.h"
#include "scene/scene_meshes.h"
#include "scene/sky_image.h"

#include "base/hash.h"
#include "base/paged_array.h"
#include "field/clipmap.h"
#include "field/field.h"
#include "field/host_bricks.h"
#include "render/lib/environment_map.h"

#include <kiln/world.h>

#include <map>
#include <memory>
#include <mutex>
#include <optional>
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
    scene::SceneData data;  ///< but for its edits
    scene::EditList edits;  ///< their rows are those of `list`
    uint64_t names_given = 0;

    // Changes (world_changes.cpp). Each exchanges what the change holds with what the world has.
    Result<void> exchange(World& world, scene::Change& change);
    Result<void> exchange_edit(scene::Change& change);
    Result<void> exchange_material(scene::Change& change);
    Result<void> exchange_object(scene::Change& change);
    Result<void> exchange_meshes(scene::Change& change);
    /// Finds again what stands apart, after which there is another program.
    void apart_anew();
    template <typename T>
    Result<void> make_section(World& world, scene::Change::What what, std::vector<T> items, const std::vector<T>& had);
    /// As exchange(), of changes that were good a moment ago.
    void take_back(World& world, scene::Change& change);
    /// The command that leads from the state that the change holds to what the world has now.
    std::string command_of(const World& world, const scene::Change& change) const;
    /// Makes a change, in the journal and the history too.
    Result<void> make(World& world, scene::Change change);
    /// What was assigned to the world's public members becomes a step.
    Result<void> record_stage(const World& world);
    Result<void> journal_change(const World& world, const scene::Change& change, uint32_t& sequence);
    Result<void> apply(World& world, scene::Command command);
    Result<void> go_to(World& world, uint32_t step);
    Result<void> end_group(World& world);
    Result<void> cancel_group(World& world);
    void keep_log(const World& world);
    std::vector<HistoryStep> steps() const;
    scene::CommandNames names() const;

    std::unique_ptr<scene::Log> log;
    std::unique_ptr<scene::Journal> journal;
    std::unique_ptr<scene::Past> past;  ///< beside a journal
    std::optional<JournalReport> report;
    /// While a journal is read: nothing is compiled until all is there.
    bool compile_later = false;
    bool group_left_open = false;  ///< by the journal that was read

    /// A world that is what another one is, under the same ids and rows, with what was made of it so far (its field, its bricks): nothing is
    /// read, compiled or baked again. It has no journal, no history and was never drawn; dynamic edits are where the list has them.
    static World copy_of(const World& of);

    // Files (world_files.cpp).
    Result<void> read(World& world, std::string text, const std::string& name);
    Result<void> get_ready(World& world);
    /// Applies the records from `first` on, all or up to the first that cannot be; answers how many were taken.
    size_t replay(World& world, std::span<const std::string_view> records, const scene::JournalStart& start,
                  int workers);
    Result<void> read_journaled(World& world, std::string text, const std::string& scene, std::string_view bytes,
                                Records& records, bool lived, int workers);
    /// Becomes the scene of this text by way of its past; where that fails the world is good for nothing.
    bool relive(World& world, const Records& lead, const std::string& text, const std::string& scene, int workers);
    /// The world of this text with its past, where that leads there; else one without anything.
    static World with_past(const Records& lead, const std::string& text, const std::string& scene, int workers,
                           bool& lived);
    /// The scene file's text is this now, which says what the world has: as if it were opened now. False where it does not.
    bool stand_on(std::string text, const std::string& scene);
    Result<void> compact(const World& world);

    void adopt(std::vector<Edit> edits, const std::vector<scene::JsonIndex>& places);
    std::string free_name(const Edit& edit);
    std::string json(const World& world) const;
    /// Puts an edit given by code into the list, at the place `order`, or says why not.
    Result<uint32_t> compile_edit(const Edit& edit, uint64_t order, uint32_t owner);
    std::optional<Error> object_fault(const Edit& placed);
    /// The place in the list just before an edit; makes room where there is none.
    uint64_t order_before(uint32_t slot, uint32_t moving = scene::EditList::kNone);
    void row_changed(uint32_t removed, uint32_t inserted);

    /// What the field is made with, after defaults.
    struct Resolution {
        float voxel_size = 0;
        Box3 bounds;
        Box3 least;  ///< of the bounds, what must be inside: the rest is room to grow
    };
    Resolution resolution(const sdf::Program& program, const FieldSettings& settings) const;
    /// Whether a grid made with these options need not be made anew for what is asked now.
    static bool still_serves(const field::FieldOptions& has, const Resolution& asked, const FieldSettings& settings);

    struct Built {
        std::shared_ptr<const field::Field> field;
        int coarsened = 0;
    };

    // Made when asked; under the mutex, because const functions may be called from any thread.
    std::mutex mutex;
    sdf::Program list;                             ///< what the edits compile to; kept up with every change
    std::shared_ptr<const sdf::Program> program;   ///< a snapshot of it, without what stands apart
    std::shared_ptr<const sdf::Program> all;       ///< with that, where it is
    std::shared_ptr<const WorldView::Impl> asked;  ///< answers about all
    PagedArray<uint32_t, 256> generations;         ///< of slots, shared with views
    Built built;
    FieldSettings built_with;
    std::vector<uint32_t> built_apart;                      ///< rows that were not in its program
    std::vector<field::RowChange> changes;                  ///< since `built`
    std::unordered_map<uint32_t, uint32_t> inserted_since;  ///< rows that `changes` insert, to where
    void forget_changes();
    std::shared_ptr<const field::HostBricks> bricks;  ///< of some revision of the field
    std::optional<field::Clipmap> levels;             ///< of a world of several, where it was last looked at from
    FieldSettings levels_with;
    std::vector<uint32_t> levels_apart;
    std::vector<field::RowChange> level_changes;  ///< since `levels`
    scene::Grids grids;
    scene::SceneMeshes meshes;

    // What moves as a whole (world_movers.cpp). The owner's thread, but for the last three.
    std::map<uint32_t, scene::Mover> movers;          ///< by the slot of their first edit
    std::unordered_map<uint32_t, uint32_t> mover_of;  ///< by the slots of all their edits
    std::map<Hash128, std::weak_ptr<const field::BrickSet>> brick_sets;
    Result<void> compile_mover(scene::Mover& mover);
    bool stands_apart(const scene::Mover& mover) const;
    Result<void> settle_mover(scene::Mover& mover);
    void add_mover(scene::Mover mover);
    void drop_mover(uint32_t key);
    std::optional<scene::Mover> mover_at(uint32_t slot) const;
    // Number of the material that light goes through an edit by, if it does through all of it; else 0.
    uint32_t glass_of(const Edit& edit) const;
    bool stands_alone(const Edit& edit) const { return edit.dynamic || glass_of(edit) != 0; }
    /// After an edit's row was exchanged.
    void mover_changed(uint32_t slot, uint32_t removed, uint32_t inserted);
    /// After the whole list was compiled.
    void find_movers();
    std::vector<uint32_t> apart_rows() const;
    /// What changed in a program without the rows that stand apart, from what changed in the list.
    static std::vector<field::RowChange> changes_beside(std::span<const field::RowChange> of_list,
                                                        std::span<const uint32_t> apart_before,
                                                        std::span<const uint32_t> apart_now);
    /// The list with what stands apart where it is, as hard unions.
    std::shared_ptr<const sdf::Program> whole();
    /// What stands apart, beside a field of that voxel size; `shows`: a frame, for the next of which these poses are the ones before.
    Result<void> instances_of(float field_voxel, field::DistanceFormat format, std::vector<Instance>& out,
                              bool shows = true);
    void outlines_of(Frame& out);

    // What changed since the last frame, for motion (world_motion.cpp).
    struct Shown {
        std::optional<Edit> edit;  ///< as the frame had it; none: it was not there
        Box3 reach;                ///< of all that it was since
    };
    bool has_shown = false;           ///< there was a frame
    bool all_is_new = false;          ///< the list was compiled anew
    std::map<uint32_t, Shown> shown;  ///< by slot
    scene::BoxCover shown_beside;     ///< of what else changed
    Box3 mover_box(uint32_t slot) const;
    void changed_since_frame(uint32_t slot, const Edit* was, uint32_t removed, uint32_t inserted);
    void motions_of(Frame& out);

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
    /// Compiles it again where it keeps rows of edits that are no more.
    void let_old_rows_go();
    std::shared_ptr<const sdf::Program> compiled();
    std::shared_ptr<const WorldView::Impl> view();
    Result<Built> field(const FieldSettings& settings);
    /// The levels around the camera, after one frame's baking of what it sees first.
    Result<std::shared_ptr<const field::Clipmap>> levels_around(const Camera& camera, const FieldSettings& settings,
                                                                const FrameBudget& budget);
    /// Trilinear in bricks, exact elsewhere; false when there is no field.
    bool sample_bricks(std::span<const vec3> points, const FieldSettings& settings, FieldSample* answers);
    /// First solid points along rays by the bricks' march, on the edits' surface; false when there is no field.
    bool cast_bricks(std::span<const Ray> rays, const FieldSettings& settings, RayHit* hits);
    /// The bricks of the field as it is now, and what stands apart from it.
    struct Baked {
        std::shared_ptr<const field::HostBricks> bricks;
        std::vector<Instance> apart;
    };
    std::optional<Baked> baked(const FieldSettings& settings);
};

/// Most cells of a field's grid: their words fill the largest buffer that every device can bind (128 MiB).
constexpr double kMaxCells = double(1u << 25);

inline float longest_side(const Box3& box) {
    const vec3 size = box.max - box.min;
    return std::max({size.x, size.y, size.z});
}

}  // namespace kiln
