// SPDX-License-Identifier: MIT
// CellMaker: what the cells of a lattice are, from a program's edits: empty on one side, or a brick with its pruned code and texels.
// Fields (field.h) and levels (clipmap.h) are made of its answers. Cells are asked for in blocks of 16³: the index finds the edits that
// reach the block, their list is folded at the centres of its 64 groups of 4³ cells, and for groups that may hold a surface at their 64 cells
// (Barbier et al., "Lipschitz Pruning", 2025, branch in the same way); what is left of the list is a cell's code, which is
// evaluated at its texels to see whether the cell owns a brick. What a cell is depends on nothing but the program and the cell.
#pragma once

#include "field/brick_content.h"
#include "field/cell_rows.h"
#include "field/jumps.h"
#include "sdf/cull.h"
#include "sdf/rebase.h"

#include <algorithm>
#include <bit>
#include <memory>
#include <span>
#include <vector>

namespace kiln::field {

inline constexpr int kBlockCells = 16;
inline constexpr int kGroupCells = 4;

/// How near an edit must come to change what is stored, metres.
inline float influence_reach(float voxel_size) { return (kBandVoxels + 0.01f) * voxel_size; }

/// What points of a block count from, floats: 0 on axes where the block is near the world's origin (texel_position).
vec3 origin_of_block(ivec3 block, float voxel_size);

struct CellLattice {
    ivec3 first;           ///< world cell that cells are counted from
    float voxel_size = 0;  ///< metres
    float own_voxels = 1;  ///< a cell owns a brick iff some texel's |value| is below this many voxels
    float farthest = 0;    ///< largest coordinate that is asked about, metres: decides what rounding may add
    vec3 origin;           ///< world metres that points count from; not 0 only for one block, its origin_of_block()
};

inline bool contains(const CellBox& b, ivec3 c) {
    return c.x >= b.min.x && c.y >= b.min.y && c.z >= b.min.z && c.x < b.max.x && c.y < b.max.y && c.z < b.max.z;
}
inline bool meet(const CellBox& a, const CellBox& b) {
    return a.min.x < b.max.x && a.min.y < b.max.y && a.min.z < b.max.z && b.min.x < a.max.x && b.min.y < a.max.y &&
           b.min.z < a.max.z;
}
inline ivec3 all_of(int a) { return {a, a, a}; }

/// World cells that an edit can change by coming into the program or by leaving it; far beyond any world where it is everywhere.
struct CellsReached {
    CellBox stored;  ///< what their bricks hold. Empty: none
    CellBox owned;   ///< whether they own bricks: elsewhere, what is empty stays so
};
/// Of several that leave and come, think that the last in order leave first and then the first come first: so at each step what is later is
/// in the program. `anywhere`: the edit has left, and the list has new numbers since; every other may be later.
CellsReached cells_reached(const sdf::Program& program, uint32_t row, const CellLattice& lattice, bool anywhere);

/// Whether a brick's code stays what it was when `rows`, in ascending order, go, and it would begin so.
bool stays(std::span<const sdf::Instruction> code, const sdf::Program& program, std::span<const uint32_t> rows,
           sdf::ListCuller::Start start);

/// One thread's. A sink says which cells it wants and takes what they are:
///     bool wants(const CellBox& cells)      whether it wants any of these; may err towards yes
///     bool wants(ivec3 cell)
///     bool stop()                           asked before each cell that may own a brick: leave the rest alone
///     void air(const CellBox& cells)        these are empty and outside, also those it does not want
///     void empty(ivec3 cell, bool inside)
///     bool keeps(ivec3 cell, Inserted, ListCuller::Start)    it is as it was
/// and, of run_box() alone,
///     uint32_t wanted(ivec3 first, int count)     of a row of cells within a page, a bit each: those that it wants
///     StillCells look(const CellMaker&, uint64_t changing)    of the cells centres() are of, a bit each: those that an edit may change
///     bool is_empty(ivec3 cell)                   as it was
///     bool texels_stay(ivec3 cell, CellMaker&)    it has a brick, with another code but the same texels, and has taken it
///     bool texels_join(ivec3 cell, CellMaker&)    likewise, but has other texels, which follow from those it had
///     void brick(ivec3 cell, CellMaker&)    append_code(), evaluator() and only_material() are its
enum class Inserted : uint8_t {
    Shows,    ///< one of the edits that came is in the code of the cell
    Hidden,   ///< none is
    NoEffect  ///< with or without them the same is stored
};
/// Of 64 cells, a bit each.
struct StillCells {
    uint64_t empty = 0;  ///< stay so, if they are
    uint64_t ask = 0;    ///< have a brick that may stay
};

class CellMaker {
    // What is kept between makers of a thread, so that a small update need not ask for memory.
    struct Room {
        sdf::ListCuller::Fold groups, cells;
        std::vector<uint32_t> rows;
        std::vector<sdf::Instruction> code;
        std::vector<sdf::ListCuller::Depth> depths;
    };
    static std::vector<std::unique_ptr<Room>>& spare_rooms();
    static constexpr size_t kManyEdits = 24;  // of fewer, all are evaluated sooner than they are put in order
    static constexpr int kAtATime = 8;
    struct GiveBack {
        void operator()(Room* room) const;
    };
    using OwnRoom = std::unique_ptr<Room, GiveBack>;
    static OwnRoom take_room();

public:
    CellMaker(const sdf::Program& program, const CellLattice& lattice, std::span<const uint32_t> inserted = {})
        : program_(&program),
          rebased_(lattice.origin == vec3{} ? nullptr : &sdf::Rebased::of(program)),
          lattice_(lattice),
          inserted_(inserted),
          far_(influence_reach(lattice.voxel_size)),
          culler_(rebased_ != nullptr ? rebased_->program() : program),
          evaluator_(rebased_ != nullptr ? rebased_->program() : program, lattice.voxel_size, lattice.origin) {}

    /// The cells of the block whose first is `at`; `bounds` cuts off what no one wants.
    template <typename Sink>
    void run_block(ivec3 at, const CellBox& bounds, Sink& sink);
    /// All cells of a box, 64 at a time, without the hierarchy: for boxes of few cells.
    template <typename Sink>
    void run_box(const CellBox& box, Sink& sink);

    /// As the program itself has it.
    void append_code(std::vector<sdf::Instruction>& to) const {
        to.insert(to.end(), code_.begin(), code_.end());
        if (rebased_ == nullptr) return;
        for (auto in = to.end() - ptrdiff_t(code_.size()); in != to.end(); ++in) *in = rebased_->original(*in);
    }
    uint32_t code_count() const { return uint32_t(code_.size()); }
    const BrickEvaluator& evaluator() const { return evaluator_; }
    BrickEvaluator& evaluator() { return evaluator_; }
    /// Of run_box(): the edits that reach the box, in order.
    std::span<const uint32_t> rows() const { return rows_; }
    /// Balls round the cells at hand, and the program's values at their centres.
    const sdf::Balls& centres() const { return cells_.balls; }
    const float* values() const { return cells_.value; }
    ivec3 cell(int ball) const { return cell_[ball]; }
    /// Of the cell that a sink is asked about: makes its code.
    void emit_code() { culler_.emit(cells_, ball_, code_); }
    uint16_t only_material() {
        if (!has_material_) only_material_ = culler_.only_material(cells_, ball_);
        has_material_ = true;
        return only_material_;
    }
    uint64_t cells_tested() const { return cells_tested_; }        ///< balls folded at any level of the hierarchy
    uint64_t cells_evaluated() const { return cells_evaluated_; }  ///< cells whose texels were looked at

private:
    // Row i of a group of 64: x fastest.
    static ivec3 place_of(int i) { return {i & 3, i >> 2 & 3, i >> 4}; }
    static ivec3 cell_in(ivec3 block, int group, int c) {
        const ivec3 g = place_of(group), p = place_of(c);
        return {block.x + g.x * kGroupCells + p.x, block.y + g.y * kGroupCells + p.y,
                block.z + g.z * kGroupCells + p.z};
    }

    void find_rows(const CellBox& box);
    void place_ball(sdf::Balls& balls, int i, ivec3 cell, int size) const;
    void size_balls(sdf::Balls& balls, int size) const;
    bool beyond(float value, const sdf::Balls& balls) const;
    bool evaluate_by_depth(ivec3 first, float& least);
    bool evaluate(ivec3 cell);
    template <bool kWholeList, typename Sink>
    void run_cells(Sink& sink);

    const sdf::Program* program_;
    sdf::Rebased* rebased_;  // null where points count from the world's origin
    CellLattice lattice_;
    std::span<const uint32_t> inserted_;
    float far_;
    sdf::ListCuller culler_;
    OwnRoom room_ = take_room();
    sdf::ListCuller::Fold &groups_ = room_->groups, &cells_ = room_->cells;
    std::vector<uint32_t>& rows_ = room_->rows;
    std::vector<sdf::Instruction>& code_ = room_->code;
    std::vector<sdf::ListCuller::Depth>& depths_ = room_->depths;
    BrickEvaluator evaluator_;
    ivec3 cell_[64];             // of the balls of cells_
    int ball_ = 0;               // of the brick at hand
    bool has_material_ = false;  // whether only_material_ is that of its cell
    uint16_t only_material_ = 0;
    uint64_t cells_tested_ = 0, cells_evaluated_ = 0;
};

template <typename Sink>
void CellMaker::run_block(ivec3 at, const CellBox& bounds, Sink& sink) {
    const auto cut = [&](const CellBox& b) {
        return CellBox{
            {std::max(b.min.x, bounds.min.x), std::max(b.min.y, bounds.min.y), std::max(b.min.z, bounds.min.z)},
            {std::min(b.max.x, bounds.max.x), std::min(b.max.y, bounds.max.y), std::min(b.max.z, bounds.max.z)}};
    };
    const CellBox block{at, at + all_of(kBlockCells)};
    find_rows(block);  // all of it: what a cell becomes is to be a function of program, block and cell alone
    if (rows_.empty()) {
        sink.air(cut(block));
        return;
    }
    groups_.list = culler_.list_of(rows_);
    groups_.balls.live = 0;
    for (int i = 0; i < 64; ++i) {
        const ivec3 first = cell_in(at, i, 0);
        place_ball(groups_.balls, i, first, kGroupCells);
        const CellBox group = cut({first, first + all_of(kGroupCells)});
        if (!group.empty() && sink.wants(group)) groups_.balls.live |= uint64_t(1) << i;
    }
    size_balls(groups_.balls, kGroupCells);
    culler_.fold(groups_);
    uint64_t open = 0;
    for (int i = 0; i < 64; ++i) {
        if ((groups_.balls.live >> i & 1u) == 0) continue;
        ++cells_tested_;
        if (!beyond(groups_.value[i], groups_.balls)) {
            open |= uint64_t(1) << i;
            continue;
        }
        const ivec3 first = cell_in(at, i, 0);
        if (groups_.value[i] >= 0) {
            sink.air(cut({first, first + all_of(kGroupCells)}));
            continue;
        }
        for (int c = 0; c < 64; ++c) {
            const ivec3 cell = cell_in(at, i, c);
            if (contains(bounds, cell) && sink.wants(cell)) sink.empty(cell, true);
        }
    }
    culler_.keep(groups_, open);
    for (int i = 0; i < 64 && !sink.stop(); ++i) {
        if ((open >> i & 1u) == 0) continue;
        cells_.list = culler_.child(groups_, i);
        cells_.balls.live = 0;
        for (int c = 0; c < 64; ++c) {
            cell_[c] = cell_in(at, i, c);
            place_ball(cells_.balls, c, cell_[c], 1);
            if (contains(bounds, cell_[c]) && sink.wants(cell_[c])) cells_.balls.live |= uint64_t(1) << c;
        }
        run_cells<false>(sink);
        culler_.drop(cells_.list);
    }
    culler_.drop(groups_.list);
}

template <typename Sink>
void CellMaker::run_box(const CellBox& box, Sink& sink) {
    find_rows(box);
    cells_.list = culler_.list_of(rows_);
    int n = 0;
    const auto run = [&] {
        if (n == 0) return;
        cells_.balls.live = n == 64 ? ~uint64_t(0) : (uint64_t(1) << n) - 1;
        for (int i = n; i < 64; ++i) place_ball(cells_.balls, i, cell_[n - 1], 1);
        run_cells<true>(sink);
        n = 0;
    };
    for (int z = box.min.z; z < box.max.z; ++z) {
        for (int y = box.min.y; y < box.max.y; ++y) {
            for (int x = box.min.x, end; x < box.max.x; x = end) {
                end = std::min(first_of_row(x) + kCellPage, box.max.x);
                for (uint32_t left = sink.wanted({x, y, z}, end - x); left != 0; left &= left - 1) {
                    cell_[n] = {x + std::countr_zero(left), y, z};
                    place_ball(cells_.balls, n, cell_[n], 1);
                    if (++n == 64) run();
                }
            }
        }
    }
    run();
    culler_.drop(cells_.list);
}

// cells_ has its list, its balls' places and which of them to look at. kWholeList: whatever reaches a cell is in the list.
template <bool kWholeList, typename Sink>
void CellMaker::run_cells(Sink& sink) {
    size_balls(cells_.balls, 1);
    culler_.fold(cells_, cells_.list.count >= kManyEdits);
    uint64_t open = 0;
    for (int i = 0; i < 64; ++i) {
        if ((cells_.balls.live >> i & 1u) == 0) continue;
        ++cells_tested_;
        if (beyond(cells_.value[i], cells_.balls)) {
            sink.empty(cell_[i], cells_.value[i] < 0);
        } else {
            open |= uint64_t(1) << i;
        }
    }
    if (open == 0) return;
    culler_.keep(cells_, open);
    const uint64_t shown = inserted_.empty() ? 0 : culler_.balls_with(cells_, inserted_);
    const uint64_t no_effect = kWholeList ? culler_.balls_unchanged_by(cells_, inserted_) : 0;
    StillCells still;
    if constexpr (kWholeList) still = sink.look(*this, open & ~no_effect);
    for (int i = 0; i < 64; ++i) {
        if ((open >> i & 1u) == 0) continue;
        const Inserted inserted = (no_effect >> i & 1u) != 0 ? Inserted::NoEffect
                                  : (shown >> i & 1u) != 0   ? Inserted::Shows
                                                             : Inserted::Hidden;
        if constexpr (kWholeList) {
            if ((still.empty >> i & 1u) != 0 && sink.is_empty(cell_[i])) continue;
        }
        if (sink.keeps(cell_[i], inserted, culler_.start_of(cells_, i))) continue;
        if (sink.stop()) return;
        ball_ = i;
        has_material_ = false;
        if constexpr (kWholeList) {
            if ((still.ask >> i & 1u) != 0 && sink.texels_stay(cell_[i], *this)) continue;
            if (sink.texels_join(cell_[i], *this)) continue;
        }
        if (evaluate(cell_[i])) {
            sink.brick(cell_[i], *this);
        } else {
            sink.empty(cell_[i], evaluator_.distances()[0] < 0);
        }
    }
}

}  // namespace kiln::field
