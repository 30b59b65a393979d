// SPDX-License-Identifier: MIT
// The brick map: one word a cell, in pages of 8x8x8 cells that snapshots share, and the jumps of empty cells: how many cells a ray may
// skip, a pure function of which cells own bricks.
#pragma once

#include "base/paged_array.h"
#include "field/brick.gpu.h"

#include <cstdint>
#include <span>

namespace kiln::field {

/// Box of cells, [min, max), counted from the grid's first.
struct CellBox {
    ivec3 min, max;
    bool empty() const { return min.x >= max.x || min.y >= max.y || min.z >= max.z; }
};

/// Cells of `box` grown by `by`, and cut to the grid.
CellBox grown(const CellBox& box, int by, ivec3 grid_size);
/// The smallest box with both.
CellBox joined(const CellBox& a, const CellBox& b);

/// Cell words by position, counted from the grid's first cell. Cells that were never written are empty, outside, and far from bricks.
/// A map that wraps (its sides are powers of two, kCellPage at least) is a torus: any position is one of its cells.
/// From further away, in cells, a cell changes no jump.
constexpr int kJumpReach = kMaxJump - 1;

class CellMap {
public:
    using Words = PagedArray<uint32_t, kCellPage * kCellPage * kCellPage>;

    CellMap() : words_(uint32_t(kMaxJump)) {}
    explicit CellMap(ivec3 size) : CellMap() {
        size_ = size;
        pages_ = {pages_along(size.x), pages_along(size.y), pages_along(size.z)};
        words_.resize_pages(size_t(pages_.x) * size_t(pages_.y) * size_t(pages_.z));
    }
    static CellMap torus(int side) {
        CellMap out({side, side, side});
        out.mask_ = side - 1;
        return out;
    }
    static int pages_along(int cells) { return (cells + kCellPage - 1) / kCellPage; }

    ivec3 size() const { return size_; }
    ivec3 pages() const { return pages_; }
    bool wraps() const { return mask_ >= 0; }
    size_t page_index(int x, int y, int z) const {
        const int mask = mask_ >> 3;  // kCellPage = 8
        x &= mask, y &= mask, z &= mask;
        return (size_t(z) * size_t(pages_.y) + size_t(y)) * size_t(pages_.x) + size_t(x);
    }
    size_t index(int x, int y, int z) const {
        return size_t(cell_word_index(x & mask_, y & mask_, z & mask_, pages_.x, pages_.y));
    }
    uint32_t at(int x, int y, int z) const { return words_[index(x, y, z)]; }
    void set(int x, int y, int z, uint32_t word) {
        const size_t i = index(x, y, z);
        if (words_[i] != word) words_.write(i) = word;
    }
    const Words& words() const { return words_; }
    Words& words() { return words_; }

private:
    ivec3 size_, pages_;
    int mask_ = -1;  // of positions
    Words words_;
};

/// Rewrites the jump of every empty cell in `box`: the Chebyshev distance to the nearest occupied cell of the whole grid, at most
/// kMaxJump (also where there is none). All cells of such a cube around an empty cell but its shell are empty; neighbouring empty
/// cells share a face of texels, on which every value is at least a voxel from 0, and no two neighbouring texels differ by
/// two voxels: so they all have one sign. Writes only words that differ. On a torus distance wraps too: a jump may be shorter than it
/// could be, never longer. A cell that becomes occupied or empty changes jumps up to kMaxJump - 1 cells away.
void update_jumps(CellMap& cells, const CellBox& box);

/// The same after these cells, and no others, became occupied, or empty with any jump: look only where a jump may be another. Not on a torus.
void lower_jumps(CellMap& cells, std::span<const ivec3> occupied);
void raise_jumps(CellMap& cells, std::span<const ivec3> emptied);

}  // namespace kiln::field
