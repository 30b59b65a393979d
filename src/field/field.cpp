// SPDX-License-Identifier: MIT
// Culling runs from the whole grid downwards: a node is a cube of 2^k cells, aligned in world cells; its code is its parent's,
// pruned for the ball around its texels. Nodes above 8 cells are split level by level, those of 8 cells are independent tasks, each
// depth first; their results are merged in the order of cells, so nothing depends on the number of workers.
// build() is update() from a field without bricks.

#include "field/field.h"

#include "base/assert.h"
#include "base/parallel_for.h"
#include "base/profile.h"
#include "field/brick_pool.h"
#include "field/code_match.h"
#include "field/codes.gpu.h"
#include "field/jumps.h"
#include "sdf/eval.h"
#include "sdf/prune.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <optional>
#include <string>
#include <utility>

namespace kiln::field {

using Code = std::vector<sdf::Instruction>;

namespace {

constexpr int kTaskCells = 8;   // side of the nodes that are handed to workers
constexpr int kTaskLevels = 4;  // 8, 4, 2, 1
constexpr int64_t kMaxCells = 1ll << 28;
constexpr int64_t kMaxTexel = 1ll << 24;     // float holds every integer up to here
constexpr float kHalfDiagonal = 6.0621779f;  // of a cell, voxels: 3.5 * sqrt(3), rounded up

int floor_div(int a, int b) { return a >= 0 ? a / b : -((-a + b - 1) / b); }

std::atomic<uint64_t> revisions{0};

struct Node {
    ivec3 cell;  // world cell of its least corner
    int size;    // cells a side
};

// A node's ball: every texel of its cells lies in it, whatever float made of the positions.
struct Ball {
    vec3 center;
    float radius;
    float slack;  // rounding of texel positions and of values, metres
};

Ball ball_of(const Node& node, float h) {
    const auto middle = [&](int cell) { return (float(cell) * 7.0f + 3.5f * float(node.size)) * h; };
    Ball ball;
    ball.center = {middle(node.cell.x), middle(node.cell.y), middle(node.cell.z)};
    const float reach = kHalfDiagonal * float(node.size) * h;
    const float far = std::max({std::fabs(ball.center.x), std::fabs(ball.center.y), std::fabs(ball.center.z)}) + reach;
    ball.slack = 4e-6f * far;  // 64 ulps
    ball.radius = reach + 5e-7f * far;
    return ball;
}

// Texels of a brick, slice by slice.
struct Slice {
    alignas(64) float x[64], y[64], z[64];
};

void fill_slice(const ivec3& texel, int k, float h, Slice& out) {
    for (int j = 0; j < kBrickTexels; ++j) {
        for (int i = 0; i < kBrickTexels; ++i) {
            const int at = j * kBrickTexels + i;
            out.x[at] = float(texel.x + i) * h;
            out.y[at] = float(texel.y + j) * h;
            out.z[at] = float(texel.z + k) * h;
        }
    }
}

struct Leaf {
    uint64_t cell;                  // index in the grid
    uint32_t first = 0, count = 0;  // code, in the task's own; count 0: the brick goes
    bool bake = false;
};

// A brick whose code only moved.
struct Moved {
    uint32_t slot;
    uint32_t first;
};

struct TaskResult {
    std::vector<Leaf> leaves;
    std::vector<Moved> moved;
    Code code;
    std::vector<uint64_t> occupancy_changes;
    uint64_t cells_tested = 0, cells_evaluated = 0;
};

struct Scratch {
    std::array<Code, kTaskLevels + 1> before,
        after;  // [0]: of the task's parent, [1]: of the task's node, and so on downwards
    sdf::PruneScratch prune;
    Slice slice;
};

// A node with the code of its parent.
struct Pending {
    Node node;
    bool in_old;  // the old field may have bricks in it, and `before` is its code there
    Code before, after;
};

}  // namespace

class FieldBuilder {
public:
    FieldBuilder(const Field* old, std::shared_ptr<const sdf::Program> program, const FieldOptions& options,
                 std::span<const Box3> dirty)
        : old_(old), program_(std::move(program)), options_(options), out_(new Field), dirty_(dirty) {}

    Result<std::shared_ptr<const Field>> run() {
        KILN_PROFILE(old_ != nullptr ? "field update" : "field build");
        if (auto ok = lay_grid(); !ok) return ok.error();
        if (old_ != nullptr) match_.emplace(*old_->program_, *program_);
        std::vector<Pending> tasks = split_to_tasks();
        std::vector<TaskResult> results(tasks.size());
        parallel_for(tasks.size(), options_.workers, [&](int i) {
            thread_local Scratch scratch;
            Pending& task = tasks[size_t(i)];
            scratch.before[0].swap(task.before);
            scratch.after[0].swap(task.after);
            descend(task.node, task.in_old, 0, scratch, results[size_t(i)]);
        });
        results.push_back(std::move(upper_));
        if (auto ok = merge(results); !ok) return ok.error();
        finish_jumps(results);
        out_->revision_ = ++revisions;
        out_->parent_revision_ = old_ != nullptr ? old_->revision_ : 0;
        return std::shared_ptr<const Field>(std::move(out_));
    }

private:
    Result<void> lay_grid() {
        out_->program_ = program_;
        out_->options_ = options_;
        const float h = options_.voxel_size;
        if (!(h > 0) || !std::isfinite(h))
            return Error{"field: voxel size " + std::to_string(h) + "; must be above 0", ErrorKind::Usage};
        if (old_ != nullptr) {
            out_->grid_ = old_->grid_;
            out_->cells_ = old_->cells_;
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
        out_->cells_.assign(size_t(cells), 0);
        return {};
    }

    // Root nodes: at most two an axis.
    std::vector<Pending> split_to_tasks() {
        const GridParams& g = out_->grid_;
        int size = 1;
        const auto wide = [&](int first, int count) {
            return floor_div(first + count - 1, size) - floor_div(first, size) > 1;
        };
        while (wide(g.cell_x, g.size_x) || wide(g.cell_y, g.size_y) || wide(g.cell_z, g.size_z)) size *= 2;
        size = std::max(size, kTaskCells);
        std::vector<Pending> level;
        for (int z = floor_div(g.cell_z, size); z * size < g.cell_z + g.size_z; ++z) {
            for (int y = floor_div(g.cell_y, size); y * size < g.cell_y + g.size_y; ++y) {
                for (int x = floor_div(g.cell_x, size); x * size < g.cell_x + g.size_x; ++x) {
                    level.push_back({{{x * size, y * size, z * size}, size},
                                     old_ != nullptr,
                                     old_ != nullptr ? old_->program_->code : Code{},
                                     program_->code});
                }
            }
        }
        while (size > kTaskCells) {
            std::vector<std::vector<Pending>> children(level.size());
            std::vector<TaskResult> results(level.size());
            parallel_for(level.size(), options_.workers, [&](int i) {
                thread_local Scratch scratch;
                Pending& parent = level[size_t(i)];
                Code before, after;
                bool in_old = parent.in_old;
                if (!enter(parent.node, in_old, parent.before, parent.after, before, after, scratch,
                           results[size_t(i)]))
                    return;
                for (int c = 0; c < 8; ++c) {
                    const Node child = child_of(parent.node, c);
                    if (outside(child)) continue;
                    children[size_t(i)].push_back({child, in_old, before, after});
                }
            });
            level.clear();
            for (std::vector<Pending>& some : children) std::move(some.begin(), some.end(), std::back_inserter(level));
            for (TaskResult& result : results) append(result, upper_);
            size /= 2;
        }
        return level;
    }

    static void append(const TaskResult& from, TaskResult& to) {
        const uint32_t base = uint32_t(to.code.size());
        to.code.insert(to.code.end(), from.code.begin(), from.code.end());
        for (Leaf leaf : from.leaves) {
            leaf.first += base;
            to.leaves.push_back(leaf);
        }
        for (Moved moved : from.moved) to.moved.push_back({moved.slot, moved.first + base});
        to.occupancy_changes.insert(to.occupancy_changes.end(), from.occupancy_changes.begin(),
                                    from.occupancy_changes.end());
        to.cells_tested += from.cells_tested;
        to.cells_evaluated += from.cells_evaluated;
    }

    static Node child_of(const Node& node, int c) {
        const int half = node.size / 2;
        return {{node.cell.x + (c & 1) * half, node.cell.y + ((c >> 1) & 1) * half, node.cell.z + (c >> 2) * half},
                half};
    }

    // The node's cells that are in the grid, counted from the grid's first.
    CellBox cells_of(const Node& node) const {
        const GridParams& g = out_->grid_;
        const ivec3 low = node.cell - ivec3{g.cell_x, g.cell_y, g.cell_z};
        return grown({low, low + ivec3{node.size, node.size, node.size}}, 0, size_);
    }

    bool outside(const Node& node) const { return cells_of(node).empty(); }

    uint64_t cell_index(int x, int y, int z) const {
        return (uint64_t(z) * uint64_t(size_.y) + uint64_t(y)) * uint64_t(size_.x) + uint64_t(x);
    }

    template <typename Fn>
    void each_cell(const Node& node, Fn&& fn) {
        const CellBox box = cells_of(node);
        for (int z = box.min.z; z < box.max.z; ++z) {
            for (int y = box.min.y; y < box.max.y; ++y) {
                for (int x = box.min.x; x < box.max.x; ++x) fn(cell_index(x, y, z));
            }
        }
    }

    // Prunes for the node, and settles it as a whole where that is possible: false then. `in_old` may turn false.
    bool enter(const Node& node, bool& in_old, const Code& parent_before, const Code& parent_after, Code& before,
               Code& after, Scratch& scratch, TaskResult& result) {
        const Ball ball = ball_of(node, options_.voxel_size);
        const auto beyond = [&](float value) {
            return std::fabs(value) > ball.radius + options_.voxel_size + ball.slack + 4e-6f * std::fabs(value);
        };
        ++result.cells_tested;
        const float value =
            sdf::prune(sdf::view(*program_, parent_after), ball.center, ball.radius, after, scratch.prune);
        bool was_beyond = false;
        if (in_old) {
            ++result.cells_tested;
            const float old_value =
                sdf::prune(sdf::view(*old_->program_, parent_before), ball.center, ball.radius, before, scratch.prune);
            const CodeMatch::Answer answer = match_->compare(before, after);
            if (answer == CodeMatch::Answer::Same) return false;
            if (answer == CodeMatch::Answer::Moved) {
                move_code(node, before, after, result);
                return false;
            }
            was_beyond = beyond(old_value);
            if (was_beyond && beyond(value) && (old_value < 0) == (value < 0)) return false;
            in_old = !was_beyond;
        }
        if (beyond(value)) {
            each_cell(node, [&](uint64_t cell) { make_empty(cell, value < 0, result); });
            return false;
        }
        return true;
    }

    void make_empty(uint64_t cell, bool inside, TaskResult& result) {
        uint32_t& word = out_->cells_[cell];
        if ((word & kCellOccupied) != 0) {
            result.leaves.push_back({cell});
            result.occupancy_changes.push_back(cell);
        }
        // The old jump may stay: update_jumps() rewrites every one that could differ.
        word = (inside ? kCellInside : 0u) | ((word & kCellOccupied) != 0 ? 0u : word & 7u);
    }

    // Nothing here changed but where its numbers lie: bricks below refer to a part of `before`, which says where each went.
    void move_code(const Node& node, const Code& before, const Code& after, TaskResult& result) {
        std::vector<std::pair<uint32_t, uint32_t>> map;
        each_cell(node, [&](uint64_t cell) {
            const uint32_t word = out_->cells_[cell];
            if ((word & kCellOccupied) == 0) return;
            if (map.empty()) {
                for (size_t i = 0; i < before.size(); ++i) map.emplace_back(before[i].param, after[i].param);
                std::sort(map.begin(), map.end());
            }
            const BrickRecord& record = old_->records_[word & kCellSlotMask];
            result.moved.push_back({word & kCellSlotMask, uint32_t(result.code.size())});
            for (uint32_t i = 0; i < record.code_count; ++i) {
                sdf::Instruction in = old_->code_[record.code_first + i];
                const auto found = std::lower_bound(map.begin(), map.end(), std::pair(in.param, 0u));
                // Instructions without numbers hold 0, as Empty (the tape's first) does.
                if (found != map.end() && found->first == in.param) in.param = found->second;
                result.code.push_back(in);
            }
        });
    }

    // scratch.before[level], after[level]: code of the node's parent.
    void descend(const Node& node, bool in_old, size_t level, Scratch& scratch, TaskResult& result) {
        if (!enter(node, in_old, scratch.before[level], scratch.after[level], scratch.before[level + 1],
                   scratch.after[level + 1], scratch, result)) {
            return;
        }
        if (node.size == 1) {
            finish_leaf(node, scratch.after[level + 1], scratch, result);
            return;
        }
        for (int c = 0; c < 8; ++c) {
            const Node child = child_of(node, c);
            if (!outside(child)) descend(child, in_old, level + 1, scratch, result);
        }
    }

    void finish_leaf(const Node& node, const Code& code, Scratch& scratch, TaskResult& result) {
        ++result.cells_evaluated;
        const CellBox box = cells_of(node);
        const uint64_t cell = cell_index(box.min.x, box.min.y, box.min.z);
        const ivec3 texel{node.cell.x * kBrickVoxels, node.cell.y * kBrickVoxels, node.cell.z * kBrickVoxels};
        const float h = options_.voxel_size;
        const sdf::TapeView tape = sdf::view(*program_, code);
        bool occupied = false, inside = false;
        for (int k : {3, 4, 0, 7, 1, 6, 2, 5}) {  // the middle, then the faces: most surfaces show early
            float values[64];
            fill_slice(texel, k, h, scratch.slice);
            sdf::evaluate(tape, {scratch.slice.x, scratch.slice.y, scratch.slice.z, 64}, values);
            for (const float value : values) occupied = occupied || std::fabs(value) < h;
            inside = values[0] < 0;
            if (occupied) break;
        }
        if (!occupied) {
            make_empty(cell, inside, result);
            return;
        }
        const uint32_t word = out_->cells_[cell];
        Leaf leaf{cell, uint32_t(result.code.size()), uint32_t(code.size()), true};
        if ((word & kCellOccupied) == 0) {
            result.occupancy_changes.push_back(cell);
        } else if (!in_dirty(texel)) {
            const BrickRecord& record = old_->records_[word & kCellSlotMask];
            leaf.bake =
                stores_differ(texel, {old_->code_.data() + record.code_first, record.code_count}, code, scratch);
        }
        result.leaves.push_back(leaf);
        result.code.insert(result.code.end(), code.begin(), code.end());
    }

    bool in_dirty(const ivec3& texel) const {
        const float h = options_.voxel_size;
        const Box3 brick{{float(texel.x) * h, float(texel.y) * h, float(texel.z) * h},
                         {float(texel.x + 7) * h, float(texel.y + 7) * h, float(texel.z + 7) * h}};
        const Box3 wide = brick.inflated((kBandVoxels + 1) * h);
        return std::any_of(dirty_.begin(), dirty_.end(), [&](const Box3& box) { return box.overlaps(wide); });
    }

    // Whether some texel would be stored otherwise: its distance, or within the band its materials.
    bool stores_differ(const ivec3& texel, std::span<const sdf::Instruction> before, const Code& after,
                       Scratch& scratch) {
        const float h = options_.voxel_size;
        for (int k = 0; k < kBrickTexels; ++k) {
            float a[64], b[64];
            sdf::MaterialMix mix_a[64], mix_b[64];
            fill_slice(texel, k, h, scratch.slice);
            const sdf::Points points{scratch.slice.x, scratch.slice.y, scratch.slice.z, 64};
            sdf::evaluate_materials(sdf::view(*old_->program_, before), points, a, mix_a);
            sdf::evaluate_materials(sdf::view(*program_, after), points, b, mix_b);
            for (size_t i = 0; i < 64; ++i) {
                const float da = a[i] / h, db = b[i] / h;
                const bool half = options_.format == DistanceFormat::Half;
                if (half ? half_code(da) != half_code(db) : snorm8_code(da) != snorm8_code(db)) return true;
                if ((std::fabs(da) < kBandVoxels) != (std::fabs(db) < kBandVoxels)) return true;
                if (std::fabs(da) < kBandVoxels && (mix_a[i].id0 != mix_b[i].id0 || mix_a[i].id1 != mix_b[i].id1 ||
                                                    mix_a[i].weight != mix_b[i].weight)) {
                    return true;
                }
            }
        }
        return false;
    }

    // Takes and gives slots in the order of cells, writes records, code and jobs.
    Result<void> merge(const std::vector<TaskResult>& results) {
        struct Entry {
            Leaf leaf;
            const Code* code;
        };
        std::vector<Entry> entries;
        for (const TaskResult& result : results) {
            for (const Leaf& leaf : result.leaves) entries.push_back({leaf, &result.code});
            out_->stats_.cells_tested += result.cells_tested;
            out_->stats_.cells_evaluated += result.cells_evaluated;
        }
        std::sort(entries.begin(), entries.end(),
                  [](const Entry& a, const Entry& b) { return a.leaf.cell < b.leaf.cell; });

        BrickPool pool(std::min(options_.max_bricks, kCellSlotMask + 1));
        if (old_ != nullptr) {
            out_->records_ = old_->records_;
            out_->code_ = old_->code_;
            std::vector<bool> used(old_->records_.size());
            for (size_t slot = 0; slot < used.size(); ++slot) used[slot] = old_->records_[slot].code_count != 0;
            pool.adopt(used);
        }
        const auto old_word = [&](uint64_t cell) { return old_ != nullptr ? old_->cells_[cell] : 0u; };
        for (const Entry& entry : entries) {
            if (entry.leaf.count != 0) continue;
            const uint32_t slot = old_word(entry.leaf.cell) & kCellSlotMask;
            pool.release(slot);
            out_->records_[slot] = {};
            ++out_->stats_.bricks_freed;
        }
        for (const TaskResult& result : results) {
            for (const Moved& moved : result.moved) {
                const BrickRecord& record = out_->records_[moved.slot];
                std::copy_n(result.code.begin() + moved.first, record.code_count,
                            out_->code_.begin() + record.code_first);
            }
        }
        const GridParams& g = out_->grid_;
        for (const Entry& entry : entries) {
            if (entry.leaf.count == 0) continue;
            const uint64_t cell = entry.leaf.cell;
            const uint32_t word = old_word(cell);
            const uint32_t slot = (word & kCellOccupied) != 0 ? word & kCellSlotMask : pool.allocate();
            if (slot == kNoSlot) continue;  // counted by the pool
            if (slot >= out_->records_.size()) out_->records_.resize(slot + 1);
            BrickRecord& record = out_->records_[slot];
            const int x = int(cell % uint64_t(size_.x)), y = int(cell / uint64_t(size_.x) % uint64_t(size_.y)),
                      z = int(cell / (uint64_t(size_.x) * uint64_t(size_.y)));
            record.texel_x = (g.cell_x + x) * kBrickVoxels;
            record.texel_y = (g.cell_y + y) * kBrickVoxels;
            record.texel_z = (g.cell_z + z) * kBrickVoxels;
            if (record.code_count != entry.leaf.count) {
                record.code_first = uint32_t(out_->code_.size());
                record.code_count = entry.leaf.count;
                out_->code_.resize(out_->code_.size() + entry.leaf.count);
            }
            std::copy_n(entry.code->begin() + entry.leaf.first, entry.leaf.count,
                        out_->code_.begin() + record.code_first);
            out_->cells_[cell] = kCellOccupied | slot;
            if (entry.leaf.bake) {
                out_->jobs_.push_back(
                    {slot, {record.texel_x, record.texel_y, record.texel_z}, record.code_first, record.code_count});
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

    // Code that no brick uses any more is dropped once it is the larger part.
    void compact_code() {
        uint64_t live = 0;
        for (const BrickRecord& record : out_->records_) live += record.code_count;
        if (out_->code_.size() <= 2 * live + 1024) return;
        Code packed;
        packed.reserve(live);
        for (BrickRecord& record : out_->records_) {
            const auto from = out_->code_.begin() + record.code_first;
            record.code_first = uint32_t(packed.size());
            packed.insert(packed.end(), from, from + record.code_count);
        }
        out_->code_ = std::move(packed);
        for (BrickJob& job : out_->jobs_) job.code_first = out_->records_[job.slot].code_first;
    }

    void finish_jumps(const std::vector<TaskResult>& results) {
        if (old_ == nullptr) {
            update_jumps(out_->cells_, size_, {{0, 0, 0}, size_}, options_.workers);
            return;
        }
        for (const TaskResult& result : results) {  // one box a task: the changes of one edit lie together
            CellBox box{size_, {0, 0, 0}};
            for (const uint64_t cell : result.occupancy_changes) {
                const int x = int(cell % uint64_t(size_.x)), y = int(cell / uint64_t(size_.x) % uint64_t(size_.y)),
                          z = int(cell / (uint64_t(size_.x) * uint64_t(size_.y)));
                box = {{std::min(box.min.x, x), std::min(box.min.y, y), std::min(box.min.z, z)},
                       {std::max(box.max.x, x + 1), std::max(box.max.y, y + 1), std::max(box.max.z, z + 1)}};
            }
            if (!box.empty()) update_jumps(out_->cells_, size_, grown(box, kMaxJump, size_), options_.workers);
        }
    }

    const Field* old_;
    std::shared_ptr<const sdf::Program> program_;
    FieldOptions options_;
    std::shared_ptr<Field> out_;
    std::span<const Box3> dirty_;
    std::optional<CodeMatch> match_;
    ivec3 size_;
    TaskResult upper_;  // what nodes above the tasks settled
};

Result<std::shared_ptr<const Field>> Field::build(std::shared_ptr<const sdf::Program> program,
                                                  const FieldOptions& options) {
    return FieldBuilder(nullptr, std::move(program), options, {}).run();
}

Result<std::shared_ptr<const Field>> Field::update(const Field& old, std::shared_ptr<const sdf::Program> program,
                                                   std::span<const Box3> dirty) {
    return FieldBuilder(&old, std::move(program), old.options_, dirty).run();
}

uint32_t Field::cell_word(int x, int y, int z) const {
    x -= grid_.cell_x;
    y -= grid_.cell_y;
    z -= grid_.cell_z;
    if (x < 0 || y < 0 || z < 0 || x >= grid_.size_x || y >= grid_.size_y || z >= grid_.size_z) return 0;
    return cells_[(size_t(z) * size_t(grid_.size_y) + size_t(y)) * size_t(grid_.size_x) + size_t(x)];
}

}  // namespace kiln::field
