// SPDX-License-Identifier: MIT
// What a ray asks of a cell, a word each: whether to enter its brick, and where in it solid may be; else how far it may go on. Cells are
// free where nothing can be hit: empty air, and bricks without a solid texel. A ray goes one way along each axis, so a free cell knows for
// each of the eight octants of directions how many cells on that side are free with it: twice as many as on all sides.
#pragma once

#include "field/jumps.h"

#include <cstdint>
#include <vector>

namespace kiln::field {

/// Of a word: a brick with some solid texel, whose solid box (solid.h) the low 18 bits are; or empty, in solid; else three bits an octant.
inline constexpr uint32_t kWaySolid = 1u << 31;
inline constexpr uint32_t kWayInside = 1u << 30;
inline constexpr int kWayReach = 7;
/// Of an octant, 1 for directions up x, 2 for up y, 4 for up z: the cube of `reach + 1` cells a side that begins at the cell and lies on that
/// side of it is free. What is beyond the grid is free too.
inline constexpr int way_shift(int octant) { return 3 * octant; }
inline constexpr uint32_t kWayFree = 0x00ffffff;

class Ways {
public:
    Ways() = default;
    /// All free.
    explicit Ways(ivec3 size);

    /// A brick with that solid box; empty and in solid; free.
    void set_solid(ivec3 cell, uint32_t box) { block(cell, kWaySolid | box); }
    void set_inside(ivec3 cell) { block(cell, kWayInside); }
    void set_free(ivec3 cell);
    /// After these: finds the reaches that they changed.
    void settle();

    /// By (z * size.y + y) * size.x + x.
    const uint32_t* words() const { return words_.data(); }

private:
    size_t index(ivec3 c) const {
        return (size_t(c.z) * size_t(size_.y) + size_t(c.y)) * size_t(size_.x) + size_t(c.x);
    }
    uint64_t& blocked_word(ivec3 c) {
        return blocked_[(size_t(c.z) * size_t(size_.y) + size_t(c.y)) * row_words_ + size_t(c.x) / 64 + 1];
    }
    uint64_t blocked_from(int x, int y, int z) const;
    void block(ivec3 cell, uint32_t word);
    void settle_octant(int octant, const CellBox& box);

    ivec3 size_;
    size_t row_words_ = 0;           // of blocked_; the first and the last two of a row are beyond the grid
    std::vector<uint64_t> blocked_;  // a bit a cell, rows along x
    std::vector<uint32_t> words_;
    CellBox changed_{};
};

}  // namespace kiln::field
