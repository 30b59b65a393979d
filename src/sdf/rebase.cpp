// SPDX-License-Identifier: MIT
#include "sdf/rebase.h"

#include <algorithm>
#include <cmath>

namespace kiln::sdf {

Rebased& Rebased::of(const Program& program) {
    static thread_local Rebased kept;
    const auto same = [](const auto& a, const auto& b) { return a.data() == b.data() && a.size() == b.size(); };
    if (!same(kept.source_.code, program.code) || !same(kept.source_.params, program.params) ||
        !same(kept.source_.edits, program.edits) || !same(kept.source_.samples, program.samples))
        kept.copy(program);
    kept.move_to({}, {});
    return kept;
}

void Rebased::copy(const Program& program) {
    const auto own = [](auto& array, const auto& from, size_t more) {
        array = {};
        auto* const at = array.extend(from.size() + more);
        std::copy(from.begin(), from.end(), at);
        return at;
    };
    source_ = program;
    program_ = {};
    program_.samples = program.samples;
    program_.memory_slots = program.memory_slots;
    code_ = own(program_.code, program.code, 0);
    params_ = own(program_.params, program.params, 3);
    edits_ = own(program_.edits, program.edits, 0);
    cell_param_ = uint32_t(program.params.size());
    moved_.clear();
}

void Rebased::move_to(vec3 o, std::span<const uint32_t> rows) {
    const auto each_start = [&](uint32_t row, auto&& fn) {
        const EditSpan& span = source_.edits[row];
        for (uint32_t i = span.first; i < span.first + span.count; ++i) {
            if (source_.code[i].starts_chain()) fn(i);
        }
    };
    for (const uint32_t row : moved_) {
        edits_[row] = source_.edits[row];
        each_start(row, [&](uint32_t i) {
            code_[i] = source_.code[i];
            if (code_[i].opcode() == Opcode::PointCell) return;
            std::copy_n(source_.params.data() + code_[i].param, 3, params_ + code_[i].param);
        });
    }
    moved_.assign(rows.begin(), rows.end());
    params_[cell_param_] = -o.x, params_[cell_param_ + 1] = -o.y, params_[cell_param_ + 2] = -o.z;
    for (const uint32_t row : rows) {
        Box3& box = edits_[row].bounds;
        // Boxes are rounded where they lie.
        const float size = std::max({std::fabs(o.x), std::fabs(o.y), std::fabs(o.z)});
        if (box.finite()) box = Box3{box.min - o, box.max - o}.inflated(4e-7f * size);
        each_start(row, [&](uint32_t i) {
            if (code_[i].opcode() == Opcode::PointCell) {
                code_[i] = Instruction::make(Opcode::PointTranslate, 0, 0, 0, 0, cell_param_);
                return;
            }
            float* const t = params_ + source_.code[i].param;
            const float* const was = source_.params.data() + source_.code[i].param;
            t[0] = was[0] - o.x, t[1] = was[1] - o.y, t[2] = was[2] - o.z;
        });
    }
}

}  // namespace kiln::sdf
