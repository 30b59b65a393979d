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

static_assert(kJumpReach == 6);

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
    CellBox wide = cells.wraps() ? CellBox{box.min - ivec3{kJumpReach, kJumpReach, kJumpReach},
                                           box.max + ivec3{kJumpReach, kJumpReach, kJumpReach}}
                                 : grown(box, kJumpReach, cells.size());
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
                    uint64_t(bits_of(words->data() + row_of(y, z), 31)) << (x8 % 8 * 8);
            }
        }
    });
    const Rows rows{box.min.y - wide.min.y, box.max.y - wide.min.y, box.min.z - wide.min.z, box.max.z - wide.min.z};
    JumpBits jump(near, rows);
    jump.add(near, 0);
    for (int k = 1; k <= kJumpReach; ++k) {
        const int by = kJumpReach - k;  // the dilations to come read so much further
        dilate(near, by_x, by_y, next,
               {std::max(rows.y0 - by, 0), std::min(rows.y1 + by, size.y), std::max(rows.z0 - by, 0),
                std::min(rows.z1 + by, size.z)});
        std::swap(near, next);
        jump.add(near, k);
    }
    rewrite(cells, box, [&](const Eight& had, Eight& changes, const CellBox& part, int y, int z) {
        const int cx = first_of_row(part.min.x), x8 = (cx - wide.min.x) / kCellPage;
        const int ly = y - wide.min.y, lz = z - wide.min.z;
        const Eight ours = Eight(kLanes >= uint32_t(part.min.x - cx)) & Eight(kLanes < uint32_t(part.max.x - cx));
        Eight low, middle, high;
        spread(jump.byte(0, x8, ly, lz), low);
        spread(jump.byte(1, x8, ly, lz), middle);
        spread(jump.byte(2, x8, ly, lz), high);
        const Eight found = low | middle << 1 | high << 2;
        // Zero where nothing changes: in occupied cells, and beyond the box.
        changes = (had ^ ((had & kCellInside) | found)) & ours & ((had >> 31) - 1);
    });
}

namespace {

// Jumps differ by at most one between neighbours. So a cell whose jump becomes k because of a new brick lies beside one whose jump becomes
// k - 1, and so on down to that brick; and where a jump was k because of a brick that is gone, the same holds of what was. Either way the
// wave of cells that change starts there, and is followed no further than it reaches, which in a crowd is a cell or two: a window
// that shows so far is tried first, and three more cells where jumps rise, which reach further and are told by what lies around.
constexpr int kFewCells = 2, kAllCells = kJumpReach + 1;

// The jumps around some cells, a bit a cell and a word a row. Beyond the window's sides lie rows of nothing.
class Window {
public:
    // Of at most 64 cells along x.
    static bool fits(const CellMap& cells, const CellBox& around, int reach) {
        const CellBox box = box_of(cells, around, reach);
        return box.max.x - box.min.x <= 64;
    }
    Window(CellMap& cells, const CellBox& around, int reach, std::vector<uint64_t>& words)
        : cells_(cells),
          box_(box_of(cells, around, reach)),
          size_(box_.max - box_.min),
          around_(around),
          reach_(reach),
          words_(words) {
        const size_t rows = size_t(size_.y + 2) * size_t(size_.z + 2);
        words_.resize(std::max(words_.size(), kPlanes * rows));
        std::fill_n(words_.begin(), kMade * rows, uint64_t(0));
        for (size_t i = 0; i < kPlanes; ++i) plane_[i] = words_.data() + i * rows;
        load();
    }

    // The cells are occupied now. Whether the window shows all that changes by it; only then it is done.
    bool lower(std::span<const ivec3> occupied) {
        mark(occupied);
        const bool whole = follow([&](size_t row, uint32_t k) { return above(row, k); },
                                  [&](size_t row, uint32_t k, uint64_t cells) { give(row, cells, k); });
        if (whole) write();
        return whole;
    }
    // The same of cells that are empty now.
    bool raise(std::span<const ivec3> emptied) {
        mark(emptied);
        if (!follow([&](size_t row, uint32_t k) { return equal(row, k); }, [](size_t, uint32_t, uint64_t) {}))
            return false;
        // What the wave met is told by what is around it: one more than the least jump beside it.
        std::copy_n(plane_[kOccupied], plane_[kJump] - plane_[kOccupied], plane_[kFront]);
        for (uint32_t k = 1; k <= uint32_t(kMaxJump); ++k) {
            const Rows rows = rows_of(reached_);
            if (k < uint32_t(kMaxJump)) dilate(rows);
            uint64_t left = 0;
            each_row(rows, [&](size_t row) {
                const uint64_t open = plane_[kSeen][row] & ~plane_[kGiven][row];
                const uint64_t near = k < uint32_t(kMaxJump) ? open & plane_[kNear][row] : open;
                give(row, near, k);
                left |= open & ~near;
            });
            if (left == 0) break;
            each_row(rows_of(reached_ + 1), [&](size_t row) {
                plane_[kFront][row] |= plane_[kGiven][row] | (equal(row, k) & ~plane_[kSeen][row]);
            });
        }
        write();
        return true;
    }

private:
    // Jumps are three bits, those that were and those that will be; of occupied cells they are 0.
    enum Plane {
        kOccupied,
        kJump,
        kNew = kJump + 3,
        kGiven = kNew + 3,
        kSeen,
        kFront,
        kMade,  // from here on, planes are written before they are read
        kNear = kMade,
        kAlong,
        kAcross,
        kPlanes
    };

    static CellBox box_of(const CellMap& cells, const CellBox& around, int reach) {
        CellBox box = grown(around, reach, cells.size());
        box.min.x &= ~(kCellPage - 1);
        return box;
    }
    size_t row_at(int y, int z) const { return size_t(z + 1) * size_t(size_.y + 2) + size_t(y + 1); }
    Rows rows_of(int by) const {
        const CellBox rows = grown({around_.min - box_.min, around_.max - box_.min}, by, size_);
        return {rows.min.y, rows.max.y, rows.min.z, rows.max.z};
    }
    template <typename Fn>
    void each_row(const Rows& rows, Fn&& fn) const {
        for (int z = rows.z0; z < rows.z1; ++z) {
            for (size_t row = row_at(rows.y0, z), last = row_at(rows.y1, z); row < last; ++row) fn(row);
        }
    }

    void load() {
        each_page(cells_, box_, [&](size_t page, const CellBox& part) {
            const CellMap::Words::Page* const words = cells_.words().find(page);
            const int x8 = (part.min.x - box_.min.x) & ~(kCellPage - 1);
            const uint64_t ours = (~uint64_t(0) >> (64 - (part.max.x - part.min.x))) << (part.min.x - box_.min.x);
            for (int z = part.min.z; z < part.max.z; ++z) {
                for (int y = part.min.y; y < part.max.y; ++y) {
                    const size_t row = row_at(y - box_.min.y, z - box_.min.z);
                    if (words == nullptr) {
                        for (size_t i = kJump; i < kJump + 3; ++i) plane_[i][row] |= ours;
                        continue;
                    }
                    const RowBits bits = row_bits(words->data() + row_of(y, z));
                    plane_[kOccupied][row] |= uint64_t(bits.occupied) << x8 & ours;
                    for (size_t i = 0; i < 3; ++i) plane_[kJump + i][row] |= uint64_t(bits.jump[i]) << x8 & ours;
                }
            }
        });
    }
    void mark(std::span<const ivec3> from) {
        for (const ivec3 c : from) {
            const ivec3 at = c - box_.min;
            const size_t row = row_at(at.y, at.z);
            plane_[kFront][row] |= uint64_t(1) << at.x;
            plane_[kSeen][row] |= uint64_t(1) << at.x;
        }
    }

    // The cells whose jump is k, or more.
    uint64_t equal(size_t row, uint32_t k) const {
        uint64_t out = ~uint64_t(0);
        for (size_t i = 0; i < 3; ++i) out &= (k >> i & 1u) != 0 ? plane_[kJump + i][row] : ~plane_[kJump + i][row];
        return out;
    }
    uint64_t above(size_t row, uint32_t k) const {
        uint64_t out = 0, even = ~uint64_t(0);  // from the highest bit down: above, and equal so far
        for (size_t i = 3; i-- > 0;) {
            const uint64_t bit = plane_[kJump + i][row];
            if ((k >> i & 1u) == 0) out |= even & bit;
            even &= (k >> i & 1u) != 0 ? bit : ~bit;
        }
        return out;
    }
    void give(size_t row, uint64_t cells, uint32_t k) {
        plane_[kGiven][row] |= cells;
        for (size_t i = 0; i < 3; ++i) plane_[kNew + i][row] |= (k >> i & 1u) != 0 ? cells : 0;
    }

    // Asks changes(row, k) for the cells k steps from the marked ones, of those beside one that it said yes of, and takes them.
    template <typename Changes, typename Take>
    bool follow(Changes&& changes, Take&& take) {
        uint64_t any = 1;
        reached_ = 0;
        for (uint32_t k = 1; k <= uint32_t(kJumpReach) && any != 0; ++k) {
            const Rows rows = rows_of(int(k));
            dilate(rows);
            any = 0;
            each_row(rows, [&](size_t row) {
                const uint64_t yes = plane_[kNear][row] & ~plane_[kSeen][row] & changes(row, k);
                plane_[kFront][row] = yes;
                plane_[kSeen][row] |= yes;
                take(row, k, yes);
                any |= yes;
            });
            if (any == 0) break;
            reached_ = int(k);
            if (reached_ == reach_) return false;
        }
        return true;
    }
    // The front dilated by one cell, in these rows.
    void dilate(const Rows& rows) {
        for (int z = rows.z0 - 1; z <= rows.z1; ++z) {
            const uint64_t* const front = plane_[kFront];
            uint64_t *const along = plane_[kAlong], *const across = plane_[kAcross];
            const size_t first = row_at(rows.y0, z), last = row_at(rows.y1, z);
            for (size_t row = first - 1; row <= last; ++row)
                along[row] = front[row] | front[row] << 1 | front[row] >> 1;
            for (size_t row = first; row < last; ++row) across[row] = along[row - 1] | along[row] | along[row + 1];
        }
        const size_t plane = size_t(size_.y + 2);
        each_row(rows, [&](size_t row) {
            plane_[kNear][row] = plane_[kAcross][row - plane] | plane_[kAcross][row] | plane_[kAcross][row + plane];
        });
    }

    void write() {
        const Rows rows = rows_of(reached_);
        for (int z = rows.z0; z < rows.z1; ++z) {
            for (int y = rows.y0; y < rows.y1; ++y) {
                const size_t row = row_at(y, z);
                uint64_t other = 0;
                for (size_t i = 0; i < 3; ++i) other |= plane_[kJump + i][row] ^ plane_[kNew + i][row];
                for (uint64_t left = other & plane_[kGiven][row]; left != 0; left &= left - 1) {
                    const int x = std::countr_zero(left);
                    uint32_t jump = 0;
                    for (size_t i = 0; i < 3; ++i) jump |= uint32_t(plane_[kNew + i][row] >> x & 1u) << i;
                    const ivec3 c = box_.min + ivec3{x, y, z};
                    cells_.set(c.x, c.y, c.z, (cells_.at(c.x, c.y, c.z) & kCellInside) | jump);
                }
            }
        }
    }

    CellMap& cells_;
    const CellBox box_;
    const ivec3 size_;
    const CellBox around_;
    const int reach_;
    int reached_ = 0;
    std::vector<uint64_t>& words_;
    uint64_t* plane_[kPlanes];
};

template <typename Change>
void change(CellMap& cells, std::span<const ivec3> of, int few, Change&& in_window) {
    CellBox all{};
    for (const ivec3 c : of) all = joined(all, {c, c + ivec3{1, 1, 1}});
    if (all.empty()) return;
    for (const int reach : {few, kAllCells}) {
        if (!Window::fits(cells, all, reach)) break;
        static thread_local std::vector<uint64_t> words;
        Window window(cells, all, reach, words);
        if (in_window(window)) return;
    }
    update_jumps(cells, grown(all, kJumpReach, cells.size()));
}

}  // namespace

void lower_jumps(CellMap& cells, std::span<const ivec3> occupied) {
    change(cells, occupied, kFewCells, [&](Window& window) { return window.lower(occupied); });
}

void raise_jumps(CellMap& cells, std::span<const ivec3> emptied) {
    change(cells, emptied, kFewCells + 3, [&](Window& window) { return window.raise(emptied); });
}

}  // namespace kiln::field
