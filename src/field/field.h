// SPDX-License-Identifier: MIT
// Field: an immutable snapshot of where the surface is: which cells own bricks, and the pruned code of each brick.
// Made on the CPU, deterministic for any number of workers. Bakers turn its brick jobs into texels: host_bricks.h on the CPU,
// render/passes/bake on the GPU; both eat the same jobs. Any thread may read a Field.
#pragma once

#include "field/brick.gpu.h"
#include "sdf/program.h"

#include <kiln/math.h>
#include <kiln/result.h>

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace kiln::field {

/// How texels store distance. Half: 16-bit float of voxels; Snorm8: 8-bit, band / 127 a step.
enum class DistanceFormat : uint8_t { Half, Snorm8 };

struct FieldOptions {
    float voxel_size = 0.02f;  ///< metres, > 0
    Box3 bounds;               ///< world metres the grid must cover; finite
    DistanceFormat format = DistanceFormat::Half;
    uint32_t max_bricks =
        1u << 19;     ///< pool capacity; a field that needs more is refused as OutOfMemory with the number needed
    int workers = 0;  ///< 0: all cores
};

/// Counters of the last build or update.
struct BuildStats {
    uint64_t cells_tested = 0;     ///< cull tests at any level of the hierarchy
    uint64_t cells_evaluated = 0;  ///< leaf cells whose texels were looked at
    uint32_t bricks = 0;           ///< resident
    uint32_t bricks_baked = 0;     ///< jobs of this build: new or changed
    uint32_t bricks_freed = 0;
};

/// One brick to bake.
struct BrickJob {
    uint32_t slot;
    int32_t texel[3];                 ///< global texel index of its first texel
    uint32_t code_first, code_count;  ///< in Field::code()
};

class Field {
public:
    /// Builds from nothing. `program` is kept alive by the field.
    static Result<std::shared_ptr<const Field>> build(std::shared_ptr<const sdf::Program> program,
                                                      const FieldOptions& options);
    /// The field of a changed program. Equal, brick for brick and bit for bit, to build(program), except for slot numbers and for where
    /// code lies. What changed is found by comparing pruned code from the whole grid downwards, so `dirty` is only a hint: boxes (world
    /// metres: solids of changed edits before and after, inflated by EditSpan::reach) within whose band bricks are baked without asking
    /// whether their texels differ. Elsewhere a brick is a job only if its stored bits change.
    static Result<std::shared_ptr<const Field>> update(const Field& old, std::shared_ptr<const sdf::Program> program,
                                                       std::span<const Box3> dirty);

    const sdf::Program& program() const { return *program_; }
    const FieldOptions& options() const { return options_; }
    GridParams grid() const { return grid_; }                          ///< atlas layout left 0; the renderer fills it
    std::span<const uint32_t> cells() const { return cells_; }         ///< cell words, see brick.gpu.h
    std::span<const BrickRecord> records() const { return records_; }  ///< by slot; code_count 0 where free
    std::span<const sdf::Instruction> code() const { return code_; }   ///< pruned code of all bricks, one after another
    std::span<const BrickJob> jobs() const { return jobs_; }  ///< what changed since `old`: all bricks after build()
    const BuildStats& stats() const { return stats_; }
    uint32_t slot_count() const { return uint32_t(records_.size()); }  ///< slots in use are below this
    uint64_t revision() const { return revision_; }                    ///< unique per snapshot
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
    std::vector<uint32_t> cells_;
    std::vector<BrickRecord> records_;
    std::vector<sdf::Instruction> code_;
    std::vector<BrickJob> jobs_;
    BuildStats stats_;
    uint64_t revision_ = 0, parent_revision_ = 0;
};

}  // namespace kiln::field
