// SPDX-License-Identifier: MIT
// Rebased: a program as it is seen from a place far from the world's origin, where floats of world coordinates are too coarse: points
// count from there, and the edits at hand have their translations and boxes moved there. A difference of two floats near each
// other is exact, so what is evaluated is as exact as the numbers that the edits were given in.
// Of one thread; a thread's last one is kept, since making it copies the program's numbers.
#pragma once

#include "sdf/program.h"

#include <span>
#include <vector>

namespace kiln::sdf {

class Rebased {
public:
    /// This thread's, for `program`; no edit is moved yet.
    static Rebased& of(const Program& program);

    /// Moves these rows, and no others, to count from `origin_world`.
    void move_to(vec3 origin_world, std::span<const uint32_t> rows);
    /// Code and edits of moved rows; its index is not to be asked.
    const Program& program() const { return program_; }
    /// Code of program(), which stays the original's but for an instruction that has no number to move, as the original has it.
    Instruction original(Instruction in) const {
        return in.opcode() == Opcode::PointTranslate && in.param == cell_param_
                   ? Instruction::make(Opcode::PointCell, 0, 0, 0, 0, 0)
                   : in;
    }

private:
    void copy(const Program& program);

    Program source_;  // whose buffers it keeps, so that they are known by their addresses
    Program program_;
    // Into program_'s own arrays, which no one else has.
    float* params_ = nullptr;
    Instruction* code_ = nullptr;
    EditSpan* edits_ = nullptr;
    uint32_t cell_param_ = 0;  // three numbers that PointCell's translation is
    std::vector<uint32_t> moved_;
};

}  // namespace kiln::sdf
