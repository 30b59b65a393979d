// SPDX-License-Identifier: MIT

#include "model/bvh.h"

#include <algorithm>
#include <array>
#include <numeric>

namespace kiln::model {
namespace {

constexpr int kBins = 16;

float axis(vec3 v, int a) { return a == 0 ? v.x : a == 1 ? v.y : v.z; }

double area(const Box3& b) {
    if (b.empty()) return 0;
    const double x = double(b.max.x) - b.min.x, y = double(b.max.y) - b.min.y, z = double(b.max.z) - b.min.z;
    return x * y + y * z + z * x;
}

struct Split {
    int axis = -1;
    int bin = 0;
};

int bin_of(vec3 center, const Box3& centers, int a) {
    const float low = axis(centers.min, a), wide = axis(centers.max, a) - low;
    const float at = (axis(center, a) - low) / wide * float(kBins);
    return std::clamp(int(at), 0, kBins - 1);
}

Split best_split(std::span<const Box3> boxes, std::span<const uint32_t> items, const Box3& centers) {
    Split best;
    double least = 0;
    for (int a = 0; a < 3; ++a) {
        if (!(axis(centers.max, a) > axis(centers.min, a))) continue;
        std::array<Box3, kBins> held{};
        std::array<uint32_t, kBins> count{};
        for (const uint32_t i : items) {
            const size_t b = size_t(bin_of(boxes[i].center(), centers, a));
            held[b] = box_union(held[b], boxes[i]);
            ++count[b];
        }
        std::array<double, kBins> above{};
        Box3 box;
        uint32_t n = 0;
        for (size_t b = kBins; b-- > 1;) {
            box = box_union(box, held[b]);
            n += count[b];
            above[b] = area(box) * n;
        }
        box = {};
        n = 0;
        for (size_t b = 0; b + 1 < kBins; ++b) {
            box = box_union(box, held[b]);
            n += count[b];
            if (n == 0 || n == items.size()) continue;
            const double cost = area(box) * n + above[b + 1];
            if (best.axis < 0 || cost < least) {
                best = {a, int(b)};
                least = cost;
            }
        }
    }
    return best;
}

}  // namespace

std::vector<BvhNode> build_bvh(std::span<const Box3> boxes, std::vector<uint32_t>& order) {
    std::vector<BvhNode> nodes;
    order.resize(boxes.size());
    std::iota(order.begin(), order.end(), 0u);
    if (boxes.empty()) return nodes;
    nodes.reserve(boxes.size());
    // A task with a node has its range done when it is met again: then its skip is known.
    struct Task {
        uint32_t first, last;
        uint32_t node;
    };
    constexpr uint32_t kNone = UINT32_MAX;
    std::vector<Task> tasks{{0, uint32_t(boxes.size()), kNone}};
    while (!tasks.empty()) {
        const Task task = tasks.back();
        tasks.pop_back();
        if (task.node != kNone) {
            nodes[task.node].skip = uint32_t(nodes.size());
            continue;
        }
        const std::span<uint32_t> items = std::span(order).subspan(task.first, task.last - task.first);
        Box3 box, centers;
        for (const uint32_t i : items) {
            box = box_union(box, boxes[i]);
            const vec3 c = boxes[i].center();
            centers = box_union(centers, {c, c});
        }
        const auto node = uint32_t(nodes.size());
        nodes.push_back({box.min, node + 1, box.max, 0});
        if (items.size() <= kMostInLeaf) {
            nodes.back().leaf = task.first << 3 | uint32_t(items.size());
            continue;
        }
        const Split split = best_split(boxes, items, centers);
        auto middle = items.begin() + ptrdiff_t(items.size() / 2);
        if (split.axis >= 0)
            middle = std::stable_partition(items.begin(), items.end(), [&](uint32_t i) {
                return bin_of(boxes[i].center(), centers, split.axis) <= split.bin;
            });
        const uint32_t cut = task.first + uint32_t(middle - items.begin());
        tasks.push_back({0, 0, node});
        tasks.push_back({cut, task.last, kNone});
        tasks.push_back({task.first, cut, kNone});
    }
    return nodes;
}

void refit_bvh(std::span<BvhNode> nodes, std::span<const Box3> ordered_boxes) {
    for (size_t n = nodes.size(); n-- > 0;) {
        BvhNode& node = nodes[n];
        Box3 box;
        if (node.leaf != 0) {
            for (uint32_t i = 0; i < (node.leaf & 7u); ++i) box = box_union(box, ordered_boxes[(node.leaf >> 3) + i]);
        } else {
            for (uint32_t child = uint32_t(n) + 1; child < node.skip; child = nodes[child].skip)
                box = box_union(box, {nodes[child].min, nodes[child].max});
        }
        node.min = box.min;
        node.max = box.max;
    }
}

}  // namespace kiln::model
