// SPDX-License-Identifier: MIT
#include "field/cell_maker.h"

#include <algorithm>
#include <cmath>

namespace kiln::field {
namespace {

constexpr float kCellHalfDiagonal = 6.0621779f;  // of a cell, voxels: 3.5 * sqrt(3), rounded up
constexpr int kFarCell = 1 << 28;                // beyond any cell that has texels

}  // namespace

vec3 origin_of_block(ivec3 block, float voxel_size) {
    const auto axis = [&](int first) {
        const bool near = first < kNearCells && first + kBlockCells > -kNearCells;
        return near ? 0.0f : float((double(first) + 0.5 * kBlockCells) * kBrickVoxels * double(voxel_size));
    };
    return {axis(block.x), axis(block.y), axis(block.z)};
}

// How much farther than `far` an edit matters, since later ones that blend lead its values on: see edit_index.cpp.
static float later_reaches(const sdf::Program& program, const sdf::IndexedEdit& edit, float far, bool anywhere) {
    const float most = program.index.blend_allowance(edit.influence(far), far, edit.row);
    if (most == 0 || anywhere) return most;
    std::vector<uint32_t> rows;
    program.index.find_blending(edit.influence(far + most), far + most, rows);
    sdf::BlendAllowance out;
    for (const uint32_t row : rows) {
        if (program.edits[row].order > program.edits[edit.row].order) out.add(program.edits[row].reach);
    }
    return out.metres();
}

CellsReached cells_reached(const sdf::Program& program, uint32_t row, const CellLattice& lattice, bool anywhere) {
    const sdf::EditSpan& span = program.edits[row];
    if (span.count == 0) return {};
    if (span.everywhere()) {
        const CellBox all{all_of(-kFarCell), all_of(kFarCell)};
        return {all, all};
    }
    const double side = double(lattice.voxel_size) * kBrickVoxels;
    const auto cell = [&](double at) { return int(std::clamp(std::floor(at), double(-kFarCell), double(kFarCell))); };
    // Far out, boxes are rounded where they lie.
    const auto more_cells = [&](float a) {
        return 0.01 + (std::fabs(double(a)) > kNearCells * side ? 1e-6 * std::fabs(double(a)) / side : 0.0);
    };
    const auto low = [&](float a) { return cell(double(a) / side - more_cells(a)); };
    const auto high = [&](float a) { return cell(double(a) / side + more_cells(a)) + 1; };
    const auto cells = [&](const Box3& box) -> CellBox {
        return {{low(box.min.x), low(box.min.y), low(box.min.z)}, {high(box.max.x), high(box.max.y), high(box.max.z)}};
    };
    const float far = influence_reach(lattice.voxel_size);
    const sdf::IndexedEdit edit = span.indexed(row);
    const float more = later_reaches(program, edit, far, anywhere);
    const float own = (lattice.own_voxels + 0.01f) * lattice.voxel_size;
    return {cells(edit.influence(far + more)), cells(edit.influence(own + more))};
}

bool stays(std::span<const sdf::Instruction> code, const sdf::Program& program, std::span<const uint32_t> rows,
           sdf::ListCuller::Start start) {
    if (!(sdf::ListCuller::start_of(code, program) == start)) return false;
    return rows.empty() || std::none_of(code.begin(), code.end(), [&](sdf::Instruction in) {
               return in.has_material() &&
                      std::binary_search(rows.begin(), rows.end(), uint32_t(program.params[in.param + 2]));
           });
}

CellMaker::OwnRoom CellMaker::take_room() {
    std::vector<std::unique_ptr<Room>>& spare = spare_rooms();
    if (spare.empty()) return OwnRoom(new Room);
    OwnRoom out(spare.back().release());
    spare.pop_back();
    return out;
}

void CellMaker::GiveBack::operator()(Room* room) const { spare_rooms().emplace_back(room); }

// A thread's.
std::vector<std::unique_ptr<CellMaker::Room>>& CellMaker::spare_rooms() {
    static thread_local std::vector<std::unique_ptr<Room>> all;
    return all;
}

// Rows that reach the box of cells, in order.
void CellMaker::find_rows(const CellBox& box) {
    const float side = lattice_.voxel_size * kBrickVoxels;
    const ivec3 first = lattice_.first;
    const auto world = [&](ivec3 c) {
        return vec3{float(c.x + first.x) * side, float(c.y + first.y) * side, float(c.z + first.z) * side};
    };
    // Boxes of edits are rounded where they lie.
    const float rounding = rebased_ != nullptr ? 1e-6f * lattice_.farthest : 0.0f;
    const Box3 wide = Box3{world(box.min), world(box.max)}.inflated(0.01f * lattice_.voxel_size + rounding);
    rows_.clear();
    program_->index.find(wide, far_ + program_->index.blend_allowance(wide, far_), rows_);
    std::sort(rows_.begin(), rows_.end(),
              [&](uint32_t a, uint32_t b) { return program_->edits[a].order < program_->edits[b].order; });
    if (rebased_ != nullptr) rebased_->move_to(lattice_.origin, rows_);
}

// Ball i around the cube of `size` cells whose least corner is `cell`: every texel of it lies inside, whatever float made of positions.
void CellMaker::place_ball(sdf::Balls& balls, int i, ivec3 cell, int size) const {
    const auto middle = [&](int c, float origin) {
        if (origin == 0) return (float(c) * 7.0f + 3.5f * float(size)) * lattice_.voxel_size;
        return float((double(c) * 7 + 3.5 * size) * double(lattice_.voxel_size) - double(origin));
    };
    balls.x[i] = middle(cell.x + lattice_.first.x, lattice_.origin.x);
    balls.y[i] = middle(cell.y + lattice_.first.y, lattice_.origin.y);
    balls.z[i] = middle(cell.z + lattice_.first.z, lattice_.origin.z);
}

// One radius for all.
void CellMaker::size_balls(sdf::Balls& balls, int size) const {
    const float h = lattice_.voxel_size, rounding = 5e-7f * lattice_.farthest;
    balls.radius = kCellHalfDiagonal * float(size) * h + rounding;
    balls.half_side = 3.5f * float(size) * h + rounding;
    balls.far = far_;
}

// No texel of a ball whose centre has this value is near enough to the surface for a brick.
bool CellMaker::beyond(float value, const sdf::Balls& balls) const {
    const float v = std::fabs(value);
    return v > balls.radius + lattice_.own_voxels * lattice_.voxel_size + 4e-6f * (lattice_.farthest + v);
}

// Of many edits that are only joined: those that reach deepest at the centre come first, until all texels are inside, or no more of them can
// come to where some texel is not below them yet. What is left out changes no bit. False where the edits are few or do else than join.
bool CellMaker::evaluate_by_depth(ivec3 first, float& least) {
    const float own = lattice_.own_voxels * lattice_.voxel_size;
    if (cells_.list.count < kManyEdits || culler_.kept_count(cells_, ball_) < kManyEdits ||
        !culler_.unions_of(cells_, ball_, depths_))
        return false;
    const auto later = [](sdf::ListCuller::Depth a, sdf::ListCuller::Depth b) {
        return a.value > b.value || (!(a.value < b.value) && a.entry > b.entry);
    };
    std::make_heap(depths_.begin(), depths_.end(), later);
    evaluator_.begin(first);
    for (float highest = sdf::kEmpty; !depths_.empty();) {
        code_.clear();
        for (int i = 0; i < kAtATime && !depths_.empty(); ++i) {
            const sdf::ListCuller::Depth next = depths_.front();
            const float reaches = next.value - cells_.balls.radius;
            if (reaches - sdf::kPruneUlps * (lattice_.farthest + std::fabs(next.value)) > highest) {
                depths_.clear();
                break;
            }
            std::pop_heap(depths_.begin(), depths_.end(), later);
            depths_.pop_back();
            culler_.emit_union(cells_, ball_, next, code_);
        }
        if (code_.empty()) break;
        least = evaluator_.join(code_);
        highest = evaluator_.highest();
        if (highest <= -own) break;
    }
    return true;
}

// The cell of the ball at hand; whether it owns a brick.
bool CellMaker::evaluate(ivec3 cell) {
    ++cells_evaluated_;
    const ivec3 at = cell + lattice_.first;
    const ivec3 first{at.x * kBrickVoxels, at.y * kBrickVoxels, at.z * kBrickVoxels};
    const float own = lattice_.own_voxels * lattice_.voxel_size;
    float least = sdf::kEmpty;
    if (evaluate_by_depth(first, least)) {
        if (!(least < own)) return false;
        emit_code();
        evaluator_.end(code_);
        return true;
    }
    emit_code();
    return evaluator_.evaluate(code_, first) < own;
}

}  // namespace kiln::field
