// SPDX-License-Identifier: MIT
#include "field/still_texels.h"

#include <bit>
#include <limits>

namespace kiln::field {
namespace {

constexpr float kInfinite = std::numeric_limits<float>::infinity();
// Halves are off by up to 2^-10 voxel, arithmetic by far less.
constexpr float kRounding = 0x1p-8f;

// Values differ across half a cell by more than this more often than not.
constexpr float kGuardVoxels = 2;

}  // namespace

StillTexels::StillTexels(const sdf::Program& program, const CellLattice& lattice, std::vector<Change> changes)
    : program_(&program),
      voxel_size_(lattice.voxel_size),
      own_voxels_(lattice.own_voxels),
      farthest_(lattice.farthest),
      changes_(std::move(changes)) {
    for (const Change& change : changes_) {
        const sdf::EditSpan& edit = program.edits[change.row];
        const std::span<const sdf::Instruction> code = program.code.subspan(edit.first, edit.count - 1);
        code_first_.push_back(code_.size());
        code_.insert(code_.end(), code.begin(), code.end());
        code_.push_back(sdf::Instruction::make(sdf::Opcode::Move, 0, 0, 1, 0, 0));
    }
    code_first_.push_back(code_.size());
}

StillCells StillTexels::look(const sdf::Balls& centres, const float* values) const {
    StillCells out{~uint64_t(0), ~uint64_t(0)};
    alignas(64) float edit[64];
    const float voxels = 1 / voxel_size_;
    for (size_t i = 0; i < changes_.size(); ++i) {
        if (margins_[i] == kInfinite) return {};
        sdf::evaluate(sdf::view(*program_, code_of(i)), {centres.x, centres.y, centres.z, 64}, edit);
        const float sign = program_->edits[changes_[i].row].op == Op::Union ? 1.0f : -1.0f;
        const float floor = changes_[i].gone ? -kInfinite : -kBandVoxels, above = margins_[i] + kGuardVoxels;
        const float beyond = (own_voxels_ + margins_[i]) * voxel_size_ + centres.radius;
        uint64_t away = 0, empty = 0;
        for (uint64_t left = centres.live; left != 0; left &= left - 1) {
            const int ball = std::countr_zero(left);
            const float world = sign * values[ball] * voxels;
            away |= edit[ball] * voxels > world + above || world < floor ? left & -left : 0;
            empty |= edit[ball] > beyond + sdf::kPruneUlps * (farthest_ + edit[ball]) ? left & -left : 0;
        }
        out.ask &= away;
        out.empty &= empty;
    }
    return out;
}

void StillTexels::see(std::span<const uint32_t> rows) {
    margins_.clear();
    joins_ = false;
    for (const Change& change : changes_) {
        const sdf::EditSpan& edit = program_->edits[change.row];
        sdf::BlendAllowance later;
        bool alike = true;  // what is later, and the edit
        for (const uint32_t row : rows) {
            const sdf::EditSpan& other = program_->edits[row];
            if (!change.anywhere && other.order <= edit.order) continue;
            later.add(other.reach);
            alike = alike && other.op == edit.op && other.reach == 0;
        }
        for (const Change& other : changes_) {
            if (other.gone && other.row != change.row) later.add(program_->edits[other.row].reach);
        }
        const bool moves_one_way = edit.op == Op::Union || edit.op == Op::Subtract;
        joins_ = changes_.size() == 1 && !change.gone && moves_one_way && edit.reach == 0 && alike;
        margins_.push_back(moves_one_way ? (edit.reach + later.metres()) / voxel_size_ + kRounding : kInfinite);
    }
}

bool StillTexels::hold(ivec3 cell, ivec3 first_texel, const BrickContent& brick, uint16_t only,
                       BrickEvaluator& evaluator) const {
    if (!brick.half || brick.materials || only != brick.material) return false;
    for (size_t i = 0; i < changes_.size(); ++i) {
        const Change& change = changes_[i];
        if (!contains(change.reached, cell)) continue;
        if (margins_[i] == kInfinite) return false;
        const sdf::EditSpan& edit = program_->edits[change.row];
        const sdf::Away from{brick.half->codes.data(), 0, edit.op == Op::Union ? 1.0f : -1.0f, margins_[i],
                             change.gone ? -kInfinite : -kBandVoxels};
        if (!evaluator.keeps_away(program_->code.subspan(edit.first, edit.count - 1), first_texel, from)) return false;
    }
    return true;
}

BrickContent StillTexels::joined(ivec3 first_texel, const BrickContent& brick, uint16_t only,
                                 BrickEvaluator& evaluator) const {
    if (!brick.half || only == sdf::kSeveralMaterials) return {};
    const bool cut = program_->edits[changes_[0].row].op == Op::Subtract;
    return evaluator.joined(code_of(0), first_texel, *brick.half, cut, only, own_voxels_ - kRounding);
}

}  // namespace kiln::field
