// SPDX-License-Identifier: MIT
// Whether pieces of two programs' code compute the same. Offsets into `params` move when an edit is inserted before others; the
// numbers they lead to tell what stayed the same. Pruned code is a pure function of the code it was pruned from, so where
// two nodes match, everything below them matches too.
#pragma once

#include "sdf/program.h"

#include <cstdint>
#include <span>
#include <vector>

namespace kiln::field {

/// How many numbers start at each offset of a program's params.
class ParamBlocks {
public:
    explicit ParamBlocks(const sdf::Program& program);
    uint32_t size_at(uint32_t offset) const { return offset < sizes_.size() ? sizes_[offset] : 0; }

private:
    std::vector<uint32_t> sizes_;
};

class CodeMatch {
public:
    CodeMatch(const sdf::Program& before, const sdf::Program& after);

    enum class Answer : uint8_t { Different, Moved, Same };  ///< Moved: same instructions and numbers, other offsets
    Answer compare(std::span<const sdf::Instruction> before, std::span<const sdf::Instruction> after) const;

private:
    const sdf::Program &before_, &after_;
    ParamBlocks blocks_before_, blocks_after_;
    bool same_samples_;
};

}  // namespace kiln::field
