// SPDX-License-Identifier: MIT
#include "field/jumps.h"
#include "worlds.h"

namespace kiln::field {
namespace {

struct Grid {
    ivec3 size;
    std::vector<uint32_t> cells;
    uint32_t& at(int x, int y, int z) { return cells[size_t((z * size.y + y) * size.x + x)]; }
};

Grid random_grid(uint32_t seed, ivec3 size, int occupied) {
    worlds::Random r(seed);
    Grid g{size, std::vector<uint32_t>(size_t(size.x * size.y * size.z), 0)};
    for (uint32_t& word : g.cells) word = r.below(2) == 0 ? 0u : kCellInside;
    for (int i = 0; i < occupied; ++i)
        g.at(r.below(size.x), r.below(size.y), r.below(size.z)) = kCellOccupied | uint32_t(i);
    return g;
}

int brute_jump(Grid& g, int x, int y, int z) {
    int best = kMaxJump;
    for (int c = 0; c < g.size.z; ++c) {
        for (int b = 0; b < g.size.y; ++b) {
            for (int a = 0; a < g.size.x; ++a) {
                if ((g.at(a, b, c) & kCellOccupied) == 0) continue;
                best = std::min(best, std::max({std::abs(a - x), std::abs(b - y), std::abs(c - z)}));
            }
        }
    }
    return best;
}

TEST(Jumps, AreTheChebyshevDistanceToTheNearestBrick) {
    for (const int occupied : {0, 1, 3, 40}) {
        Grid g = random_grid(uint32_t(occupied), {17, 12, 23}, occupied);
        const Grid before = g;
        update_jumps(g.cells, g.size, {{0, 0, 0}, g.size}, 2);
        for (int z = 0; z < g.size.z; ++z) {
            for (int y = 0; y < g.size.y; ++y) {
                for (int x = 0; x < g.size.x; ++x) {
                    const uint32_t old = before.cells[size_t((z * g.size.y + y) * g.size.x + x)];
                    if ((old & kCellOccupied) != 0) {
                        ASSERT_EQ(g.at(x, y, z), old) << "an occupied cell's word changed";
                    } else {
                        ASSERT_EQ(g.at(x, y, z), (old & kCellInside) | uint32_t(brute_jump(g, x, y, z)))
                            << x << " " << y << " " << z;
                    }
                }
            }
        }
    }
}

TEST(Jumps, ChangeOnlyWithinSevenCellsOfAChange) {
    worlds::Random r(5);
    Grid g = random_grid(5, {25, 25, 25}, 30);
    update_jumps(g.cells, g.size, {{0, 0, 0}, g.size}, 1);
    for (int i = 0; i < 40; ++i) {
        const int x = r.below(25), y = r.below(25), z = r.below(25);
        uint32_t& word = g.at(x, y, z);
        word = (word & kCellOccupied) != 0 ? 0u : kCellOccupied | 99u;
        update_jumps(g.cells, g.size, grown({{x, y, z}, {x + 1, y + 1, z + 1}}, kMaxJump, g.size), 1);
        Grid whole = g;
        update_jumps(whole.cells, whole.size, {{0, 0, 0}, whole.size}, 3);
        ASSERT_EQ(g.cells, whole.cells) << "change " << i;
    }
}

}  // namespace
}  // namespace kiln::field
