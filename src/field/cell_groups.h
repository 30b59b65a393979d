// SPDX-License-Identifier: MIT
// CellGroups: some of a window's groups of 4³ cells (cell_maker.h).
#pragma once

#include "field/cell_maker.h"

#include <cstdint>
#include <vector>

namespace kiln::field {

/// A bit for each of a block's groups, a word for each block at its place in the torus. A window may begin and end in blocks that share a
/// word: one of them may then seem to have what the other has.
class CellGroups {
public:
    explicit CellGroups(int window_cells) : side_(window_cells / kBlockCells), blocks_(size_t(side_ * side_ * side_)) {}

    /// Of the block that begins with this world cell: bit() of each of its groups.
    uint64_t of(ivec3 block) const { return blocks_[place(block)]; }
    void add(ivec3 block, uint64_t groups) { blocks_[place(block)] |= groups; }
    /// Of a world cell in its block.
    static uint64_t bit(ivec3 cell) {
        const ivec3 at{cell.x & (kBlockCells - 1), cell.y & (kBlockCells - 1), cell.z & (kBlockCells - 1)};
        return uint64_t(1) << ((at.z / kGroupCells * 4 + at.y / kGroupCells) * 4 + at.x / kGroupCells);
    }

private:
    size_t place(ivec3 block) const {
        const auto axis = [&](int a) { return (a / kBlockCells) & (side_ - 1); };
        return size_t((axis(block.z) * side_ + axis(block.y)) * side_ + axis(block.x));
    }

    int side_;  // blocks of a window; a power of two
    std::vector<uint64_t> blocks_;
};

}  // namespace kiln::field
