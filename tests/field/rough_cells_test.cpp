// SPDX-License-Identifier: MIT
// Words of a torus after any changes: never wrong, and exact when they are settled.
#include "field/rough_cells.h"

#include "clipmaps.h"

#include <algorithm>
#include <vector>

namespace kiln::field {
namespace {

// A torus of words, and what each should say, found by looking at all neighbours again and again.
struct TorusMap {
    int n;
    CellMap cells;
    ivec3 first{};  // of the window

    explicit TorusMap(int side) : n(side), cells(CellMap::torus(side)) {}
    size_t at(int x, int y, int z) const {
        const int mask = n - 1;
        return size_t(((z & mask) * n + (y & mask)) * n + (x & mask));
    }
    CellBox window() const { return {first, first + all_of(n)}; }

    // Jumps on the torus, and marks within the window.
    std::vector<uint32_t> exact() const {
        std::vector<uint8_t> near(size_t(n) * size_t(n) * size_t(n)), missing(near.size()), next;
        std::vector<uint32_t> out(near.size());
        const auto each = [&](auto&& fn) {
            for (int z = 0; z < n; ++z)
                for (int y = 0; y < n; ++y)
                    for (int x = 0; x < n; ++x) fn(first + ivec3{x, y, z});
        };
        each([&](ivec3 c) {
            const uint32_t word = cells.at(c.x, c.y, c.z);
            const size_t i = at(c.x, c.y, c.z);
            near[i] = (word & kCellOccupied) != 0;
            missing[i] = word == kCellMissing;
            out[i] = near[i] != 0 ? word & ~(missing[i] != 0 ? 0u : kCellFades) : (word & kCellInside) | 7u;
        });
        // An axis at a time.
        const auto dilate = [&](std::vector<uint8_t>& bits, bool over_faces) {
            for (int axis = 0; axis < 3; ++axis) {
                next = bits;
                const ivec3 by{axis == 0, axis == 1, axis == 2};
                each([&](ivec3 c) {
                    for (const ivec3 beside : {c - by, c + by}) {
                        if (!over_faces && !contains(window(), beside)) continue;
                        next[at(c.x, c.y, c.z)] |= bits[at(beside.x, beside.y, beside.z)];
                    }
                });
                bits = next;
            }
        };
        for (uint32_t k = 1; k < 7; ++k) {
            dilate(near, true);
            each([&](ivec3 c) {
                const size_t i = at(c.x, c.y, c.z);
                if ((out[i] & kCellOccupied) == 0 && near[i] != 0 && (out[i] & 7u) == 7) out[i] = (out[i] & ~7u) | k;
            });
        }
        dilate(missing, false);
        each([&](ivec3 c) {
            const size_t i = at(c.x, c.y, c.z);
            if ((out[i] & kCellOccupied) != 0 && out[i] != kCellMissing && missing[i] != 0) out[i] |= kCellFades;
        });
        return out;
    }
    // Cells whose words are wrong, and those that are rough.
    std::pair<int, int> faults() const {
        const std::vector<uint32_t> want = exact();
        int wrong = 0, rough = 0;
        each_cell(window(), [&](ivec3 c) {
            const uint32_t word = cells.at(c.x, c.y, c.z), should = want[at(c.x, c.y, c.z)];
            const bool brick = (word & kCellOccupied) != 0;
            if (word == should) return;
            const bool fine = brick ? (word & ~kCellFades) == (should & ~kCellFades) && (word & kCellFades) != 0
                                    : (word & ~7u) == (should & ~7u) && (word & 7u) >= 1 && (word & 7u) < (should & 7u);
            ++(fine ? rough : wrong);
        });
        return {wrong, rough};
    }
};

class AnySide : public testing::TestWithParam<int> {};

TEST_P(AnySide, WordsAreNeverWrongAndExactWhenSettled) {
    const int n = GetParam();
    worlds::Random r{uint32_t(n)};
    TorusMap torus(n);
    RoughCells rough(n);
    const auto missing_cells = [&] {
        int out = 0;
        each_cell(torus.window(), [&](ivec3 c) { out += torus.cells.at(c.x, c.y, c.z) == kCellMissing; });
        return out;
    };
    const auto any_box = [&](int most) {
        const ivec3 size{1 + r.below(most), 1 + r.below(most), 1 + r.below(most)};
        const ivec3 at{r.below(n - size.x + 1), r.below(n - size.y + 1), r.below(n - size.z + 1)};
        return CellBox{torus.first + at, torus.first + at + size};
    };
    int were_rough = 0;
    const int rounds = n == 32 ? 24 : 3;
    for (int round = 0; round < rounds; ++round) {
        // The window goes on, as Clipmap::move() lets it; then boxes go missing, become bricks or air.
        const int by = 2 * r.below(round % 6 == 5 ? n / 2 : 3), axis = r.below(3);
        CellBox slab = torus.window();
        int ivec3::*const along = axis == 0 ? &ivec3::x : axis == 1 ? &ivec3::y : &ivec3::z;
        slab.min.*along += n;
        slab.max.*along += by;
        torus.first.*along += by;
        for (int i = 0; i < 5; ++i) {
            const CellBox box = i == 0 ? slab : any_box(i == 1 ? n : 9);
            if (box.empty()) continue;
            const int kind = i == 0 ? 0 : r.below(3);
            const bool beside_missing = missing_cells() != 0;
            if (kind == 0) {
                each_cell(box, [&](ivec3 c) { torus.cells.set(c.x, c.y, c.z, kCellMissing); });
                come_near(torus.cells, box, true);
            } else if (kind == 1) {
                each_cell(box, [&](ivec3 c) {
                    const uint32_t word = torus.cells.at(c.x, c.y, c.z);
                    if ((word & kCellOccupied) != 0 || r.below(3) == 0)
                        torus.cells.set(c.x, c.y, c.z, r.below(2) == 0 ? 1u : kCellInside | 1u);
                });
            } else {
                each_cell(box, [&](ivec3 c) {
                    torus.cells.set(c.x, c.y, c.z, kCellOccupied | (beside_missing ? kCellFades : 0u) | 5u);
                });
                come_near(torus.cells, box, false);
            }
            rough.add(box);
        }
        const auto [wrong, were] = torus.faults();
        ASSERT_EQ(wrong, 0) << "round " << round;
        were_rough += were;
        // In pieces; none makes anything wrong.
        for (int piece = 0; !rough.empty(); ++piece) {
            rough.settle_layer(torus.cells, torus.window(), missing_cells() != 0);
            ASSERT_LT(piece, n / 8);
            if (piece == 1) {
                ASSERT_EQ(torus.faults().first, 0) << "half settled, round " << round;
            }
        }
        ASSERT_EQ(torus.faults(), (std::pair{0, 0})) << "round " << round;
    }
    EXPECT_GT(were_rough, 1000);
}

INSTANTIATE_TEST_SUITE_P(RoughCells, AnySide, testing::Values(32, 64));
INSTANTIATE_TEST_SUITE_P(RoughCellsSlow, AnySide, testing::Values(128));

}  // namespace
}  // namespace kiln::field
