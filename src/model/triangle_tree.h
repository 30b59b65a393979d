// SPDX-License-Identifier: MIT
// Triangles in a tree of four children a node, asked for the nearest distance and for the winding number. Four triangles or boxes are
// tested at once, always in the same order: the same bytes on every machine.
// Distance: the point's coordinates in a triangle's plane decide between its face and its three edges (Ericson, "Real-Time Collision
// Detection", 2004, 5.1.5, without branches). Winding number: the solid angle of each triangle (Van Oosterom and Strackee, "The Solid
// Angle of a Plane Triangle", 1983) over 4 pi (Jacobson, Kavan and Sorkine-Hornung, "Robust Inside-Outside Segmentation using
// Generalized Winding Numbers", 2013); far groups count as one dipole (Barill et al., "Fast Winding Numbers for Soups and Clouds", 2018).
#pragma once

#include "model/triangles.h"

#include <span>

namespace kiln::model {

typedef float Four __attribute__((vector_size(16)));

class TriangleTree {
public:
    /// Positions near the origin: floats are finest there.
    TriangleTree(std::span<const vec3> positions, std::span<const Face> faces);

    bool empty() const { return nodes_.empty(); }
    /// Squared distance to the nearest triangle, or `bound` where all are farther. `near` carries a hint from one point to the next
    /// (-1 at first) and changes nothing but the time. Any thread.
    float squared_distance(vec3 p, float bound, int32_t* near = nullptr) const;
    /// 1 inside, 0 outside of a closed surface whose triangles face outwards; between where it is open. Any thread.
    float winding(vec3 p) const;

private:
    struct Node {
        Four lo[3], hi[3];  // boxes of the children; an absent one is infinitely far away
        Four center[3];     // of their dipoles
        Four moment[3];     // sums of area times normal
        Four far_squared;   // beyond this from `center` the dipole serves
        int32_t child[4];   // node; leaf: ~index; kNone
    };
    // Four triangles; those that are missing repeat the last, with no area.
    struct Leaf {
        Four a[3], ab[3], ac[3];
        Four u[3], v[3], n[3];  // coordinates along ab and ac, and unit normal
        Four limit;             // u + v may reach this: 1, or -1 where the triangle has no area of its own
        Four inverse_ab, inverse_ac, inverse_bc;  // 1 / length squared
        Four weight;                              // 1; 0 where missing
    };
    struct Group {
        double lo[3], hi[3];
        double center[3], moment[3], area;
    };
    static constexpr int32_t kNone = INT32_MIN;

    static float leaf_distance(const Leaf& leaf, const Four* p, float bound);
    int32_t build(std::span<uint32_t> range, Group& group);
    int32_t make_leaf(std::span<const uint32_t> range, Group& group);

    std::span<const vec3> positions_;  // while building
    std::span<const Face> faces_;
    std::vector<vec3> middles_;
    std::vector<Node> nodes_;  // the root is the last
    std::vector<Leaf> leaves_;
};

}  // namespace kiln::model
