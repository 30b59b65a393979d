// SPDX-License-Identifier: MIT
// A tree of boxes over boxes. Nodes stand in depth-first order, each with the number of the node that follows when its own box is
// missed: whoever asks walks forward through the array and needs no stack.
#pragma once

#include <kiln/math.h>

#include <cstdint>
#include <span>
#include <vector>

namespace kiln::model {

struct BvhNode {
    vec3 min;
    uint32_t skip;  ///< node after this one's descendants; the number of nodes: there is none
    vec3 max;
    uint32_t leaf;  ///< 0: inner, its first child is the next node; else first << 3 | count, in the order of `order`
};

inline constexpr uint32_t kMostInLeaf = 4;

/// Fills `order` with the numbers of the boxes as leaves hold them. The same tree every time. Surface area heuristic over 16 bins (Wald,
/// "On fast Construction of SAH-based Bounding Volume Hierarchies", 2007).
std::vector<BvhNode> build_bvh(std::span<const Box3> boxes, std::vector<uint32_t>& order);

/// Boxes of the same tree when what it holds has moved; `boxes` in the order of the leaves.
void refit_bvh(std::span<BvhNode> nodes, std::span<const Box3> ordered_boxes);

}  // namespace kiln::model
