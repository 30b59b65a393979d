// SPDX-License-Identifier: MIT
#include "field/code_match.h"

#include <algorithm>
#include <cstring>

namespace kiln::field {
namespace {

constexpr uint32_t kMaterialAt = 1, kEditAt = 2;  // of a Shape's numbers

bool has_params(sdf::Opcode op) {
    return op != sdf::Opcode::PointCell && op != sdf::Opcode::Move && op != sdf::Opcode::Negate &&
           op != sdf::Opcode::Empty && op != sdf::Opcode::Take;
}

}  // namespace

ParamBlocks::ParamBlocks(const sdf::Program& program) : sizes_(program.params.size(), 0) {
    // The compiler writes each instruction's numbers in one piece, so a piece ends where the next begins.
    for (const sdf::Instruction& in : program.code) {
        if (has_params(in.opcode()) && in.param < sizes_.size()) sizes_[in.param] = 1;
    }
    uint32_t end = uint32_t(sizes_.size());
    for (uint32_t at = end; at-- > 0;) {
        if (sizes_[at] == 0) continue;
        sizes_[at] = end - at;
        end = at;
    }
}

CodeMatch::CodeMatch(const sdf::Program& before, const sdf::Program& after)
    : before_(before),
      after_(after),
      blocks_before_(before),
      blocks_after_(after),
      same_samples_(before.samples == after.samples) {}

CodeMatch::Answer CodeMatch::compare(std::span<const sdf::Instruction> before,
                                     std::span<const sdf::Instruction> after) const {
    if (before.size() != after.size() || !same_samples_) return Answer::Different;
    Answer answer = Answer::Same;
    for (size_t i = 0; i < before.size(); ++i) {
        if (before[i].word != after[i].word) return Answer::Different;
        const sdf::Opcode op = before[i].opcode();
        if (!has_params(op)) continue;
        const uint32_t size = blocks_before_.size_at(before[i].param);
        if (size != blocks_after_.size_at(after[i].param)) return Answer::Different;
        const float* a = before_.params.data() + before[i].param;
        const float* b = after_.params.data() + after[i].param;
        const auto same = [&](uint32_t from, uint32_t to) {
            return to <= from || std::memcmp(a + from, b + from, (to - from) * sizeof(float)) == 0;
        };
        // An edit's number changes nothing that is stored.
        const bool equal = op == sdf::Opcode::Constant ? same(kMaterialAt, kMaterialAt + 1)
                           : op == sdf::Opcode::Shape  ? same(0, kEditAt) && same(kEditAt + 1, size)
                                                       : same(0, size);
        if (!equal) return Answer::Different;
        if (before[i].param != after[i].param) answer = Answer::Moved;
    }
    return answer;
}

}  // namespace kiln::field
