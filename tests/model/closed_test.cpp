// SPDX-License-Identifier: MIT
#include "model/closed.h"

#include <gtest/gtest.h>

namespace kiln::model {
namespace {

// A tetrahedron whose faces have corners of their own, as files with hard edges have them.
struct Apart {
    std::vector<vec3> positions;
    std::vector<uint32_t> corners;
};

Apart tetrahedron() {
    const vec3 p[4] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, -0.0f, 1}};
    const int faces[4][3] = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
    Apart out;
    for (const auto& face : faces)
        for (const int corner : face) {
            out.corners.push_back(uint32_t(out.positions.size()));
            out.positions.push_back(p[corner]);
        }
    return out;
}

TEST(Closed, CornersAtOnePlaceAreOne) {
    const Apart t = tetrahedron();
    EXPECT_TRUE(is_closed(t.positions, t.corners));
}

TEST(Closed, AMissingTurnedOrDoubledFaceOpensIt) {
    for (size_t face = 0; face < 4; ++face) {
        Apart missing = tetrahedron();
        missing.corners.erase(missing.corners.begin() + ptrdiff_t(3 * face),
                              missing.corners.begin() + ptrdiff_t(3 * face + 3));
        EXPECT_FALSE(is_closed(missing.positions, missing.corners)) << face;
        Apart turned = tetrahedron();
        std::swap(turned.corners[3 * face], turned.corners[3 * face + 1]);
        EXPECT_FALSE(is_closed(turned.positions, turned.corners)) << face;
        Apart doubled = tetrahedron();
        for (size_t i = 0; i < 3; ++i) doubled.corners.push_back(doubled.corners[3 * face + i]);
        EXPECT_FALSE(is_closed(doubled.positions, doubled.corners)) << face;
    }
    EXPECT_FALSE(is_closed({}, {}));
}

TEST(Closed, TrianglesWithoutAreaDoNotCount) {
    Apart t = tetrahedron();
    t.corners.insert(t.corners.end(), {0, 0, 1});
    EXPECT_TRUE(is_closed(t.positions, t.corners));
}

}  // namespace
}  // namespace kiln::model
