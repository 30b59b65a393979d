// SPDX-License-Identifier: MIT
// A field is made in tasks: cubes of 16 cells. Each asks the index for the edits that reach it, folds their list at the centres of its 64
// cubes of 4 cells, and for those that may hold a surface at their 64 cells (Barbier et al., "Lipschitz Pruning", 2025, branch in the
// same way); what is left of the list is a cell's code, which is evaluated at its texels to see whether the cell owns a brick.
// An update looks at the cells that the changed edits reach, and at nothing else: a small one takes those cells 64 at a time wherever
// they lie, a large one takes tasks. Results are merged in the order of tasks, so nothing depends on the number of workers.

#include "field/field.h"

#include "base/assert.h"
#include "base/parallel_for.h"
#include "base/profile.h"
#include "sdf/cull.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <string>
#include <utility>

namespace kiln::field {

using Code = std::vector<sdf::Instruction>;

namespace {

constexpr int kTaskCells = 16;
constexpr int kGroupCells = 4;
constexpr int kTaskPages = kTaskCells / kCellPage;
constexpr int64_t kMaxCells = 1ll << 28;
constexpr int64_t kMaxTexel = 1ll << 24;     // float holds every integer up to here
constexpr float kHalfDiagonal = 6.0621779f;  // of a cell, voxels: 3.5 * sqrt(3), rounded up
constexpr int64_t kFewCells = 4096;          // an update of fewer takes them as they come

std::atomic<uint64_t> revisions{0};

// Row i of a group of 64: x fastest.
ivec3 place_of(int i) { return {i & 3, i >> 2 & 3, i >> 4}; }

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
                 std::span<const RowChange> changes, MadeBricks* made)
        : old_(old), program_(std::move(program)), options_(options), out_(new Field), changes_(changes), made_(made) {}

    Result<std::shared_ptr<const Field>> run() {
        KILN_PROFILE(old_ != nullptr ? "field update" : "field build");
        if (auto ok = lay_grid(); !ok) return ok.error();
        far_ = (kBandVoxels + 0.01f) * options_.voxel_size;
        farthest_ = farthest();
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
            if (cells > kFewCells) {
                build_tasks(all);
            } else if (cells > 0) {
                results_.resize(dirty_.size());
                Worker worker = make_worker();
                for (size_t i = 0; i < dirty_.size(); ++i) few_cells(i, worker, results_[i]);
            }
        }
        if (auto ok = merge(); !ok) return ok.error();
        finish_jumps();
        out_->revision_ = ++revisions;
        out_->parent_revision_ = old_ != nullptr ? old_->revision_ : 0;
        return std::shared_ptr<const Field>(std::move(out_));
    }

private:
    // What a thread works with; its memory is kept from task to task.
    struct Worker {
        sdf::ListCuller culler;
        sdf::ListCuller::Fold groups, cells;
        BrickEvaluator evaluator;
        std::vector<uint32_t> rows;
        Code code;
        ivec3 cell[64];  // of `cells`' balls
    };

    Worker make_worker() const {
        return {sdf::ListCuller(*program_), {}, {}, BrickEvaluator(*program_, options_.voxel_size), {}, {}, {}};
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

    bool in_grid(ivec3 c) const {
        return c.x >= 0 && c.y >= 0 && c.z >= 0 && c.x < size_.x && c.y < size_.y && c.z < size_.z;
    }

    // The box of cells that an edit reaches, from the box of its influence.
    CellBox cells_of(const Box3& box) const {
        const double side = double(options_.voxel_size) * kBrickVoxels;
        const ivec3 first = first_cell();
        const auto low = [&](float a, int from, int size) {
            return int(std::clamp(std::floor(double(a) / side - 0.01) - from, 0.0, double(size)));
        };
        const auto high = [&](float a, int from, int size) {
            return int(std::clamp(std::floor(double(a) / side + 0.01) + 1 - from, 0.0, double(size)));
        };
        return {
            {low(box.min.x, first.x, size_.x), low(box.min.y, first.y, size_.y), low(box.min.z, first.z, size_.z)},
            {high(box.max.x, first.x, size_.x), high(box.max.y, first.y, size_.y), high(box.max.z, first.z, size_.z)}};
    }

    void find_dirty() {
        const auto add = [&](uint32_t row) {
            const sdf::EditSpan& span = program_->edits[row];
            if (span.count == 0) return;
            CellBox box{{0, 0, 0}, size_};
            if (!span.everywhere()) {
                const sdf::IndexedEdit edit = span.indexed(row);
                const float more = program_->index.blend_allowance(edit.influence(far_), far_, row);
                box = cells_of(edit.influence(far_ + more));
            }
            if (!box.empty()) dirty_.push_back(box);
        };
        for (const RowChange& change : changes_) {
            if (change.removed != kNoRow) {
                add(change.removed);
                removed_.push_back(change.removed);
            }
            if (change.inserted != kNoRow) {
                add(change.inserted);
                inserted_.push_back(change.inserted);
            }
        }
        occupancy_changes_.resize(dirty_.size(), CellBox{});
    }

    bool is_dirty(ivec3 c) const {
        return std::any_of(dirty_.begin(), dirty_.end(), [&](const CellBox& b) { return contains(b, c); });
    }
    static bool contains(const CellBox& b, ivec3 c) {
        return c.x >= b.min.x && c.y >= b.min.y && c.z >= b.min.z && c.x < b.max.x && c.y < b.max.y && c.z < b.max.z;
    }
    bool is_dirty(const CellBox& box) const {
        return std::any_of(dirty_.begin(), dirty_.end(), [&](const CellBox& b) {
            return box.min.x < b.max.x && box.min.y < b.max.y && box.min.z < b.max.z && b.min.x < box.max.x &&
                   b.min.y < box.max.y && b.min.z < box.max.z;
        });
    }

    // Rows that reach the box of cells, in order.
    void find_rows(const CellBox& box, std::vector<uint32_t>& rows) const {
        const float side = options_.voxel_size * kBrickVoxels;
        const ivec3 first = first_cell();
        const auto world = [&](int x, int y, int z) {
            return vec3{float(x + first.x) * side, float(y + first.y) * side, float(z + first.z) * side};
        };
        const Box3 metres = Box3{world(box.min.x, box.min.y, box.min.z), world(box.max.x, box.max.y, box.max.z)};
        const Box3 wide = metres.inflated(0.01f * options_.voxel_size);
        rows.clear();
        program_->index.find(wide, far_ + program_->index.blend_allowance(wide, far_), rows);
        std::sort(rows.begin(), rows.end(),
                  [&](uint32_t a, uint32_t b) { return program_->edits[a].order < program_->edits[b].order; });
    }

    // Ball i around the cube of `size` cells whose least corner is `cell`: every texel of it lies inside, whatever float made of positions.
    void place_ball(sdf::Balls& balls, int i, ivec3 cell, int size) const {
        const float h = options_.voxel_size;
        const ivec3 first = first_cell();
        const auto middle = [&](int c) { return (float(c) * 7.0f + 3.5f * float(size)) * h; };
        balls.x[i] = middle(cell.x + first.x);
        balls.y[i] = middle(cell.y + first.y);
        balls.z[i] = middle(cell.z + first.z);
    }

    // One radius for all: the grid's farthest corner decides what rounding may add.
    void size_balls(sdf::Balls& balls, int size) const {
        const float h = options_.voxel_size, rounding = 5e-7f * farthest_;
        balls.radius = kHalfDiagonal * float(size) * h + rounding;
        balls.half_side = 3.5f * float(size) * h + rounding;
        balls.far = far_;
    }

    float farthest() const {
        const GridParams& g = out_->grid_;
        const auto reach = [](int first, int size) { return std::max(std::abs(first), std::abs(first + size)); };
        const int cells = std::max({reach(g.cell_x, g.size_x), reach(g.cell_y, g.size_y), reach(g.cell_z, g.size_z)});
        return float(cells + kTaskCells) * kBrickVoxels * options_.voxel_size;
    }

    // No texel of a ball whose centre has this value is near enough to the surface for a brick.
    bool beyond(float value, const sdf::Balls& balls) const {
        const float v = std::fabs(value);
        return v > balls.radius + options_.own_voxels * options_.voxel_size + 4e-6f * (farthest_ + v);
    }

    void build_tasks(const CellBox& all) {
        std::vector<ivec3> tasks;
        const auto aligned = [](int a) { return a / kTaskCells * kTaskCells; };
        for (int z = aligned(all.min.z); z < all.max.z; z += kTaskCells) {
            for (int y = aligned(all.min.y); y < all.max.y; y += kTaskCells) {
                for (int x = aligned(all.min.x); x < all.max.x; x += kTaskCells) {
                    const ivec3 at{x, y, z};
                    if (old_ == nullptr || is_dirty(CellBox{at, at + ivec3{kTaskCells, kTaskCells, kTaskCells}}))
                        tasks.push_back(at);
                }
            }
        }
        tasks_ = std::move(tasks);
        results_.resize(tasks_.size());
        parallel_for(tasks_.size(), options_.workers, [&](int i) {
            Worker worker = make_worker();
            run_task(tasks_[size_t(i)], worker, results_[size_t(i)]);
        });
    }

    void run_task(ivec3 at, Worker& worker, TaskResult& result) {
        const CellBox box = grown({at, at + ivec3{kTaskCells, kTaskCells, kTaskCells}}, 0, size_);
        find_rows(box, worker.rows);
        if (worker.rows.empty() && old_ == nullptr) return;
        sdf::ListCuller::Fold& groups = worker.groups;
        groups.list = worker.culler.list_of(worker.rows);
        groups.balls.live = 0;
        for (int i = 0; i < 64; ++i) {
            const ivec3 p = place_of(i),
                        cell{at.x + p.x * kGroupCells, at.y + p.y * kGroupCells, at.z + p.z * kGroupCells};
            place_ball(groups.balls, i, cell, kGroupCells);
            const CellBox group = grown({cell, cell + ivec3{kGroupCells, kGroupCells, kGroupCells}}, 0, size_);
            if (!group.empty() && (old_ == nullptr || is_dirty(group))) groups.balls.live |= uint64_t(1) << i;
        }
        size_balls(groups.balls, kGroupCells);
        worker.culler.fold(groups);
        uint64_t open = 0;
        for (int i = 0; i < 64; ++i) {
            if ((groups.balls.live >> i & 1u) == 0) continue;
            ++result.cells_tested;
            if (!beyond(groups.value[i], groups.balls)) {
                open |= uint64_t(1) << i;
                continue;
            }
            const bool inside = groups.value[i] < 0;
            if (!inside && old_ == nullptr) continue;  // as unwritten cells read
            for (int c = 0; c < 64; ++c) {
                const ivec3 cell = cell_in(at, i, c);
                if (in_grid(cell) && (old_ == nullptr || is_dirty(cell))) set_empty(cell, inside, at, result);
            }
        }
        worker.culler.keep(groups, open);
        for (int i = 0; i < 64; ++i) {
            if ((open >> i & 1u) == 0) continue;
            sdf::ListCuller::Fold& cells = worker.cells;
            cells.list = worker.culler.child(groups, i);
            cells.balls.live = 0;
            for (int c = 0; c < 64; ++c) {
                worker.cell[c] = cell_in(at, i, c);
                place_ball(cells.balls, c, worker.cell[c], 1);
                if (in_grid(worker.cell[c]) && (old_ == nullptr || is_dirty(worker.cell[c])))
                    cells.balls.live |= uint64_t(1) << c;
            }
            run_cells(worker, at, result);
            worker.culler.drop(cells.list);
        }
        worker.culler.drop(groups.list);
    }

    static ivec3 cell_in(ivec3 task, int group, int c) {
        const ivec3 g = place_of(group), p = place_of(c);
        return {task.x + g.x * kGroupCells + p.x, task.y + g.y * kGroupCells + p.y, task.z + g.z * kGroupCells + p.z};
    }

    // The cells of one dirty box that no earlier one has.
    void few_cells(size_t which, Worker& worker, TaskResult& result) {
        const CellBox& box = dirty_[which];
        const std::span<const CellBox> earlier = std::span(dirty_).first(which);
        find_rows(box, worker.rows);
        sdf::ListCuller::Fold& cells = worker.cells;
        cells.list = worker.culler.list_of(worker.rows);
        int n = 0;
        const auto run = [&] {
            if (n == 0) return;
            cells.balls.live = n == 64 ? ~uint64_t(0) : (uint64_t(1) << n) - 1;
            for (int i = n; i < 64; ++i) place_ball(cells.balls, i, worker.cell[n - 1], 1);
            run_cells(worker, {}, result);
            n = 0;
        };
        for (int z = box.min.z; z < box.max.z; ++z) {
            for (int y = box.min.y; y < box.max.y; ++y) {
                for (int x = box.min.x; x < box.max.x; ++x) {
                    const ivec3 cell{x, y, z};
                    if (std::any_of(earlier.begin(), earlier.end(),
                                    [&](const CellBox& b) { return contains(b, cell); }))
                        continue;
                    worker.cell[n] = cell;
                    place_ball(cells.balls, n, cell, 1);
                    if (++n == 64) run();
                }
            }
        }
        run();
        worker.culler.drop(cells.list);
    }

    // worker.cells has its list, its balls' places and which of them to look at.
    void run_cells(Worker& worker, ivec3 task, TaskResult& result) {
        sdf::ListCuller::Fold& cells = worker.cells;
        size_balls(cells.balls, 1);
        worker.culler.fold(cells);
        uint64_t open = 0;
        for (int i = 0; i < 64; ++i) {
            if ((cells.balls.live >> i & 1u) == 0) continue;
            ++result.cells_tested;
            if (beyond(cells.value[i], cells.balls)) {
                set_empty(worker.cell[i], cells.value[i] < 0, task, result);
            } else {
                open |= uint64_t(1) << i;
            }
        }
        if (open == 0) return;
        worker.culler.keep(cells, open);
        const uint64_t came = inserted_.empty() ? 0 : worker.culler.balls_with(cells, inserted_);
        for (int i = 0; i < 64; ++i) {
            if ((open >> i & 1u) != 0) finish_cell(worker, i, (came >> i & 1u) != 0, task, result);
        }
    }

    void finish_cell(Worker& worker, int i, bool came, ivec3 task, TaskResult& result) {
        const ivec3 cell = worker.cell[i];
        const uint32_t old_word = old_ != nullptr ? old_->cells_.at(cell.x, cell.y, cell.z) : 0u;
        const bool was = (old_word & kCellOccupied) != 0;
        if (was && !came && !uses_removed(old_word & kCellSlotMask)) return;
        worker.culler.emit(worker.cells, i, worker.code);
        const ivec3 first = first_cell();
        const ivec3 texel{(first.x + cell.x) * kBrickVoxels, (first.y + cell.y) * kBrickVoxels,
                          (first.z + cell.z) * kBrickVoxels};
        ++result.cells_evaluated;
        const float least = worker.evaluator.evaluate(worker.code, texel);
        if (!(least < options_.own_voxels * options_.voxel_size)) {
            set_empty(cell, worker.evaluator.distances()[0] < 0, task, result);
            return;
        }
        Leaf leaf{cell, uint32_t(result.code.size()), uint32_t(worker.code.size()), true, {}};
        if (made_ != nullptr) {
            leaf.content = worker.evaluator.content(options_.format, worker.culler.only_material(worker.cells, i));
        }
        result.code.insert(result.code.end(), worker.code.begin(), worker.code.end());
        result.leaves.push_back(std::move(leaf));
    }

    bool uses_removed(uint32_t slot) const {
        if (removed_.empty()) return false;
        for (const sdf::Instruction in : old_->code_of(slot)) {
            if (!in.has_material()) continue;
            const uint32_t row = uint32_t(program_->params[in.param + 2]);
            if (std::find(removed_.begin(), removed_.end(), row) != removed_.end()) return true;
        }
        return false;
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

    void occupancy_changed(ivec3 cell) {
        for (size_t i = 0; i < dirty_.size(); ++i) {
            if (!contains(dirty_[i], cell)) continue;
            occupancy_changes_[i] = joined(occupancy_changes_[i], {cell, cell + ivec3{1, 1, 1}});
            return;
        }
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
        for (const TaskResult& result : results_) {
            for (const Leaf& leaf : result.leaves) {
                if (leaf.code_count != 0) continue;
                const uint32_t slot = out_->cells_.at(leaf.cell.x, leaf.cell.y, leaf.cell.z) & kCellSlotMask;
                out_->live_code_ -= out_->records_[slot].code_count;
                pool.release(slot);
                out_->records_.write(slot) = {};
                ++out_->stats_.bricks_freed;
                occupancy_changed(leaf.cell);
            }
            for (const Emptied& empty : result.empties) {
                const uint32_t word = out_->cells_.at(empty.cell.x, empty.cell.y, empty.cell.z);
                // The old jump may stay: update_jumps() rewrites every one that could differ.
                out_->cells_.set(
                    empty.cell.x, empty.cell.y, empty.cell.z,
                    (empty.inside ? kCellInside : 0u) | ((word & kCellOccupied) != 0 ? uint32_t(kMaxJump) : word & 7u));
            }
        }
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
                    occupancy_changed(leaf.cell);
                }
                out_->jobs_.push_back(slot);
                if (made_ != nullptr) made_->emplace_back(slot, std::move(leaf.content));
            }
        }
        if (pool.refused() != 0) {
            return Error{"field: " + std::to_string(uint64_t(pool.in_use()) + pool.refused()) +
                             " bricks needed, the pool holds " + std::to_string(options_.max_bricks),
                         ErrorKind::OutOfMemory};
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

    void finish_jumps() {
        if (old_ == nullptr) {
            update_jumps(out_->cells_, {{0, 0, 0}, size_});
            return;
        }
        for (const CellBox& box : occupancy_changes_) {
            if (!box.empty()) update_jumps(out_->cells_, grown(box, kMaxJump, size_));
        }
    }

    const Field* old_;
    std::shared_ptr<const sdf::Program> program_;
    FieldOptions options_;
    std::shared_ptr<Field> out_;
    std::span<const RowChange> changes_;
    MadeBricks* made_;
    ivec3 size_;
    float far_ = 0;       // how near an edit must come to change what is stored, metres
    float farthest_ = 0;  // largest coordinate in the grid, metres
    std::vector<CellBox> dirty_, occupancy_changes_;
    std::vector<uint32_t> removed_, inserted_;
    std::vector<ivec3> tasks_;
    std::vector<TaskResult> results_;
};

Result<std::shared_ptr<const Field>> Field::build(std::shared_ptr<const sdf::Program> program,
                                                  const FieldOptions& options, MadeBricks* made) {
    return FieldBuilder(nullptr, std::move(program), options, {}, made).run();
}

Result<std::shared_ptr<const Field>> Field::update(const Field& old, std::shared_ptr<const sdf::Program> program,
                                                   std::span<const RowChange> changes, MadeBricks* made) {
    return FieldBuilder(&old, std::move(program), old.options_, changes, made).run();
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
