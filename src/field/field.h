// SPDX-License-Identifier: MIT
// Field: an immutable snapshot of where the surface is: which cells own bricks, and the pruned code of each brick.
// Made on the CPU, deterministic for any number of workers. Bakers turn its bricks into texels: host_bricks.h on the CPU,
// render/passes/bake on the GPU; both eat the same jobs. Any thread may read a Field. Snapshots share all pages that did not change.
//
// A brick's code has the world's bits at every texel whose value is within the band of kBandVoxels, there with its materials; elsewhere it
// only stays beyond the band. So what bricks hold never depends on how the world came about, though edits that change nothing in a brick
// may or may not be in its code. One thing is decided here: where a cut with a material of its own lies deeper under the surface than the
// band (and blends), a later cut without one shows the material around both, not the first cut's.
#pragma once

#include "base/append_array.h"
#include "field/brick_content.h"
#include "field/brick_pool.h"
#include "field/jumps.h"
#include "sdf/program.h"

#include <kiln/math.h>
#include <kiln/result.h>

#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

namespace kiln::field {

struct FieldOptions {
    float voxel_size = 0.02f;  ///< metres, > 0
    Box3 bounds;               ///< world metres the grid must cover; finite
    DistanceFormat format = DistanceFormat::Half;
    uint32_t max_bricks =
        1u << 19;          ///< pool capacity; a field that needs more is refused as OutOfMemory with the number needed
    int workers = 0;       ///< 0: all cores
    float own_voxels = 1;  ///< a cell owns a brick iff some texel's |value| is below this many voxels; [1, kBandVoxels]
};

/// Counters of the last build or update.
struct BuildStats {
    uint64_t cells_tested = 0;     ///< balls folded at any level of the hierarchy
    uint64_t cells_evaluated = 0;  ///< leaf cells whose texels were looked at
    uint32_t bricks = 0;           ///< resident
    uint32_t bricks_baked = 0;     ///< jobs of this build: new or changed
    uint32_t bricks_freed = 0;
};

/// A row of the program that left the world, and one that came; kNoRow where there is none.
struct RowChange {
    uint32_t removed = UINT32_MAX, inserted = UINT32_MAX;
};
inline constexpr uint32_t kNoRow = UINT32_MAX;

/// Texels of bricks made while a field was: by slot, in no order.
using MadeBricks = std::vector<std::pair<uint32_t, BrickContent>>;

class Field {
public:
    /// Builds from nothing. `program` is kept alive by the field. `made`, if given, receives the texels of every brick.
    static Result<std::shared_ptr<const Field>> build(std::shared_ptr<const sdf::Program> program,
                                                      const FieldOptions& options, MadeBricks* made = nullptr);
    /// The field of `program`, which is old.program() with `changes` made. Its bricks hold, bit for bit, what those of build(program) do;
    /// slot numbers and code may be others. Costs what the changed edits reach; jobs() are the bricks whose texels may have
    /// changed, and `made`, if given, receives them. `stored`, if given, are the texels of old's bricks: fewer then seem to
    /// change. An intersect edit reaches everything.
    static Result<std::shared_ptr<const Field>> update(const Field& old, std::shared_ptr<const sdf::Program> program,
                                                       std::span<const RowChange> changes, MadeBricks* made = nullptr,
                                                       const BrickContents* stored = nullptr);

    const sdf::Program& program() const { return *program_; }
    const std::shared_ptr<const sdf::Program>& shared_program() const { return program_; }
    const FieldOptions& options() const { return options_; }
    GridParams grid() const { return grid_; }  ///< atlas layout left 0; the renderer fills it
    const CellMap& cells() const { return cells_; }
    using Records = PagedArray<BrickRecord, 64>;
    const Records& records() const { return records_; }                  ///< by slot; code_count 0 where free
    const AppendArray<sdf::Instruction>& code() const { return code_; }  ///< pruned code of bricks
    std::span<const sdf::Instruction> code_of(uint32_t slot) const {
        const BrickRecord& r = records_[slot];
        return code_.subspan(r.code_first, r.code_count);
    }
    std::span<const uint32_t> jobs() const {
        return jobs_;
    }  ///< slots whose texels changed since `old`: all after build()
    const BuildStats& stats() const { return stats_; }
    uint32_t slot_count() const { return pool_.slot_count(); }  ///< slots in use are below this
    std::vector<uint32_t> slots() const;                        ///< in use, ascending
    uint64_t revision() const { return revision_; }             ///< unique per snapshot
    uint64_t parent_revision() const {
        return parent_revision_;
    }  ///< the snapshot jobs() is relative to; 0 after build()

    /// Cell word of a world cell; outside the grid: empty, jump 0, sign of the exact value is not known (bit clear).
    uint32_t cell_word(int x, int y, int z) const;

private:
    friend class FieldBuilder;
    Field() = default;
    std::shared_ptr<const sdf::Program> program_;
    FieldOptions options_;
    GridParams grid_{};
    CellMap cells_;
    Records records_;
    AppendArray<sdf::Instruction> code_;
    uint64_t live_code_ = 0;  // instructions that some brick uses
    BrickPool pool_{0};
    std::vector<uint32_t> jobs_;
    BuildStats stats_;
    uint64_t revision_ = 0, parent_revision_ = 0;
};

}  // namespace kiln::field
