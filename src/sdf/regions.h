// SPDX-License-Identifier: MIT
// Regions: cubes of space, halved as far as it helps, each with the part of a program that matters in it. Made where questions are
// asked and kept, so that a question costs the edits around it, not all of them. Reading is for any thread, also while others make
// regions: a region is published whole, and every thread that makes the same one makes the same bits.
#pragma once

#include "sdf/eval.h"
#include "sdf/program.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <memory>
#include <vector>

namespace kiln::sdf {

/// Generations in which pruning did not shorten code by a fifth, and it is not tried again.
constexpr int kMostIdle = 3;

inline double largest(dvec3 p) { return std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}); }

class Regions {
public:
    struct Node {
        dvec3 center;
        double half = 0;  ///< metres, half of a side
        int depth = 0;
        int idle = 0;                   ///< generations in which the code hardly shrank
        std::vector<Instruction> code;  ///< right in the cube and kMargin around it
        std::array<std::atomic<const Node*>, 8> children{};

        bool contains(dvec3 p) const;
        ~Node();
    };

    /// Keeps a reference to `program`, which must outlive it.
    explicit Regions(const Program& program);
    Regions(const Regions&) = delete;
    Regions& operator=(const Regions&) = delete;

    const Program& program() const { return program_; }
    /// Holds the solids of all finite edits, and far around them.
    const Node& root() const { return root_; }
    /// Octant 0 … 7 of a node (bit 0: x, 1: y, 2: z); null where halving does not help any more.
    const Node* child(const Node& node, int octant) const;
    /// The smallest region that holds p; null outside the root, where the whole program is right.
    const Node* leaf(dvec3 p) const;
    /// Code that is right in all of a cube.
    TapeView tape_around(dvec3 center, double half) const;

    /// Where a question was asked last: the next one is likely to be near.
    using Cursor = const Node*;
    /// The program's value, metres.
    double at(dvec3 p, Cursor& cursor) const;
    TapeView tape(dvec3 p, Cursor& cursor) const;

private:
    const Program& program_;
    Node root_;
    double scene_half_ = 0;
    mutable std::atomic<size_t> instructions_ = 0;  // kept in all nodes
};

/// Metres around a region in which its code is right too, for differences across its border.
double region_margin(dvec3 center, double half);

}  // namespace kiln::sdf
