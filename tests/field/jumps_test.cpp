// SPDX-License-Identifier: MIT
#include "field/jumps.h"
#include "worlds.h"

namespace kiln::field {
namespace {

struct Grid {
    ivec3 size;
    CellMap cells;
    uint32_t at(int x, int y, int z) const { return cells.at(x, y, z); }
};

Grid random_grid(uint32_t seed, ivec3 size, int occupied) {
    worlds::Random r(seed);
    Grid g{size, CellMap(size)};
    for (int z = 0; z < size.z; ++z) {
        for (int y = 0; y < size.y; ++y) {
            for (int x = 0; x < size.x; ++x) g.cells.set(x, y, z, r.below(2) == 0 ? 0u : kCellInside);
        }
    }
    for (int i = 0; i < occupied; ++i)
        g.cells.set(r.below(size.x), r.below(size.y), r.below(size.z), kCellOccupied | uint32_t(i));
    return g;
}

std::vector<ivec3> occupied_cells(const Grid& g) {
    std::vector<ivec3> out;
    for (int z = 0; z < g.size.z; ++z) {
        for (int y = 0; y < g.size.y; ++y) {
            for (int x = 0; x < g.size.x; ++x) {
                if ((g.at(x, y, z) & kCellOccupied) != 0) out.push_back({x, y, z});
            }
        }
    }
    return out;
}

int brute_jump(const std::vector<ivec3>& occupied, int x, int y, int z) {
    int best = kMaxJump;
    for (const ivec3 c : occupied)
        best = std::min(best, std::max({std::abs(c.x - x), std::abs(c.y - y), std::abs(c.z - z)}));
    return best;
}

TEST(Jumps, AreTheChebyshevDistanceToTheNearestBrick) {
    for (const int occupied : {0, 1, 3, 40}) {
        Grid g = random_grid(uint32_t(occupied), {occupied == 3 ? 83 : 17, 12, 23}, occupied);
        if (occupied == 3) {  // near the 64th cell of a row, from both sides
            g.cells.set(62, 2, 3, kCellOccupied | 90u);
            g.cells.set(66, 9, 19, kCellOccupied | 91u);
        }
        const Grid before = g;
        update_jumps(g.cells, {{0, 0, 0}, g.size});
        const std::vector<ivec3> bricks = occupied_cells(before);
        for (int z = 0; z < g.size.z; ++z) {
            for (int y = 0; y < g.size.y; ++y) {
                for (int x = 0; x < g.size.x; ++x) {
                    const uint32_t old = before.at(x, y, z);
                    if ((old & kCellOccupied) != 0) {
                        ASSERT_EQ(g.at(x, y, z), old) << "an occupied cell's word changed";
                    } else {
                        ASSERT_EQ(g.at(x, y, z), (old & kCellInside) | uint32_t(brute_jump(bricks, x, y, z)))
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
    update_jumps(g.cells, {{0, 0, 0}, g.size});
    for (int i = 0; i < 12; ++i) {
        const int x = r.below(25), y = r.below(25), z = r.below(25);
        g.cells.set(x, y, z, (g.at(x, y, z) & kCellOccupied) != 0 ? 0u : kCellOccupied | 99u);
        update_jumps(g.cells, grown({{x, y, z}, {x + 1, y + 1, z + 1}}, kMaxJump - 1, g.size));
        const std::vector<ivec3> bricks = occupied_cells(g);
        for (int c = 0; c < g.size.z; ++c) {
            for (int b = 0; b < g.size.y; ++b) {
                for (int a = 0; a < g.size.x; ++a) {
                    if ((g.at(a, b, c) & kCellOccupied) != 0) continue;
                    ASSERT_EQ(int(g.at(a, b, c) & 7u), brute_jump(bricks, a, b, c)) << "change " << i;
                }
            }
        }
    }
}

TEST(Jumps, FollowedFromWhatCameAndWentAreThoseOfAllCells) {
    worlds::Random r(7);
    for (const int occupied : {0, 2, 40, 900}) {
        Grid g = random_grid(uint32_t(occupied) + 9, {83, 19, 26}, occupied);
        update_jumps(g.cells, {{0, 0, 0}, g.size});
        for (int turn = 0; turn < 12; ++turn) {
            std::vector<ivec3> came, went;
            ivec3 around{r.below(83), r.below(19), r.below(26)};
            for (int i = 0; i < 1 + turn * turn; ++i) {
                if (turn == 7) around.x = i % 2 * 75;  // further apart than a word has bits
                const ivec3 c{std::min(around.x + r.below(4 + 5 * (turn % 3)), 82), std::min(around.y + r.below(4), 18),
                              std::min(around.z + r.below(4), 25)};
                const bool there = (g.at(c.x, c.y, c.z) & kCellOccupied) != 0;
                if (there && turn % 4 != 0) {
                    g.cells.set(c.x, c.y, c.z, kCellInside | uint32_t(r.below(8)));
                    went.push_back(c);
                } else if (!there && turn % 4 != 1 && std::find(went.begin(), went.end(), c) == went.end()) {
                    came.push_back(c);
                }
            }
            raise_jumps(g.cells, went);
            for (const ivec3 c : came) g.cells.set(c.x, c.y, c.z, kCellOccupied | 7u);
            Grid all = g;
            update_jumps(all.cells, {{0, 0, 0}, all.size});
            lower_jumps(g.cells, came);
            for (int z = 0; z < 26; ++z) {
                for (int y = 0; y < 19; ++y) {
                    for (int x = 0; x < 83; ++x)
                        ASSERT_EQ(g.at(x, y, z), all.at(x, y, z))
                            << occupied << " turn " << turn << ": " << x << " " << y << " " << z;
                }
            }
        }
    }
}

}  // namespace
}  // namespace kiln::field
