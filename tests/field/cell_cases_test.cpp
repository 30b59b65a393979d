// SPDX-License-Identifier: MIT
#include "field/cell_cases.h"

#include <gtest/gtest.h>

#include <array>
#include <set>
#include <utility>
#include <vector>

namespace kiln::field {
namespace {

using Segment = std::pair<int, int>;

bool on_face(int edge, int face) {
    const int axis = edge / 4, u = axis == 0 ? 1 : 0, v = axis == 2 ? 1 : 2;
    return (face / 2 == u && (edge & 1) == (face & 1)) || (face / 2 == v && (edge >> 1 & 1) == (face & 1));
}

// The same edge seen from the voxel on the other side of a face.
int across(int edge, int face) {
    const int axis = edge / 4, u = axis == 0 ? 1 : 0;
    return edge ^ (face / 2 == u ? 1 : 2);
}

// Its corners.
std::pair<int, int> ends_of(int edge) {
    const int axis = edge / 4, u = axis == 0 ? 1 : 0, v = axis == 2 ? 1 : 2;
    const int a = (edge & 1) << u | (edge >> 1 & 1) << v;
    return {a, a | 1 << axis};
}

std::set<Segment> segments_on(const CellLoops& loops, int face) {
    std::set<Segment> out;
    for (int loop = 0; loop < loops.count; ++loop) {
        const int first = loops.first[loop], end = loops.first[loop + 1];
        for (int i = first; i < end; ++i) {
            const int a = loops.edges[i], b = loops.edges[i + 1 == end ? first : i + 1];
            if (on_face(a, face) && on_face(b, face)) out.emplace(a, b);
        }
    }
    return out;
}

TEST(CellCases, EveryPairOfVoxelsDrawsTheSameSegmentsOnItsCommonFace) {
    int pairs = 0;
    for (int axis = 0; axis < 3; ++axis) {
        const int high = 2 * axis + 1, low = 2 * axis;
        std::vector<uint32_t> corners_high, corners_low;
        for (uint32_t c = 0; c < 8; ++c) (c >> axis & 1u ? corners_high : corners_low).push_back(c);
        for (uint32_t a = 0; a < 256; ++a) {
            for (uint32_t b = 0; b < 256; ++b) {
                bool fit = true;
                for (size_t i = 0; i < 4; ++i) fit = fit && (a >> corners_high[i] & 1u) == (b >> corners_low[i] & 1u);
                if (!fit) continue;
                ++pairs;
                std::set<Segment> other;  // the neighbour walks them the other way
                for (const auto& [from, to] : segments_on(cell_loops(b), low))
                    other.emplace(across(to, low), across(from, low));
                EXPECT_EQ(segments_on(cell_loops(a), high), other)
                    << "signs " << a << " and " << b << " along axis " << axis;
            }
        }
    }
    EXPECT_EQ(pairs, 3 * 16 * 16 * 16);
}

TEST(CellCases, LoopsHoldEachCrossedEdgeOnceAndNoOther) {
    for (uint32_t solid = 0; solid < 256; ++solid) {
        const CellLoops loops = cell_loops(solid);
        std::multiset<int> seen(loops.edges, loops.edges + loops.first[loops.count]);
        for (int edge = 0; edge < 12; ++edge) {
            const auto [a, b] = ends_of(edge);
            EXPECT_EQ(seen.count(edge), (solid >> a & 1u) != (solid >> b & 1u) ? 1u : 0u) << solid << " edge " << edge;
        }
    }
}

// What the sharp mesher's proof needs: of each two loops, all crossings are on different sides of a plane, wherever on their edges they are.
TEST(CellCases, APlanePartsEveryTwoLoopsOfAVoxel) {
    const auto height = [](int corner, const std::array<int, 3>& n) {
        return n[0] * (corner & 1) + n[1] * (corner >> 1 & 1) + n[2] * (corner >> 2);
    };
    // All points inside the loop's edges are below `level` along n.
    const auto below = [&](const CellLoops& loops, int loop, const std::array<int, 3>& n, int level) {
        for (int i = loops.first[loop]; i < loops.first[loop + 1]; ++i) {
            const auto [a, b] = ends_of(loops.edges[i]);
            const int p = height(a, n), q = height(b, n);
            if (p > level || q > level || (p == level && q == level)) return false;
        }
        return true;
    };
    int pairs = 0;
    for (uint32_t solid = 0; solid < 256; ++solid) {
        const CellLoops loops = cell_loops(solid);
        for (int a = 0; a < loops.count; ++a) {
            for (int b = a + 1; b < loops.count; ++b) {
                bool parted = false;
                for (int i = 0; i < 27; ++i) {
                    const std::array<int, 3> n{i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1}, back{-n[0], -n[1], -n[2]};
                    for (int level = -3; level <= 3; ++level)
                        parted = parted || (below(loops, a, n, level) && below(loops, b, back, -level));
                }
                EXPECT_TRUE(parted) << solid << " loops " << a << " and " << b;
                ++pairs;
            }
        }
    }
    EXPECT_GT(pairs, 100);
}

TEST(CellCases, NoDiagonalLiesInAFace) {
    for (uint32_t solid = 0; solid < 256; ++solid) {
        const CellLoops loops = cell_loops(solid);
        const CellTriangles triangles = cell_triangles(loops);
        std::set<Segment> sides;
        for (int face = 0; face < 6; ++face) sides.merge(segments_on(loops, face));
        int corners = 0;
        for (int i = 0; i < 3 * triangles.count; ++i) {
            const int a = triangles.edges[i], b = triangles.edges[i % 3 == 2 ? i - 2 : i + 1];
            if (sides.erase({a, b}) == 1) continue;
            ++corners;
            for (int face = 0; face < 6; ++face) EXPECT_FALSE(on_face(a, face) && on_face(b, face)) << solid;
        }
        EXPECT_TRUE(sides.empty()) << solid;
        EXPECT_EQ(corners, 2 * (triangles.count - loops.count)) << solid << ": each diagonal has two triangles";
    }
}

TEST(CellCases, ALoneSolidCornerLooksOutwards) {
    const CellTriangles t = cell_triangles(cell_loops(1));
    ASSERT_EQ(t.count, 1);
    // Along x, along y, along z: anticlockwise as seen from (1, 1, 1).
    const std::array<uint8_t, 3> edges{t.edges[0], t.edges[1], t.edges[2]};
    EXPECT_EQ(edges, (std::array<uint8_t, 3>{0, 4, 8}));
}

}  // namespace
}  // namespace kiln::field
