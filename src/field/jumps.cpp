// SPDX-License-Identifier: MIT
// Occupancy as one bit a cell: cells within k of a brick are the occupied ones dilated k times by one cell, an axis at a time, 64 cells an
// operation. D(k), the k-th dilation, holds D(k - 1): a cell's jump is the number of k in 0 … 6 whose D(k) does not have it.

#include "field/jumps.h"

#include "field/cell_rows.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <vector>

namespace kiln::field {
namespace {

constexpr int kReach = kMaxJump - 1;  // from further away a brick changes no jump
static_assert(kReach == 6);

// Rows of cells, [y0, y1) x [z0, z1).
struct Rows {
    int y0, y1, z0, z1;
};

// Bits of a box of cells; rows along x begin at multiples of kCellPage, so that a page's row of cells is one byte. Around them is
// a border of one empty row.
struct BitBox {
    ivec3 size;
    size_t row_words, plane_words;
    std::vector<uint64_t> words;

    explicit BitBox(ivec3 s)
        : size(s),
          row_words((size_t(s.x) + 63) / 64),
          plane_words(row_words * (size_t(s.y) + 2)),
          words(plane_words * (size_t(s.z) + 2)) {}
    uint64_t* row(int y, int z) { return words.data() + size_t(z + 1) * plane_words + size_t(y + 1) * row_words; }
};

// The rows of `from` dilated by one cell, into `to`. Reads `from` one row further.
void dilate(BitBox& from, BitBox& by_x, BitBox& by_y, BitBox& to, const Rows& rows) {
    const size_t w = from.row_words, n = w * size_t(rows.y1 - rows.y0), plane = from.plane_words;
    for (int z = rows.z0 - 1; z <= rows.z1; ++z) {
        const uint64_t* const old = from.row(rows.y0 - 1, z);
        uint64_t* const mid = by_x.row(rows.y0 - 1, z);
        for (size_t i = 0; i < n + 2 * w; ++i) mid[i] = old[i] | old[i] << 1 | old[i] >> 1;
        for (size_t first = 0; w > 1 && first < n + 2 * w; first += w) {
            for (size_t i = first + 1; i < first + w; ++i) {
                mid[i] |= old[i - 1] >> 63;
                mid[i - 1] |= old[i] << 63;
            }
        }
        uint64_t* const near = by_y.row(rows.y0, z);
        for (size_t i = 0; i < n; ++i) near[i] = mid[i] | mid[i + w] | mid[i + 2 * w];
    }
    for (int z = rows.z0; z < rows.z1; ++z) {
        const uint64_t* const near = by_y.row(rows.y0, z);
        uint64_t* const out = to.row(rows.y0, z);
        for (size_t i = 0; i < n; ++i) out[i] = near[i - plane] | near[i] | near[i + plane];
    }
}

// The three bits of the jumps of some rows of a box.
class JumpBits {
public:
    JumpBits(const BitBox& box, const Rows& rows)
        : rows_(rows),
          row_words_(box.row_words),
          plane_words_(box.row_words * size_t(rows.y1 - rows.y0)),
          size_(plane_words_ * size_t(rows.z1 - rows.z0)),
          words_(3 * size_, ~uint64_t(0)) {}

    // D(k), for k from 0 to 6. A cell that j of them do not have is in all from D(j) on, so of j every one of those turns bit 0, of
    // D(1), D(3) and D(5) each turns bit 1, and D(3) turns bit 2: all begin as 7.
    void add(BitBox& dilated, int k) {
        for (int z = rows_.z0; z < rows_.z1; ++z) {
            const uint64_t* const near = dilated.row(rows_.y0, z);
            uint64_t* const bits = words_.data() + size_t(z - rows_.z0) * plane_words_;
            for (size_t i = 0; i < plane_words_; ++i) bits[i] ^= near[i];
            if (k % 2 == 0) continue;
            for (size_t i = 0; i < plane_words_; ++i) bits[size_ + i] ^= near[i];
            if (k != 3) continue;
            for (size_t i = 0; i < plane_words_; ++i) bits[2 * size_ + i] ^= near[i];
        }
    }
    // Of eight cells.
    uint8_t byte(int bit, int x8, int y, int z) const {
        const size_t at = size_t(z - rows_.z0) * plane_words_ + size_t(y - rows_.y0) * row_words_ + size_t(x8) / 8;
        return uint8_t(words_[size_t(bit) * size_ + at] >> (x8 % 8 * 8));
    }

private:
    Rows rows_;
    size_t row_words_, plane_words_, size_;
    std::vector<uint64_t> words_;
};

}  // namespace

CellBox grown(const CellBox& box, int by, ivec3 grid_size) {
    return {{std::max(box.min.x - by, 0), std::max(box.min.y - by, 0), std::max(box.min.z - by, 0)},
            {std::min(box.max.x + by, grid_size.x), std::min(box.max.y + by, grid_size.y),
             std::min(box.max.z + by, grid_size.z)}};
}

CellBox joined(const CellBox& a, const CellBox& b) {
    if (a.empty()) return b;
    if (b.empty()) return a;
    return {{std::min(a.min.x, b.min.x), std::min(a.min.y, b.min.y), std::min(a.min.z, b.min.z)},
            {std::max(a.max.x, b.max.x), std::max(a.max.y, b.max.y), std::max(a.max.z, b.max.z)}};
}

void update_jumps(CellMap& cells, const CellBox& box) {
    if (box.empty()) return;
    CellBox wide = cells.wraps()
                       ? CellBox{box.min - ivec3{kReach, kReach, kReach}, box.max + ivec3{kReach, kReach, kReach}}
                       : grown(box, kReach, cells.size());
    wide.min.x &= ~(kCellPage - 1);
    const ivec3 size = wide.max - wide.min;
    BitBox near(size), next(size), by_x(size), by_y(size);
    each_page(cells, wide, [&](size_t page, const CellBox& part) {
        const CellMap::Words::Page* const words = cells.words().find(page);
        if (words == nullptr) return;
        const int x8 = (part.min.x - wide.min.x) / kCellPage;
        for (int z = part.min.z; z < part.max.z; ++z) {
            for (int y = part.min.y; y < part.max.y; ++y) {
                near.row(y - wide.min.y, z - wide.min.z)[size_t(x8) / 8] |=
                    uint64_t(top_bits(words->data() + row_of(y, z))) << (x8 % 8 * 8);
            }
        }
    });
    const Rows rows{box.min.y - wide.min.y, box.max.y - wide.min.y, box.min.z - wide.min.z, box.max.z - wide.min.z};
    JumpBits jump(near, rows);
    jump.add(near, 0);
    for (int k = 1; k <= kReach; ++k) {
        const int by = kReach - k;  // the dilations to come read so much further
        dilate(near, by_x, by_y, next,
               {std::max(rows.y0 - by, 0), std::min(rows.y1 + by, size.y), std::max(rows.z0 - by, 0),
                std::min(rows.z1 + by, size.z)});
        std::swap(near, next);
        jump.add(near, k);
    }
    each_page(cells, box, [&](size_t page, const CellBox& part) {
        const CellMap::Words::Page* old = cells.words().find(page);
        const int cx = part.min.x & ~(kCellPage - 1), x8 = (cx - wide.min.x) / kCellPage;
        const Eight ours = Eight(kLanes >= uint32_t(part.min.x - cx)) & Eight(kLanes < uint32_t(part.max.x - cx));
        for (int z = part.min.z; z < part.max.z; ++z) {
            for (int y = part.min.y; y < part.max.y; ++y) {
                Eight had = Eight{} + uint32_t(kMaxJump);
                if (old != nullptr) std::memcpy(&had, old->data() + row_of(y, z), sizeof had);
                const int ly = y - wide.min.y, lz = z - wide.min.z;
                Eight low, middle, high;
                spread(jump.byte(0, x8, ly, lz), low);
                spread(jump.byte(1, x8, ly, lz), middle);
                spread(jump.byte(2, x8, ly, lz), high);
                const Eight found = low | middle << 1 | high << 2;
                // Zero where nothing changes: in occupied cells, and beyond the box.
                const Eight changes = (had ^ ((had & kCellInside) | found)) & ours & ((had >> 31) - 1);
                uint64_t halves[4];
                std::memcpy(halves, &changes, sizeof changes);
                if ((halves[0] | halves[1] | halves[2] | halves[3]) == 0) continue;
                CellMap::Words::Page& mine = cells.words().write_page(page);
                had ^= changes;
                std::memcpy(mine.data() + row_of(y, z), &had, sizeof had);
                old = &mine;
            }
        }
    });
}

// Jumps differ by at most one between neighbours. So a cell whose jump becomes k because of a new brick lies beside one whose jump becomes
// k - 1, and so on down to that brick; and where a jump was k because of a brick that is gone, the same holds of what was. Either way the
// wave of cells that change starts there, and is followed no further than it reaches, which in a crowd is a cell or two.
// Asks changes(cell, k) of the cells k steps from `from`, of those that lie beside one that it said yes of, or of `from`.
template <typename Fn>
static void follow(ivec3 size_of_grid, std::span<const ivec3> from, Fn&& changes) {
    CellBox all{};
    for (const ivec3 c : from) all = joined(all, {c, c + ivec3{1, 1, 1}});
    if (all.empty()) return;
    CellBox box = grown(all, kReach, size_of_grid);
    box.min.x &= ~(kCellPage - 1);
    const ivec3 size = box.max - box.min;
    BitBox front(size), near(size), by_x(size), by_y(size), seen(size);
    for (const ivec3 c : from) {
        const ivec3 at = c - box.min;
        const uint64_t bit = uint64_t(1) << (at.x % 64);
        front.row(at.y, at.z)[at.x / 64] |= bit;
        seen.row(at.y, at.z)[at.x / 64] |= bit;
    }
    bool any = true;
    for (uint32_t k = 1; k <= uint32_t(kReach) && any; ++k) {
        const CellBox wave = grown({all.min - box.min, all.max - box.min}, int(k), size);
        dilate(front, by_x, by_y, near, {wave.min.y, wave.max.y, wave.min.z, wave.max.z});
        any = false;
        for (int z = wave.min.z; z < wave.max.z; ++z) {
            for (int y = wave.min.y; y < wave.max.y; ++y) {
                for (size_t w = 0; w < near.row_words; ++w) {
                    uint64_t asked = near.row(y, z)[w] & ~seen.row(y, z)[w], yes = 0;
                    seen.row(y, z)[w] |= asked;
                    for (; asked != 0; asked &= asked - 1) {
                        const int bit = std::countr_zero(asked);
                        const ivec3 cell = box.min + ivec3{int(w) * 64 + bit, y, z};
                        if (cell.x >= box.max.x) break;
                        if (changes(cell, k)) yes |= uint64_t(1) << bit;
                    }
                    front.row(y, z)[w] = yes;
                    any = any || yes != 0;
                }
            }
        }
    }
}

void lower_jumps(CellMap& cells, std::span<const ivec3> occupied) {
    follow(cells.size(), occupied, [&](ivec3 c, uint32_t k) {
        const uint32_t word = cells.at(c.x, c.y, c.z);
        if ((word & kCellOccupied) != 0 || (word & uint32_t(kMaxJump)) <= k) return false;
        cells.set(c.x, c.y, c.z, (word & kCellInside) | k);
        return true;
    });
}

void raise_jumps(CellMap& cells, std::span<const ivec3> emptied) {
    CellBox changed{};
    for (const ivec3 c : emptied) changed = joined(changed, {c, c + ivec3{1, 1, 1}});
    follow(cells.size(), emptied, [&](ivec3 c, uint32_t k) {
        const uint32_t word = cells.at(c.x, c.y, c.z);
        if ((word & kCellOccupied) != 0 || (word & uint32_t(kMaxJump)) != k) return false;
        changed = joined(changed, {c, c + ivec3{1, 1, 1}});
        return true;
    });
    update_jumps(cells, changed);
}

}  // namespace kiln::field
