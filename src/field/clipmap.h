// SPDX-License-Identifier: MIT
// Clipmap: a field without an edge. Levels of cells around a focus (levels.gpu.h), each baked from the edits at its own resolution.
// move() shifts windows: cells of the new shells are missing until work() has made them, coarse levels first, and the picture shows the next
// coarser level there. edit() queues what a change reaches; a level shows it when all its bricks are made, the old ones until then. work()
// keeps to a budget; after a jump the picture is coarse at first, drawn from a net (clipmap_net.cpp) where the last level has nothing yet.
//
// At any time a level shows exactly one state of the world, level_program(): its bricks hold, bit for bit, the distances that a field of
// that program built from nothing would, but for missing cells. Materials deep under cuts may differ from a field's, whose blocks of
// cells begin elsewhere. A value: a copy is cheap and shares every page that did not change, so snapshots
// are kept by copying. Reading is for any thread; changing is the owner's.
#pragma once

#include "field/cell_groups.h"
#include "field/cell_maker.h"
#include "field/field.h"
#include "field/levels.gpu.h"
#include "field/rough_cells.h"

#include <array>
#include <chrono>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace kiln::field {

struct ClipmapOptions {
    float voxel_size = 0.02f;  ///< of the finest level, metres
    int levels = 6;            ///< [1, kMostLevels]
    int cells = 64;            ///< a side of each level; a power of two, [32, 128]
    DistanceFormat format = DistanceFormat::Half;
    uint32_t max_bricks = 1u << 17;  ///< of all levels; the least important go when they are too many
    int workers = 0;                 ///< 0: all cores
};

/// A net's coarsest level needs no more bricks than this.
inline constexpr uint32_t kNetBricks = 5 * 5 * 5;

/// What one work() may cost. Whatever is said here, a level of the net is made at once where the picture has nothing else, or it would have a
/// hole: no more than the bricks said here or kNetBricks, which count; where seconds are said, its coarsest level and no other. (Of 64 cells more than 12 levels leave the net fewer than it wants: then more.)
struct BakeBudget {
    uint32_t bricks = std::numeric_limits<uint32_t>::max();
    /// Asked between bricks: the last one ends late. What move() took since the last work() counts.
    double seconds = std::numeric_limits<double>::infinity();
    /// Of cells whose words are made exact (rough_cells.h), each a page high.
    uint32_t layers = std::numeric_limits<uint32_t>::max();
};

/// What a picture can show: a pyramid from the eye. Corners are along forward + right + up and so on, which are at right angles.
struct BakeView {
    dvec3 eye;  ///< world, metres
    vec3 forward, right, up;
};

/// Of one level; what is counted since the last move() or work() began is said so.
struct LevelCounts {
    uint32_t bricks = 0;         ///< resident
    uint32_t missing_cells = 0;  ///< queued or refused
    uint32_t entered_cells = 0;  ///< by the last move()
    uint64_t cells_made = 0;     ///< by the last work(): looked at to the end
    uint32_t baked = 0;          ///< bricks, by the last work()
    uint32_t evicted = 0;  ///< bricks whose cells left, by the last move(); given to coarser levels, by the last work()
    uint32_t refused_cells = 0;  ///< of the missing: the pool has no room for them
    uint32_t edits_waiting = 0;  ///< changes that are queued here
    bool skipped = false;        ///< by the last work(): its shell alone exceeds the budget
};

class Clipmap {
public:
    static Result<Clipmap> make(std::shared_ptr<const sdf::Program> program, const ClipmapOptions& options,
                                dvec3 focus_world);

    /// Shifts the levels' windows around the focus. Bakes nothing; a leap costs no more than a step.
    void move(dvec3 focus_world);
    /// The world is `program` now, which is the last one with `changes` made.
    void edit(std::shared_ptr<const sdf::Program> program, std::span<const RowChange> changes);
    /// Bakes what is queued, within the budget. True when nothing is left. Cells that the view may show come first; nothing else depends on it.
    bool work(const BakeBudget& budget = {}, const std::optional<BakeView>& view = {});

    const ClipmapOptions& options() const { return options_; }
    int level_count() const { return options_.levels; }
    /// With those of the net, which come after the last.
    int all_levels() const { return int(levels_.size()); }
    /// Levels that the picture is drawn from now: all, while the net is out.
    int shown_levels() const { return net_ ? all_levels() : options_.levels; }
    float voxel_size(int level) const { return options_.voxel_size * float(1 << level); }
    dvec3 focus() const { return focus_; }
    const LevelCounts& counts(int level) const { return levels_[size_t(level)].counts; }
    const std::shared_ptr<const sdf::Program>& program() const { return newest_; }
    const std::shared_ptr<const sdf::Program>& level_program(int level) const { return levels_[size_t(level)].program; }
    /// First world cell of the window.
    ivec3 first_cell(int level) const { return levels_[size_t(level)].first; }
    CellBox window(int level) const;
    /// The part of the window that the level is drawn in from this focus.
    CellBox drawn(int level) const;
    const CellMap& cells(int level) const { return levels_[size_t(level)].cells; }
    /// Word of a world cell in the window.
    uint32_t cell_word(int level, ivec3 cell) const { return cells(level).at(cell.x, cell.y, cell.z); }
    const Field::Records& records() const { return records_; }
    const AppendArray<sdf::Instruction>& code() const { return code_; }
    std::span<const sdf::Instruction> code_of(uint32_t slot) const {
        return code_.subspan(records_[slot].code_first, records_[slot].code_count);
    }
    using Contents = PagedArray<BrickContent, 16>;
    const BrickContent& content(uint32_t slot) const { return contents_[slot]; }
    const Contents& contents() const { return contents_; }
    uint32_t slot_count() const { return pool_.slot_count(); }
    uint32_t bricks() const { return pool_.in_use() - left_bricks_; }
    LevelsParams params() const;

    /// Distance to the surface as it is drawn, where a brick says: metres.
    struct Sample {
        int level = -1;  ///< -1: outside all levels, or nothing known
        bool from_brick = false;
        float distance = 0;  ///< not from_brick: only its sign is known
    };
    Sample sample(dvec3 p_world) const;
    /// First hit along a ray through all levels; see level_march.gpu.h. t in metres.
    struct Hit {
        int state = kMarchMiss, level = -1;
        double t = 0;
        vec3 normal;  ///< unit
        MarchHit march;
    };
    Hit cast(dvec3 origin_world, vec3 direction, double t_max, bool accelerate = true) const;

private:
    struct Leaf {
        ivec3 cell;
        uint32_t code_first = 0, code_count = 0;
        BrickContent content;
    };
    struct Emptied {
        ivec3 cell;
        bool inside;
    };
    struct Made {
        std::vector<Leaf> leaves;
        std::vector<Emptied> empties;
        std::vector<sdf::Instruction> code;
        uint64_t cells = 0;
        bool stopped = false;
    };
    // A block of cells that a change reaches, cut to a box; which of them are done.
    struct Part {
        ivec3 block;
        CellBox clip;
        std::array<uint64_t, 64> done{};
    };
    // Changes that a level will show at once.
    struct Batch {
        std::shared_ptr<const sdf::Program> program;
        std::vector<CellBox> boxes;  // world cells
        std::vector<uint32_t> removed, inserted;
        std::vector<Part> parts;  // to do
        std::vector<Made> made;
        uint64_t since = 0;  // number of the work() before which it came
        uint32_t changes = 0;
    };
    struct Level {
        ivec3 first;
        CellMap cells;
        std::shared_ptr<const sdf::Program> program;
        std::vector<ivec3> blocks;   // that have missing cells
        std::vector<ivec3> refused;  // likewise, but no room
        bool recount = false;        // what was refused
        RoughCells rough;
        std::optional<Batch> active, waiting;
        uint32_t shell = 0;  // cells that entered since the last work()
        LevelCounts counts;
    };
    using Clock = std::chrono::steady_clock;
    static constexpr uint32_t kUnlimited = std::numeric_limits<uint32_t>::max();
    // What is left of a budget.
    struct Run {
        uint32_t bricks = kUnlimited;
        bool timed = false;
        Clock::time_point deadline{};
        int workers = 0;

        bool goes_on() const;
        void spend(size_t n);
        // Blocks at once, so that each may make a good number of bricks and time is asked for often.
        size_t wave(size_t queued) const;
    };

    Clipmap() = default;
    ivec3 first_cell_for(int level, dvec3 focus, const ivec3* old) const;
    CellLattice lattice(int level, ivec3 block) const;
    void enter(int level, const CellBox& box);
    void enter_all(int level);
    void queue_blocks(Level& level, const CellBox& box) const;
    void begin(Batch& batch, int level) const;
    void add_parts(Batch& batch, const CellBox& clip) const;
    bool fill(int level, Run& run, const CellBox& where, const CellGroups* only = nullptr);
    std::vector<CellGroups> seen_groups(const BakeView& view) const;
    bool apply(int level, Run& run);
    void publish(int level, Made& made, const CellBox& window);
    void lose(int level, ivec3 cell);
    void refuse(int level, ivec3 cell);
    void release(uint32_t slot);
    void release_left();
    uint32_t take_slot(int level, ivec3 cell);
    bool give_back(int level, ivec3 cell);
    void forget_changes(Level& level) const;
    static int net_levels(const ClipmapOptions& options);
    CellBox net_part(int level) const;
    bool has_missing(int level, const CellBox& box) const;
    bool needs_net() const;
    bool fill_net(int level, Run& run);
    void drop_net();
    uint32_t all_cells() const {
        return uint32_t(options_.cells) * uint32_t(options_.cells) * uint32_t(options_.cells);
    }
    bool settle(const Run& run, uint32_t& layers);
    void count();
    void compact_code();
    float distance_cells(int level, ivec3 cell) const;

    ClipmapOptions options_;
    std::vector<Level> levels_;
    std::shared_ptr<const sdf::Program> newest_;
    dvec3 focus_;
    Field::Records records_;
    Contents contents_;
    AppendArray<sdf::Instruction> code_;
    uint64_t live_code_ = 0;
    BrickPool pool_{0};
    uint64_t works_ = 0;
    struct Victim {
        float distance;
        ivec3 cell;
    };
    // A window that left as a whole: its bricks are given back page by page.
    struct Left {
        CellMap cells;
        size_t page = 0;
    };
    std::vector<Left> left_;
    uint32_t left_bricks_ = 0;
    Clock::duration moved_{};      // what move() took since the last work()
    std::vector<Victim> victims_;  // of give_back(): bricks of a level, the farthest last
    int victims_level_ = -1;
    bool room_ = false;  // slots came free since cells were refused
    bool net_ = false;   // the net is out
    CellMap nothing_;    // of a level that has no cell
};

}  // namespace kiln::field
