// SPDX-License-Identifier: MIT
#include "sdf/cull.h"

#include "base/assert.h"
#include "sdf/eval_isa.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

namespace kiln::sdf {
namespace {

constexpr float kInfinite = std::numeric_limits<float>::infinity();

bool is_tree(std::span<const Instruction> code) {
    return std::any_of(code.begin(), code.end(), [](Instruction in) { return in.opcode() >= Opcode::Combine; });
}

// 64 x 64 bits: bit j of row i becomes bit i of row j (Warren, "Hacker's Delight", 2nd ed. 2012, 7-3).
void transpose(uint64_t* rows) {
    uint64_t mask = 0xffffffffull;
    for (size_t step = 32; step != 0; step /= 2, mask ^= mask << step) {
        for (size_t i = 0; i < 64; i = (i + step + 1) & ~step) {
            const uint64_t swap = ((rows[i] >> step) ^ rows[i + step]) & mask;
            rows[i] ^= swap << step;
            rows[i + step] ^= swap;
        }
    }
}

}  // namespace

std::span<const Instruction> ListCuller::code_of(const Entry& entry) const {
    return entry.made ? std::span(code_).subspan(entry.code_first, entry.code_count)
                      : program_->code.subspan(entry.code_first, entry.code_count);
}

ListCuller::List ListCuller::list_of(std::span<const uint32_t> rows) {
    List out{entries_.size(), rows.size(), code_.size(), true};
    entries_.reserve(entries_.size() + rows.size());
    for (const uint32_t row : rows) {
        const EditSpan& span = program_->edits[row];
        const uint32_t count = span.count - 1;
        const std::span<const Instruction> code = program_->code.subspan(span.first, count);
        const bool plain =
            span.op == Op::Union && span.reach <= 0 && count == 2 && is_fused_leaf(code[0].word, code[1].word);
        entries_.push_back(
            {row, span.first, count, span.material, plain, FoldEntry::Combine, false, !plain && is_tree(code)});
    }
    return out;
}

void ListCuller::fold(Fold& fold, bool own) {
    const size_t n = fold.list.count;
    const std::span<const Entry> entries = std::span(entries_).subspan(fold.list.first, n);
    const bool has_far = std::isfinite(fold.balls.far);
    fold_entries_.resize(n);
    BlendAllowance later;  // of what comes after an entry
    for (size_t i = n; i-- > 0;) {
        const Entry& entry = entries[i];
        const EditSpan& span = program_->edits[entry.row];
        const std::span<const Instruction> code = code_of(entry);
        FoldEntry& f = fold_entries_[i];
        f = {reinterpret_cast<const uint32_t*>(code.data()),
             uint32_t(code.size()),
             span.blend,
             span.reach,
             fold.balls.far + later.metres(),
             uint8_t(span.op),
             entry.join,
             {0, 0, 0},
             {kInfinite, kInfinite, kInfinite}};
        if (has_far && !span.everywhere()) {
            const Box3 box = span.indexed(entry.row).influence(f.far);
            const vec3 middle = box.center(), half = box.half_extents();
            for (size_t axis = 0; axis < 3; ++axis) {
                f.middle[axis] = axis == 0 ? middle.x : axis == 1 ? middle.y : middle.z;
                f.half[axis] = axis == 0 ? half.x : axis == 1 ? half.y : half.z;
            }
        }
        later.add(span.reach);
    }
    fold.left.resize(n);
    fold.right.resize(n);
    if (own) fold.own.resize(64 * n);
    fold_list(fold_entries_, numbers_, fold.balls, fold.left.data(), fold.right.data(), fold.value,
              own ? fold.own.data() : nullptr);
}

// From the last edit to the first, as prune() walks its tape: a ball needs what comes before as a value, for its material, or not.
void ListCuller::keep(Fold& fold, uint64_t live) {
    const size_t n = fold.list.count;
    fold.joined.assign(n, 0);
    fold.won.assign(n, 0);
    fold.shown.assign(n, 0);
    uint64_t value = live, material = 0;
    for (size_t i = n; i-- > 0 && (value | material) != 0;) {
        const Entry& entry = entries_[fold.list.first + i];
        const uint64_t won = (value | material) & fold.right[i];
        const uint64_t joined = (value | material) & ~(fold.left[i] | fold.right[i]);
        fold.joined[i] = joined;
        fold.won[i] = won & value;
        fold.shown[i] = won & material;
        value = (value & ~won) | joined;
        material &= ~(won | joined);
        if (won != 0 && join_of(entry, true) == FoldEntry::Take) material |= won;
    }
    fold.from_empty = fold.list.from_empty ? value | material : 0;
    fold.kept.resize((n + 63) / 64 * 64);
    for (size_t block = 0; block * 64 < n; ++block) {
        uint64_t* const rows = fold.kept.data() + block * 64;
        for (size_t i = 0; i < 64; ++i) {
            const size_t e = block * 64 + i;
            rows[i] = e < n ? fold.joined[e] | fold.won[e] | fold.shown[e] : 0;
        }
        transpose(rows);
    }
}

template <typename Fn>
void ListCuller::each_kept(const Fold& fold, int ball, Fn&& fn) {
    const uint64_t bit = uint64_t(1) << ball;
    for (size_t first = 0; first < fold.list.count; first += 64) {
        for (uint64_t left = fold.kept[first + size_t(ball)]; left != 0; left &= left - 1) {
            const size_t i = first + size_t(std::countr_zero(left));
            const bool shown = (fold.shown[i] & bit) != 0;
            fn(i, shown || (fold.won[i] & bit) != 0, shown);
        }
    }
}

// What becomes of an edit's Combine in a ball where the edit alone wins.
FoldEntry::Join ListCuller::join_of(const Entry& entry, bool won) const {
    if (!won || entry.join != FoldEntry::Combine) return entry.join;
    const EditSpan& span = program_->edits[entry.row];
    const Instruction combine = program_->code[span.first + span.count - 1];
    if ((combine.aux() & kMayLackMaterial) != 0) return FoldEntry::Take;
    return span.op == Op::Subtract ? FoldEntry::Negate : FoldEntry::Move;
}

void ListCuller::write_content(const Entry& entry, vec3 center, float radius, bool whole,
                               std::vector<Instruction>& out) {
    const std::span<const Instruction> code = code_of(entry);
    if (entry.tree) {
        // A copy: `out` may be where the code lies.
        const std::vector<Instruction> source(code.begin(), code.end());
        prune_edit({source, numbers_.params, numbers_.samples, numbers_.memory_slots}, center, radius, whole, out,
                   prune_);
        return;
    }
    if (whole) {
        const size_t at = out.size();
        out.resize(at + code.size());
        std::copy_n(code_of(entry).begin(), code.size(), out.begin() + std::ptrdiff_t(at));
        return;
    }
    const auto shape = std::find_if(code.begin(), code.end(), [](Instruction in) {
        return in.opcode() == Opcode::Shape || in.opcode() == Opcode::Constant;
    });
    KILN_ASSERT(shape != code.end(), "edit {} has no shape", entry.row);
    out.push_back(Instruction::make(Opcode::Constant, 0, 1, 0, 0, shape->param));
}

void ListCuller::write_join(const Entry& entry, FoldEntry::Join join, std::vector<Instruction>& out) const {
    const EditSpan& span = program_->edits[entry.row];
    switch (join) {
    case FoldEntry::Combine:
        out.push_back(program_->code[span.first + span.count - 1]);
        break;
    case FoldEntry::Take:
        out.push_back(Instruction::make(Opcode::Take, span.op == Op::Subtract ? 1u : 0u, 0, 0, 1, 0));
        break;
    case FoldEntry::Move:
        out.push_back(Instruction::make(Opcode::Move, 0, 0, 1, 0, 0));
        break;
    case FoldEntry::Negate:
        out.push_back(Instruction::make(Opcode::Negate, 0, 0, 1, 0, 0));
        break;
    }
}

ListCuller::List ListCuller::child(const Fold& fold, int ball) {
    const uint64_t bit = uint64_t(1) << ball;
    List out{entries_.size(), 0, code_.size(), (fold.from_empty & bit) != 0};
    each_kept(fold, ball, [&](size_t i, bool won, bool shown) {
        Entry entry = entries_[fold.list.first + i];
        if (entry.tree || shown) {
            const uint32_t at = uint32_t(code_.size());
            write_content(entry, fold.balls.center(ball), fold.balls.radius, !shown, code_);
            entry.code_first = at;
            entry.code_count = uint32_t(code_.size()) - at;
            entry.made = true;
            entry.tree = entry.tree && is_tree(code_of(entry));
        }
        entry.join = join_of(entry, won);
        entries_.push_back(entry);
    });
    out.count = entries_.size() - out.first;
    return out;
}

void ListCuller::emit(const Fold& fold, int ball, std::vector<Instruction>& out) {
    const uint64_t bit = uint64_t(1) << ball;
    out.clear();
    if ((fold.from_empty & bit) != 0) out.push_back(Instruction::make(Opcode::Empty, 0, 0, 0, 0, 0));
    each_kept(fold, ball, [&](size_t i, bool won, bool shown) {
        const Entry& entry = entries_[fold.list.first + i];
        write_content(entry, fold.balls.center(ball), fold.balls.radius, !shown, out);
        write_join(entry, join_of(entry, won), out);
    });
}

size_t ListCuller::kept_count(const Fold& fold, int ball) {
    size_t out = 0;
    for (size_t first = 0; first < fold.list.count; first += 64)
        out += size_t(std::popcount(fold.kept[first + size_t(ball)]));
    return out;
}

bool ListCuller::unions_of(const Fold& fold, int ball, std::vector<Depth>& out) const {
    out.clear();
    bool unions = true;
    each_kept(fold, ball, [&](size_t i, bool, bool shown) {
        if (shown) return;  // it lost everywhere, but for its material
        unions = unions && entries_[fold.list.first + i].plain;
        out.push_back({fold.own[64 * i + size_t(ball)], uint32_t(i)});
    });
    return unions;
}

void ListCuller::emit_union(const Fold& fold, int ball, Depth one, std::vector<Instruction>& out) {
    const Entry& entry = entries_[fold.list.first + one.entry];
    write_content(entry, fold.balls.center(ball), fold.balls.radius, true, out);
    write_join(entry, FoldEntry::Combine, out);
}

uint16_t ListCuller::only_material(const Fold& fold, int ball) const {
    uint16_t out = uint16_t(kNoMaterial);
    each_kept(fold, ball, [&](size_t i, bool, bool) {
        const uint16_t material = entries_[fold.list.first + i].material;
        if (material == kNoMaterial || material == out) return;  // what has none shows another's
        out = out == kNoMaterial ? material : kSeveralMaterials;
    });
    return out == kNoMaterial ? uint16_t(kDefaultMaterial) : out;
}

ListCuller::Start ListCuller::start_of(const Fold& fold, int ball) const {
    Start out{(fold.from_empty >> ball & 1u) != 0, UINT32_MAX};
    for (size_t first = 0; first < fold.list.count; first += 64) {
        const uint64_t kept = fold.kept[first + size_t(ball)];
        if (kept == 0) continue;
        out.row = entries_[fold.list.first + first + size_t(std::countr_zero(kept))].row;
        break;
    }
    return out;
}

ListCuller::Start ListCuller::start_of(std::span<const Instruction> code, const Program& program) {
    Start out{!code.empty() && code[0].opcode() == Opcode::Empty, UINT32_MAX};
    const auto first = std::find_if(code.begin(), code.end(), [](Instruction in) { return in.has_material(); });
    if (first != code.end()) out.row = uint32_t(program.params[first->param + 2]);
    return out;
}

void ListCuller::drop(const List& list) {
    entries_.resize(list.first);
    code_.resize(list.code);
}

uint64_t ListCuller::balls_unchanged_by(const Fold& fold, std::span<const uint32_t> rows) const {
    uint64_t out = ~uint64_t(0);
    for (size_t i = 0; i < fold.list.count; ++i) {
        if (std::find(rows.begin(), rows.end(), entries_[fold.list.first + i].row) != rows.end()) out &= fold.left[i];
    }
    return out;
}

uint64_t ListCuller::balls_with(const Fold& fold, std::span<const uint32_t> rows) const {
    uint64_t out = 0;
    for (size_t i = 0; i < fold.list.count; ++i) {
        if (!std::binary_search(rows.begin(), rows.end(), entries_[fold.list.first + i].row)) continue;
        out |= fold.joined[i] | fold.won[i] | fold.shown[i];
    }
    return out;
}

}  // namespace kiln::sdf
