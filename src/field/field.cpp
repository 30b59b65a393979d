// SPDX-License-Identifier: MIT
// A field is made in tasks: blocks of 16 cells, see cell_maker.h.
// An update looks at the cells that the changed edits reach, and at nothing else: a small one takes those cells 64 at a time wherever
// they lie, a large one takes tasks. Results are merged in the order of tasks, so nothing depends on the number of workers.

#include "field/field.h"

#include "base/assert.h"
#include "base/parallel_for.h"
#include "base/profile.h"
#include "field/cell_maker.h"
#include "field/still_texels.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cmath>
#include <iterator>
#include <string>
#include <utility>

namespace kiln::field {

using Code = std::vector<sdf::Instruction>;

namespace {

constexpr int kTaskPages = kBlockCells / kCellPage;
constexpr int64_t kMaxCells = 1ll << 28;
constexpr int64_t kMaxTexel = 1ll << 24;  // float holds every integer up to here
constexpr int64_t kUnsortedCells = 4096;  // an update of fewer takes them as they come
constexpr size_t kFewLeaves = 64;         // and asks for room for so many bricks at first

std::atomic<uint64_t> revisions{0};

struct Leaf {
    ivec3 cell;                               // counted from the grid's first
    uint32_t code_first = 0, code_count = 0;  // in the task's code; count 0: the brick goes
    bool bake = false;
    BrickContent content;
};

struct Emptied {
    ivec3 cell;
    bool inside;
};

struct TaskResult {
    std::vector<Leaf> leaves;
    std::vector<Emptied> empties;  // of an update: cells whose word is another
    std::array<Shared<CellMap::Words::Page>, size_t(kTaskPages* kTaskPages* kTaskPages)> pages;  // of a build
    Code code;
    uint64_t cells_tested = 0, cells_evaluated = 0;
};

}  // namespace

class FieldBuilder {
public:
    FieldBuilder(const Field* old, std::shared_ptr<const sdf::Program> program, const FieldOptions& options,
                 std::span<const RowChange> changes, MadeBricks* made, const BrickContents* stored = nullptr)
        : old_(old),
          program_(std::move(program)),
          options_(options),
          out_(new Field),
          changes_(changes),
          made_(made),
          stored_(stored) {}

    Result<std::shared_ptr<const Field>> run() {
        KILN_PROFILE(old_ != nullptr ? "field update" : "field build");
        if (auto ok = lay_grid(); !ok) return ok.error();
        if (old_ == nullptr) {
            build_tasks({{0, 0, 0}, size_});
        } else {
            find_dirty();
            int64_t cells = 0;
            CellBox all{};
            for (const CellBox& box : dirty_) {
                const ivec3 s = box.max - box.min;
                cells += int64_t(s.x) * s.y * s.z;
                all = joined(all, box);
            }
            if (cells > kUnsortedCells) {
                build_tasks(all);
            } else if (cells > 0) {
                const std::vector<CellBox> boxes = few_boxes();
                results_.resize(boxes.size());
                CellMaker maker = this->maker();
                StillTexels still(*program_, lattice(), reached_);
                for (size_t i = 0; i < boxes.size(); ++i) {
                    TaskSink sink{*this,  {},           results_[i], std::span(boxes).first(i),
                                  dirty_, was_reached_, &still,      false};
                    results_[i].leaves.reserve(kFewLeaves);
                    results_[i].code.reserve(kFewLeaves * 16);
                    maker.run_box(boxes[i], sink);
                }
                count(maker, results_[0]);
            }
        }
        if (auto ok = merge(); !ok) return ok.error();
        out_->revision_ = ++revisions;
        out_->parent_revision_ = old_ != nullptr ? old_->revision_ : 0;
        return std::shared_ptr<const Field>(std::move(out_));
    }

private:
    // What a task's cells become; see CellMaker.
    struct TaskSink {
        FieldBuilder& builder;
        ivec3 task;
        TaskResult& result;
        std::span<const CellBox> earlier = {};  // an update of few cells: boxes that have had their cells
        std::span<const CellBox> dirty = {};    // where edits changed; in a task, those that meet it
        std::span<const CellBox> gone = {};     // where edits were that are gone, of those that may meet the task
        StillTexels* still = nullptr;           // of an update of few cells
        bool saw_rows = false;                  // still has those of the box at hand

        bool whole() const { return builder.old_ == nullptr; }
        bool wants(const CellBox& box) const {
            return whole() || std::any_of(dirty.begin(), dirty.end(), [&](const CellBox& b) { return meet(box, b); });
        }
        bool wants(ivec3 cell) const { return whole() || wanted(cell, 1) != 0; }
        uint32_t wanted(ivec3 first, int count) const {
            const auto within = [&](std::span<const CellBox> boxes) {
                uint32_t out = 0;
                for (const CellBox& b : boxes) {
                    if (first.y < b.min.y || first.y >= b.max.y || first.z < b.min.z || first.z >= b.max.z) continue;
                    const int from = std::max(b.min.x - first.x, 0), to = std::min(b.max.x - first.x, count);
                    if (from < to) out |= ((1u << (to - from)) - 1) << from;
                }
                return out;
            };
            const uint32_t changed = within(dirty) & ~within(earlier);
            if (changed == 0) return 0;
            const CellMap& cells = builder.old_->cells_;
            const CellMap::Words::Page* const page =
                cells.words().find(cells.page_index(first.x / kCellPage, first.y / kCellPage, first.z / kCellPage));
            uint32_t bricks = 0;
            if (page != nullptr) {
                const uint32_t* const words = page->data() + row_of(first.y, first.z);
                const int at = first.x - first_of_row(first.x);
                bricks = bits_of(words, 31) >> at & changed;
                for (uint32_t left = bricks; left != 0; left &= left - 1)
                    builder.ask_for(words[at + std::countr_zero(left)] & kCellSlotMask);
            }
            return bricks | (changed & within(builder.owned_));
        }
        static bool stop() { return false; }
        void air(const CellBox& box) {
            if (whole()) return;  // as unwritten cells read
            for (int z = box.min.z; z < box.max.z; ++z) {
                for (int y = box.min.y; y < box.max.y; ++y) {
                    for (int x = box.min.x; x < box.max.x; ++x) {
                        if (wants(ivec3{x, y, z})) empty({x, y, z}, false);
                    }
                }
            }
        }
        void empty(ivec3 cell, bool inside) { builder.set_empty(cell, inside, task, result); }
        bool keeps(ivec3 cell, Inserted inserted, sdf::ListCuller::Start start) const {
            if (whole()) return false;
            if (inserted == Inserted::NoEffect &&
                std::none_of(gone.begin(), gone.end(), [&](const CellBox& b) { return contains(b, cell); }))
                return true;
            const uint32_t word = builder.old_->cells_.at(cell.x, cell.y, cell.z);
            return (word & kCellOccupied) != 0 && inserted != Inserted::Shows &&
                   stays(builder.old_->code_of(word & kCellSlotMask), *builder.program_, builder.removed_, start);
        }
        const BrickContent* stored(ivec3 cell) const {
            const uint32_t word = builder.old_->cells_.at(cell.x, cell.y, cell.z);
            return (word & kCellOccupied) != 0 ? &(*builder.stored_)[word & kCellSlotMask] : nullptr;
        }
        bool is_empty(ivec3 cell) const {
            return (builder.old_->cells_.at(cell.x, cell.y, cell.z) & kCellOccupied) == 0;
        }
        StillCells look(const CellMaker& maker, uint64_t changing) {
            if (!saw_rows) still->see(maker.rows());
            saw_rows = true;
            StillCells out = still->look(maker.centres(), maker.values());
            if (builder.stored_ == nullptr) return {out.empty, 0};
            const uint64_t ask = out.ask & maker.centres().live;
            out.ask = 0;
            for (uint64_t left = ask | (still->joins() ? changing : 0); left != 0; left &= left - 1) {
                const int ball = std::countr_zero(left);
                const BrickContent* const brick = stored(maker.cell(ball));
                if (brick == nullptr || !brick->half) continue;
                out.ask |= ask & left & -left;
                // Codes come from far away: all are asked for before the first is looked at.
                const auto* const codes = reinterpret_cast<const std::byte*>(brick->half->codes.data());
                for (size_t at = 0; at < sizeof brick->half->codes; at += 64) __builtin_prefetch(codes + at);
            }
            return out;
        }
        ivec3 first_texel(ivec3 cell) const {
            const ivec3 world = cell + builder.first_cell();
            return {world.x * kBrickVoxels, world.y * kBrickVoxels, world.z * kBrickVoxels};
        }
        void keep(ivec3 cell, const CellMaker& maker, bool bake, BrickContent content) {
            Leaf leaf{cell, uint32_t(result.code.size()), maker.code_count(), bake, std::move(content)};
            maker.append_code(result.code);
            result.leaves.push_back(std::move(leaf));
        }
        bool texels_stay(ivec3 cell, CellMaker& maker) {
            if (!still->hold(cell, first_texel(cell), *stored(cell), maker.only_material(), maker.evaluator()))
                return false;
            maker.emit_code();
            keep(cell, maker, false, {});
            return true;
        }
        bool texels_join(ivec3 cell, CellMaker& maker) {
            if (!still->joins() || builder.stored_ == nullptr || builder.made_ == nullptr) return false;
            const BrickContent* const brick = stored(cell);
            if (brick == nullptr) return false;
            BrickContent content = still->joined(first_texel(cell), *brick, maker.only_material(), maker.evaluator());
            if (!content) return false;
            maker.emit_code();
            keep(cell, maker, true, std::move(content));
            return true;
        }
        void brick(ivec3 cell, CellMaker& maker) {
            BrickContent content;
            if (builder.made_ != nullptr)
                content = maker.evaluator().content(builder.options_.format, maker.only_material());
            keep(cell, maker, true, std::move(content));
        }
    };

    // What will be read of a brick, once its cell has been folded.
    void ask_for(uint32_t slot) const {
        __builtin_prefetch(&old_->records_[slot]);
        if (stored_ != nullptr) __builtin_prefetch(&(*stored_)[slot]);
    }

    CellLattice lattice() const { return {first_cell(), options_.voxel_size, options_.own_voxels, farthest(), {}}; }
    CellMaker maker() const { return {*program_, lattice(), inserted_}; }
    static void count(const CellMaker& maker, TaskResult& result) {
        result.cells_tested += maker.cells_tested();
        result.cells_evaluated += maker.cells_evaluated();
    }

    Result<void> lay_grid() {
        out_->program_ = program_;
        out_->options_ = options_;
        const float h = options_.voxel_size;
        if (!(h > 0) || !std::isfinite(h))
            return Error{"field: voxel size " + std::to_string(h) + "; must be above 0", ErrorKind::Usage};
        if (!(options_.own_voxels >= 1 && options_.own_voxels <= kBandVoxels))
            return Error{"field: own_voxels must be between 1 and the band's 4 voxels", ErrorKind::Usage};
        if (old_ != nullptr) {
            out_->grid_ = old_->grid_;
            out_->cells_ = old_->cells_;
            out_->records_ = old_->records_;
            out_->code_ = old_->code_;
            out_->live_code_ = old_->live_code_;
            out_->pool_ = old_->pool_;
            size_ = {out_->grid_.size_x, out_->grid_.size_y, out_->grid_.size_z};
            return {};
        }
        const Box3& box = options_.bounds;
        if (box.empty() || !box.finite()) return Error{"field: bounds must be finite and not empty", ErrorKind::Usage};
        const float low[3] = {box.min.x, box.min.y, box.min.z}, high[3] = {box.max.x, box.max.y, box.max.z};
        int first[3], size[3];
        for (size_t axis = 0; axis < 3; ++axis) {
            const double side = double(h) * kBrickVoxels;
            const double a = std::floor(double(low[axis]) / side),
                         b = std::max(std::ceil(double(high[axis]) / side), a + 1);
            if (std::max(std::fabs(a), std::fabs(b)) * kBrickVoxels + 64 > double(kMaxTexel)) {
                return Error{"field: bounds reach " + std::to_string(std::max(std::fabs(a), std::fabs(b)) * side) +
                                 " m, more than 2^24 voxels from the origin; use larger voxels",
                             ErrorKind::Usage};
            }
            first[axis] = int(a);
            size[axis] = int(b - a);
        }
        const double cells = double(size[0]) * size[1] * size[2];
        if (cells > double(kMaxCells)) {
            return Error{"field: " + std::to_string(uint64_t(cells)) + " cells needed, at most " +
                             std::to_string(kMaxCells) + " are possible",
                         ErrorKind::OutOfMemory};
        }
        size_ = {size[0], size[1], size[2]};
        out_->grid_ = {first[0], first[1], first[2], h, size[0], size[1], size[2], 0};
        out_->cells_ = CellMap(size_);
        out_->pool_ = BrickPool(std::min(options_.max_bricks, kCellSlotMask + 1));
        return {};
    }

    ivec3 first_cell() const { return {out_->grid_.cell_x, out_->grid_.cell_y, out_->grid_.cell_z}; }

    void find_dirty() {
        const auto on_grid = [&](const CellBox& world) {
            return grown({world.min - first_cell(), world.max - first_cell()}, 0, size_);
        };
        const bool renumbered = old_->program().numbering != program_->numbering;
        const auto add = [&](uint32_t row, bool gone) {
            const CellsReached world = cells_reached(*program_, row, lattice(), gone && renumbered);
            const CellBox box = on_grid(world.stored), owned = on_grid(world.owned);
            if (!box.empty()) {
                dirty_.push_back(box);
                reached_.push_back({row, gone, gone && renumbered, box});
            }
            if (!owned.empty()) owned_.push_back(owned);
            return box;
        };
        for (const RowChange& change : changes_) {
            if (change.removed != kNoRow) {
                was_reached_.push_back(add(change.removed, true));
                removed_.push_back(change.removed);
            }
            if (change.inserted != kNoRow) {
                (void)add(change.inserted, false);
                inserted_.push_back(change.inserted);
            }
        }
        std::sort(removed_.begin(), removed_.end());
        std::sort(inserted_.begin(), inserted_.end());
    }

    // The dirty boxes, those joined that hold fewer cells together than each by itself: where an edit was and where it has gone to mostly overlap.
    std::vector<CellBox> few_boxes() const {
        const auto cells = [](const CellBox& box) {
            const ivec3 s = box.max - box.min;
            return int64_t(s.x) * s.y * s.z;
        };
        std::vector<CellBox> out;
        for (const CellBox& box : dirty_) {
            const auto near = std::find_if(out.begin(), out.end(), [&](const CellBox& other) {
                return cells(joined(other, box)) <= cells(other) + cells(box);
            });
            if (near != out.end()) {
                *near = joined(*near, box);
            } else {
                out.push_back(box);
            }
        }
        return out;
    }

    bool is_dirty(const CellBox& box) const {
        return std::any_of(dirty_.begin(), dirty_.end(), [&](const CellBox& b) { return meet(box, b); });
    }

    float farthest() const {
        const GridParams& g = out_->grid_;
        const auto reach = [](int first, int size) { return std::max(std::abs(first), std::abs(first + size)); };
        const int cells = std::max({reach(g.cell_x, g.size_x), reach(g.cell_y, g.size_y), reach(g.cell_z, g.size_z)});
        return float(cells + kBlockCells) * kBrickVoxels * options_.voxel_size;
    }

    void build_tasks(const CellBox& all) {
        std::vector<ivec3> tasks;
        const auto aligned = [](int a) { return a / kBlockCells * kBlockCells; };
        for (int z = aligned(all.min.z); z < all.max.z; z += kBlockCells) {
            for (int y = aligned(all.min.y); y < all.max.y; y += kBlockCells) {
                for (int x = aligned(all.min.x); x < all.max.x; x += kBlockCells) {
                    const ivec3 at{x, y, z};
                    if (old_ == nullptr || is_dirty(CellBox{at, at + ivec3{kBlockCells, kBlockCells, kBlockCells}}))
                        tasks.push_back(at);
                }
            }
        }
        tasks_ = std::move(tasks);
        results_.resize(tasks_.size());
        parallel_for(tasks_.size(), options_.workers, [&](int i) {
            CellMaker maker = this->maker();
            const CellBox task{tasks_[size_t(i)], tasks_[size_t(i)] + all_of(kBlockCells)};
            const auto meeting = [&](const std::vector<CellBox>& boxes) {
                std::vector<CellBox> out;
                std::copy_if(boxes.begin(), boxes.end(), std::back_inserter(out),
                             [&](const CellBox& box) { return meet(box, task); });
                return out;
            };
            const std::vector<CellBox> dirty = meeting(dirty_), gone = meeting(was_reached_);
            TaskSink sink{*this, tasks_[size_t(i)], results_[size_t(i)], {}, dirty, gone};
            maker.run_block(tasks_[size_t(i)], {{0, 0, 0}, size_}, sink);
            count(maker, results_[size_t(i)]);
        });
    }

    void set_empty(ivec3 cell, bool inside, ivec3 task, TaskResult& result) {
        if (old_ == nullptr) {
            if (!inside) return;
            const ivec3 in = cell - task;
            const ivec3 p{in.x / kCellPage, in.y / kCellPage, in.z / kCellPage};
            Shared<CellMap::Words::Page>& page = result.pages[size_t((p.z * kTaskPages + p.y) * kTaskPages + p.x)];
            if (!page) page.write().fill(uint32_t(kMaxJump));
            page.write()[out_->cells_.index(cell.x, cell.y, cell.z) % CellMap::Words::kPageSize] =
                kCellInside | uint32_t(kMaxJump);
            return;
        }
        const uint32_t word = old_->cells_.at(cell.x, cell.y, cell.z);
        if ((word & kCellOccupied) != 0) result.leaves.push_back({cell, 0, 0, false, {}});
        if ((word & kCellOccupied) != 0 || ((word & kCellInside) != 0) != inside)
            result.empties.push_back({cell, inside});
    }

    // Takes and gives slots in the order of tasks and cells, writes words, records and code.
    Result<void> merge() {
        BrickPool& pool = out_->pool_;
        size_t leaves = 0, code = 0;
        for (const TaskResult& result : results_) {
            leaves += result.leaves.size();
            code += result.code.size();
            out_->stats_.cells_tested += result.cells_tested;
            out_->stats_.cells_evaluated += result.cells_evaluated;
        }
        if (old_ == nullptr) {
            out_->code_.reserve(2 * code);
            set_pages();
        }
        out_->jobs_.reserve(leaves);
        if (made_ != nullptr) made_->reserve(leaves);
        std::vector<ivec3> went, came;  // of an update: cells that own no brick any more, and that now do
        for (const TaskResult& result : results_) {
            for (const Leaf& leaf : result.leaves) {
                if (leaf.code_count != 0) continue;
                const uint32_t slot = out_->cells_.at(leaf.cell.x, leaf.cell.y, leaf.cell.z) & kCellSlotMask;
                out_->live_code_ -= out_->records_[slot].code_count;
                pool.release(slot);
                out_->records_.write(slot) = {};
                ++out_->stats_.bricks_freed;
                went.push_back(leaf.cell);
            }
            for (const Emptied& empty : result.empties) {
                const uint32_t word = out_->cells_.at(empty.cell.x, empty.cell.y, empty.cell.z);
                // The old jump may stay: what could differ is rewritten.
                out_->cells_.set(
                    empty.cell.x, empty.cell.y, empty.cell.z,
                    (empty.inside ? kCellInside : 0u) | ((word & kCellOccupied) != 0 ? uint32_t(kMaxJump) : word & 7u));
            }
        }
        raise_jumps(out_->cells_, went);
        const GridParams& g = out_->grid_;
        for (TaskResult& result : results_) {
            const uint32_t base = uint32_t(out_->code_.append(result.code));
            for (Leaf& leaf : result.leaves) {
                if (leaf.code_count == 0) continue;
                const uint32_t word = out_->cells_.at(leaf.cell.x, leaf.cell.y, leaf.cell.z);
                const bool had = (word & kCellOccupied) != 0;
                const uint32_t slot = had ? word & kCellSlotMask : pool.allocate();
                if (slot == kNoSlot) continue;  // counted by the pool
                out_->records_.resize_pages(slot / Field::Records::kPageSize + 1);
                BrickRecord& record = out_->records_.write(slot);
                out_->live_code_ += uint64_t(leaf.code_count) - record.code_count;
                record.texel_x = (g.cell_x + leaf.cell.x) * kBrickVoxels;
                record.texel_y = (g.cell_y + leaf.cell.y) * kBrickVoxels;
                record.texel_z = (g.cell_z + leaf.cell.z) * kBrickVoxels;
                record.code_first = base + leaf.code_first;
                record.code_count = leaf.code_count;
                if (!had) {
                    out_->cells_.set(leaf.cell.x, leaf.cell.y, leaf.cell.z, kCellOccupied | slot);
                    if (old_ != nullptr) came.push_back(leaf.cell);
                }
                if (!leaf.bake) continue;
                out_->jobs_.push_back(slot);
                if (made_ != nullptr) made_->emplace_back(slot, std::move(leaf.content));
            }
        }
        if (pool.refused() != 0) {
            return Error{"field: " + std::to_string(uint64_t(pool.in_use()) + pool.refused()) +
                             " bricks needed, the pool holds " + std::to_string(options_.max_bricks),
                         ErrorKind::OutOfMemory};
        }
        if (old_ == nullptr) {
            update_jumps(out_->cells_, {{0, 0, 0}, size_});
        } else {
            lower_jumps(out_->cells_, came);
        }
        out_->stats_.bricks = pool.in_use();
        out_->stats_.bricks_baked = uint32_t(out_->jobs_.size());
        compact_code();
        return {};
    }

    void set_pages() {
        CellMap& cells = out_->cells_;
        for (size_t t = 0; t < tasks_.size(); ++t) {
            for (size_t i = 0; i < results_[t].pages.size(); ++i) {
                Shared<CellMap::Words::Page>& page = results_[t].pages[i];
                if (!page) continue;
                const int p = int(i);
                cells.words().set_page(cells.page_index(tasks_[t].x / kCellPage + p % kTaskPages,
                                                        tasks_[t].y / kCellPage + p / kTaskPages % kTaskPages,
                                                        tasks_[t].z / kCellPage + p / (kTaskPages * kTaskPages)),
                                       std::move(page));
            }
        }
    }

    // Code that no brick uses any more is dropped once it is the larger part.
    void compact_code() {
        if (out_->code_.size() <= 2 * out_->live_code_ + 1024) return;
        AppendArray<sdf::Instruction> packed;
        packed.reserve(size_t(3 * out_->live_code_));
        for (const uint32_t slot : out_->slots()) {
            BrickRecord& record = out_->records_.write(slot);
            record.code_first = uint32_t(packed.append(out_->code_.subspan(record.code_first, record.code_count)));
        }
        out_->code_ = std::move(packed);
    }

    const Field* old_;
    std::shared_ptr<const sdf::Program> program_;
    FieldOptions options_;
    std::shared_ptr<Field> out_;
    std::span<const RowChange> changes_;
    MadeBricks* made_;
    const BrickContents* stored_;  // of old_, or null
    ivec3 size_;
    std::vector<CellBox> dirty_, was_reached_;
    std::vector<StillTexels::Change> reached_;
    std::vector<CellBox> owned_;  // where cells may come to own a brick
    std::vector<uint32_t> removed_, inserted_;
    std::vector<ivec3> tasks_;
    std::vector<TaskResult> results_;
};

Result<std::shared_ptr<const Field>> Field::build(std::shared_ptr<const sdf::Program> program,
                                                  const FieldOptions& options, MadeBricks* made) {
    return FieldBuilder(nullptr, std::move(program), options, {}, made).run();
}

Result<std::shared_ptr<const Field>> Field::update(const Field& old, std::shared_ptr<const sdf::Program> program,
                                                   std::span<const RowChange> changes, MadeBricks* made,
                                                   const BrickContents* stored) {
    return FieldBuilder(&old, std::move(program), old.options_, changes, made, stored).run();
}

std::vector<uint32_t> Field::slots() const {
    std::vector<uint32_t> out;
    out.reserve(pool_.in_use());
    for (uint32_t slot = 0; slot < slot_count(); ++slot) {
        if (pool_.used(slot)) out.push_back(slot);
    }
    return out;
}

uint32_t Field::cell_word(int x, int y, int z) const {
    x -= grid_.cell_x;
    y -= grid_.cell_y;
    z -= grid_.cell_z;
    if (x < 0 || y < 0 || z < 0 || x >= grid_.size_x || y >= grid_.size_y || z >= grid_.size_z) return 0;
    return cells_.at(x, y, z);
}

}  // namespace kiln::field
