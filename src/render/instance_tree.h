// SPDX-License-Identifier: MIT
// The tree over instances' boxes, made anew for each frame: a bounding volume hierarchy laid out in the order in which rays from the
// origin want it, so that a walk needs no stack and meets the nearer child first.
#pragma once

#include "render/passes/instances.gpu.h"

#include <kiln/math.h>

#include <span>
#include <vector>

namespace kiln::render {

// Boxes count from the eye; box i is instance i's. An empty box is in no leaf. 2n - 1 nodes for n boxes.
// The same boxes give the same tree.
std::vector<InstanceNode> instance_tree(std::span<const Box3> boxes);

}  // namespace kiln::render
