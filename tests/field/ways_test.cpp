// SPDX-License-Identifier: MIT
// Reaches of free cells against a look at every cell of every cube, after changes of all kinds.
#include "field/ways.h"

#include <gtest/gtest.h>

#include <random>
#include <vector>

namespace kiln::field {
namespace {

struct Slow {
    ivec3 size;
    std::vector<uint32_t> words;  // 0: free

    uint32_t& at(int x, int y, int z) { return words[size_t((z * size.y + y) * size.x + x)]; }
    // The most k up to kWayReach whose cube of k + 1 is free; the cell is.
    int reach(ivec3 c, int octant) {
        for (int k = 1; k <= kWayReach; ++k) {
            for (int i = 0; i < (k + 1) * (k + 1) * (k + 1); ++i) {
                const auto axis = [&](int bit, int from, int step) {
                    return (octant & bit) != 0 ? from + step : from - step;
                };
                const int x = axis(1, c.x, i % (k + 1)), y = axis(2, c.y, i / (k + 1) % (k + 1)),
                          z = axis(4, c.z, i / ((k + 1) * (k + 1)));
                if (x < 0 || y < 0 || z < 0 || x >= size.x || y >= size.y || z >= size.z) continue;
                if (at(x, y, z) != 0) return k - 1;
            }
        }
        return kWayReach;
    }
};

void expect_same(const Ways& ways, Slow& slow) {
    for (int z = 0; z < slow.size.z; ++z) {
        for (int y = 0; y < slow.size.y; ++y) {
            for (int x = 0; x < slow.size.x; ++x) {
                uint32_t expected = slow.at(x, y, z);
                for (int octant = 0; expected == 0 && octant < 8; ++octant) {
                    const uint32_t found = ways.words()[(z * slow.size.y + y) * slow.size.x + x];
                    ASSERT_EQ(found & (kWaySolid | kWayInside), 0u) << x << " " << y << " " << z;
                    ASSERT_EQ(int(found >> way_shift(octant) & 7u), slow.reach({x, y, z}, octant))
                        << x << " " << y << " " << z << " octant " << octant;
                }
                if (expected != 0) {
                    ASSERT_EQ(ways.words()[(z * slow.size.y + y) * slow.size.x + x], expected)
                        << x << " " << y << " " << z;
                }
            }
        }
    }
}

class WaysOfSize : public testing::TestWithParam<ivec3> {};

TEST_P(WaysOfSize, ReachAsFarAsTheCubeIsFreeAfterEveryChange) {
    const ivec3 size = GetParam();
    std::mt19937 random(5);
    const auto up_to = [&](int n) { return int(random() % uint32_t(n)); };
    Ways ways(size);
    Slow slow{size, std::vector<uint32_t>(size_t(size.x * size.y * size.z))};
    expect_same(ways, slow);
    for (int round = 0; round < 6; ++round) {
        const int changes = round == 0 ? 8 : 3;
        for (int i = 0; i < changes; ++i) {
            const ivec3 c{up_to(size.x), up_to(size.y), up_to(size.z)};
            if (round > 0 && i == 0) {  // something goes again
                for (size_t k = 0; k < slow.words.size(); ++k) {
                    if (slow.words[k] == 0) continue;
                    const int at = int(k);
                    slow.words[k] = 0;
                    ways.set_free({at % size.x, at / size.x % size.y, at / (size.x * size.y)});
                    break;
                }
            }
            const uint32_t box = uint32_t(up_to(1 << 18));
            const bool solid = up_to(3) > 0;
            solid ? ways.set_solid(c, box) : ways.set_inside(c);
            slow.at(c.x, c.y, c.z) = solid ? kWaySolid | box : kWayInside;
        }
        ways.settle();
        expect_same(ways, slow);
    }
}

INSTANTIATE_TEST_SUITE_P(Sizes, WaysOfSize,
                         testing::Values(ivec3{9, 11, 10}, ivec3{130, 4, 5}, ivec3{64, 3, 3}, ivec3{1, 1, 1}));

}  // namespace
}  // namespace kiln::field
