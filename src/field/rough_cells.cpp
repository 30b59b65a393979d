// SPDX-License-Identifier: MIT
// Marks are made as jumps are (jumps.cpp): missing cells as one bit a cell, dilated by one, an axis at a time, but never across the faces of the
// window, where cells are neighbours on the torus alone.

#include "field/rough_cells.h"

#include "field/cell_rows.h"

#include <algorithm>
#include <array>
#include <bit>

namespace kiln::field {
namespace {

constexpr int kWords = 2;  // of a row's bits: kMostLevelCells is 128
using Row = std::array<uint64_t, kWords>;
using Ints __attribute__((vector_size(32))) = int32_t;

constexpr Row operator|(const Row& a, const Row& b) { return {a[0] | b[0], a[1] | b[1]}; }

// Bits of pages that [first, last) of an axis meets, all of them where it is as long as the torus.
uint32_t pages_of(int first, int last, int side) {
    const int n = side / kCellPage;
    if (last - first >= side) return n == 32 ? ~0u : (1u << n) - 1;
    uint32_t out = 0;
    for (int page = first >> 3; page * kCellPage < last; ++page) out |= 1u << (page & (n - 1));
    return out;
}

// fn(first, last): runs of set bits.
template <typename Fn>
void each_run(uint32_t bits, Fn&& fn) {
    while (bits != 0) {
        const int first = std::countr_zero(bits), count = std::countr_one(bits >> first);
        fn(first, first + count);
        bits &= ~((count == 32 ? ~0u : (1u << count) - 1) << first);
    }
}

// Bit i becomes bit i + 1 of `n`, the last one the first.
Row turned(const Row& a, int n) {
    if (n == 128) return {a[0] << 1 | a[1] >> 63, a[1] << 1 | a[0] >> 63};
    if (n == 64) return {a[0] << 1 | a[0] >> 63, 0};
    return {(a[0] << 1 | a[0] >> (n - 1)) & ((uint64_t(1) << n) - 1), 0};
}
Row turned_back(const Row& a, int n) {
    if (n == 128) return {a[0] >> 1 | a[1] << 63, a[1] >> 1 | a[0] << 63};
    if (n == 64) return {a[0] >> 1 | a[0] << 63, 0};
    return {a[0] >> 1 | (a[0] & 1u) << (n - 1), 0};
}

// Of a torus of side n whose window begins at `seam`: cells with one that is missing among themselves and those around.
class MissingAround {
public:
    MissingAround(const CellMap& cells, const CellBox& box, ivec3 seam)
        : n_(cells.size().x),
          seam_(seam),
          box_(box),
          height_(box.max.y - box.min.y),
          rows_(size_t(height_ * (box.max.z - box.min.z))) {
        const std::vector<Row> missing = missing_rows(cells);
        std::vector<Row> wide(size_t(height_), Row{});
        for (int z = box.min.z - 1; z <= box.max.z; ++z) {
            const Row* const here = &missing[size_t((z - box.min.z + 1) * (height_ + 2))];
            for (int i = 0; i < height_; ++i) {
                const int y = (box.min.y + i) & (n_ - 1), next = (y + 1) & (n_ - 1);
                Row row = here[i + 1];
                if (y != seam.y) row = row | here[i];
                if (next != seam.y) row = row | here[i + 2];
                wide[size_t(i)] = along_x(row);
            }
            for (const int to : {z - 1, z, z + 1}) {
                if (to < box.min.z || to >= box.max.z) continue;
                if (to != z && (std::max(to, z) & (n_ - 1)) == seam.z) continue;
                for (int i = 0; i < height_; ++i) {
                    Row& row = rows_[size_t((to - box.min.z) * height_ + i)];
                    row = row | wide[size_t(i)];
                }
            }
        }
    }
    uint8_t eight(int x8, int y, int z) const {
        const Row& row = rows_[size_t((z - box_.min.z) * height_ + (y - box_.min.y))];
        return uint8_t(row[size_t(x8) / 8] >> (x8 % 8 * kCellPage));
    }

private:
    // Of the box and a cell more on each side, as far along x as that needs.
    std::vector<Row> missing_rows(const CellMap& cells) const {
        std::vector<Row> out(size_t((height_ + 2) * (box_.max.z - box_.min.z + 2)), Row{});
        CellBox wide{box_.min - ivec3{1, 1, 1}, box_.max + ivec3{1, 1, 1}};
        if (wide.max.x - wide.min.x > n_) wide.min.x = 0, wide.max.x = n_;
        each_page(cells, wide, [&](size_t page, const CellBox& part) {
            const CellMap::Words::Page* const words = cells.words().find(page);
            if (words == nullptr) return;
            const int x = part.min.x & (n_ - 1) & ~(kCellPage - 1);
            for (int z = part.min.z; z < part.max.z; ++z) {
                for (int y = part.min.y; y < part.max.y; ++y) {
                    Eight eight;
                    std::memcpy(&eight, words->data() + row_of(y, z), sizeof eight);
                    const Eight same = Eight(eight == kCellMissing);
                    uint32_t lanes[8];
                    std::memcpy(lanes, &same, sizeof lanes);
                    out[size_t((z - wide.min.z) * (height_ + 2) + (y - wide.min.y))][size_t(x) / 64] |=
                        uint64_t(bits_of(lanes, 31)) << (x % 64);
                }
            }
        });
        return out;
    }
    Row along_x(const Row& a) const {
        Row low = turned(a, n_), high = turned_back(a, n_);  // from the neighbour below, and above
        const int first = seam_.x, last = (seam_.x - 1) & (n_ - 1);
        low[size_t(first) / 64] &= ~(uint64_t(1) << (first % 64));
        high[size_t(last) / 64] &= ~(uint64_t(1) << (last % 64));
        return a | low | high;
    }

    int n_;
    ivec3 seam_;
    CellBox box_;
    int height_;
    std::vector<Row> rows_;
};

// Ones in the lanes that hold bricks.
void bricks_of(const Eight& words, Eight& out) { out = ~((words >> 31) - 1) & Eight(words != kCellMissing); }

void settle_marks(CellMap& cells, const CellBox& box, const CellBox& window, bool any_missing) {
    const int mask = cells.size().x - 1;
    if (!any_missing) {
        rewrite(cells, box, [](const Eight& had, Eight& changes, const CellBox&, int, int) {
            bricks_of(had, changes);
            changes &= had & kCellFades;
        });
        return;
    }
    const MissingAround around(cells, box, {window.min.x & mask, window.min.y & mask, window.min.z & mask});
    rewrite(cells, box, [&](const Eight& had, Eight& changes, const CellBox& part, int y, int z) {
        Eight beside;
        spread(around.eight(first_of_row(part.min.x) / kCellPage, y, z), beside);
        bricks_of(had, changes);
        changes &= (had ^ beside << std::countr_zero(kCellFades)) & kCellFades;
    });
}

}  // namespace

void come_near(CellMap& cells, const CellBox& box, bool missing) {
    // What is beyond the box by so much or less; no further than round the torus to its other side.
    const auto by = [&](int low, int high) { return std::min(kJumpReach, std::max(cells.size().x - (high - low), 0)); };
    const ivec3 more{by(box.min.x, box.max.x), by(box.min.y, box.max.y), by(box.min.z, box.max.z)};
    const auto past = [](int at, int first, int last) { return std::max({first - at, at - (last - 1), 0}); };
    const auto lower = [&](const Eight& had, Eight& changes, const CellBox& part, int y, int z) {
        const int off = std::max({past(y, box.min.y, box.max.y), past(z, box.min.z, box.max.z), 1});
        const Ints at = Ints(kLanes) + first_of_row(part.min.x), below = box.min.x - at, above = at - (box.max.x - 1);
        const Ints by_x = below > above ? below : above;
        const Eight away = Eight(by_x > off ? by_x : Ints{} + off);
        const Eight jump = had & uint32_t(kMaxJump);
        const Eight empty = (had >> 31) - 1;
        if (missing && off == 1) {
            bricks_of(had, changes);
            changes &= ~had & kCellFades & Eight(away == 1);
        }
        changes |= (jump ^ away) & Eight(away < jump) & empty;
    };
    CellBox done = box;
    for (int ivec3::*const axis : {&ivec3::x, &ivec3::y, &ivec3::z}) {
        CellBox low = done, high = done;
        low.max.*axis = done.min.*axis;
        high.min.*axis = done.max.*axis;
        done.min.*axis = low.min.*axis -= more.*axis;
        done.max.*axis = high.max.*axis += more.*axis;
        rewrite(cells, low, lower);
        rewrite(cells, high, lower);
    }
}

void RoughCells::add(const CellBox& box) {
    if (box.empty()) return;
    const int side = int(layers_.size()) * kCellPage;
    const uint32_t x = pages_of(box.min.x - kJumpReach, box.max.x + kJumpReach, side);
    const uint32_t y = pages_of(box.min.y - kJumpReach, box.max.y + kJumpReach, side);
    each_run(pages_of(box.min.z - kJumpReach, box.max.z + kJumpReach, side), [&](int first, int last) {
        for (int z = first; z < last; ++z) {
            Layer& layer = layers_[size_t(z)];
            count_ += layer.y_pages == 0;
            layer.y_pages |= y;
            layer.x_pages |= x;
        }
    });
}

void RoughCells::settle_layer(CellMap& cells, const CellBox& window, bool any_missing) {
    while (layers_[size_t(next_)].y_pages == 0) next_ = (next_ + 1) % int(layers_.size());
    const Layer layer = layers_[size_t(next_)];
    each_run(layer.y_pages, [&](int y_first, int y_last) {
        each_run(layer.x_pages, [&](int x_first, int x_last) {
            const CellBox box{{x_first * kCellPage, y_first * kCellPage, next_ * kCellPage},
                              {x_last * kCellPage, y_last * kCellPage, (next_ + 1) * kCellPage}};
            update_jumps(cells, box);
            settle_marks(cells, box, window, any_missing);
        });
    });
    layers_[size_t(next_)] = {};
    --count_;
}

}  // namespace kiln::field
