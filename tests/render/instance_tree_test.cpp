// SPDX-License-Identifier: MIT
#include "render/instance_tree.h"

#include "field/worlds.h"

#include <algorithm>
#include <vector>

namespace kiln::render {
namespace {

using field::worlds::Random;

std::vector<Box3> random_boxes(Random& r, int count) {
    std::vector<Box3> out;
    for (int i = 0; i < count; ++i) {
        const vec3 at = r.point(20), half{r.in(0, 2), r.in(0, 2), r.in(0, 2)};
        out.push_back(i % 17 == 3 ? Box3{} : Box3{at - half, at + half});
    }
    return out;
}

bool meets(const Box3& box, vec3 d) {
    float first = 0, last = 1e30f;
    const float lo[] = {box.min.x, box.min.y, box.min.z}, hi[] = {box.max.x, box.max.y, box.max.z},
                by[] = {d.x, d.y, d.z};
    for (size_t k = 0; k < 3; ++k) {
        const float a = lo[k] / by[k], b = hi[k] / by[k];
        first = std::max(first, std::min(a, b));
        last = std::min(last, std::max(a, b));
    }
    return first <= last;
}

// The walk that kernels make.
std::vector<uint32_t> walk(const std::vector<InstanceNode>& nodes, vec3 d, size_t& looked) {
    std::vector<uint32_t> out;
    for (uint32_t at = 0; at < nodes.size();) {
        const InstanceNode& n = nodes[at];
        ++looked;
        const bool in = meets({{n.low_x, n.low_y, n.low_z}, {n.high_x, n.high_y, n.high_z}}, d);
        if (in && n.instance != kNoInstance) out.push_back(n.instance);
        at = in ? at + 1 : n.skip;
    }
    return out;
}

TEST(InstanceTree, AWalkFindsWhatARayMeetsAndNothingElse) {
    Random r(5);
    for (const int count : {1, 2, 3, 17, 400}) {
        const std::vector<Box3> boxes = random_boxes(r, count);
        const std::vector<InstanceNode> nodes = instance_tree(boxes);
        size_t looked = 0, rays = 0;
        for (int i = 0; i < 300; ++i) {
            const vec3 d = r.direction();
            std::vector<uint32_t> expected;
            for (uint32_t b = 0; b < boxes.size(); ++b)
                if (!boxes[b].empty() && meets(boxes[b], d)) expected.push_back(b);
            std::vector<uint32_t> found = walk(nodes, d, looked);
            std::sort(found.begin(), found.end());
            EXPECT_EQ(found, expected);
            ++rays;
        }
        if (count == 400) {
            EXPECT_LT(looked, rays * nodes.size() / 8);
        }
    }
    EXPECT_TRUE(instance_tree({}).empty());
    EXPECT_TRUE(instance_tree(std::vector<Box3>(3)).empty());
}

TEST(InstanceTree, ARayFromTheEyeMeetsNearBoxesBeforeFarOnesOfARow) {
    for (const float side : {1.0f, -1.0f}) {
        std::vector<Box3> row;
        for (int i = 0; i < 64; ++i) {
            const float x = side * float(2 + 3 * ((i * 37) % 64));
            row.push_back({{x - 1, -1, -1}, {x + 1, 1, 1}});
        }
        size_t looked = 0;
        const std::vector<uint32_t> met = walk(instance_tree(row), {side, 0.001f, 0.001f}, looked);
        ASSERT_EQ(met.size(), row.size());
        for (size_t i = 1; i < met.size(); ++i) EXPECT_LT(std::abs(row[met[i - 1]].min.x), std::abs(row[met[i]].min.x));
    }
}

TEST(InstanceTree, EqualBoxesMakeATreeToo) {
    const std::vector<Box3> same(100, Box3{{1, 1, 1}, {2, 2, 2}});
    const std::vector<InstanceNode> nodes = instance_tree(same);
    EXPECT_EQ(nodes.size(), 199u);
    size_t looked = 0;
    EXPECT_EQ(walk(nodes, {1, 1, 1}, looked).size(), 100u);
}

}  // namespace
}  // namespace kiln::render
