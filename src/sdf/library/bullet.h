// SPDX-License-Identifier: MIT
// Bullet: a pointed round with a groove around its waist and a hollow base; tip on +Y.
#pragma once

#include "sdf/library/tree.h"

namespace kiln::sdf {

struct BulletRecord {
    param length;  // = 1 m, > 0: base to tip
};

inline Object bullet_object(const BulletRecord& s) {
    Tree tree("bullet", Op::Subtract, 0.02f, s.length);
    const uint32_t body = tree.fold(0, Op::Union, 0);
    // The head is a lemon of half width 0.15 and half height 0.45 = sqrt(0.75² - 0.6²), tangent to the shank it stands in.
    tree.leaf(body, Vesica{.radius = 0.75f, .half_distance = 0.6f}, at({0, 0.05f, 0}));
    tree.leaf(body, Cylinder{.half_height = 0.2f, .radius = 0.15f}, at({0, -0.15f, 0}));
    tree.leaf(body, Cone{.half_height = 0.075f, .radius_bottom = 0.13f, .radius_top = 0.15f}, at({0, -0.425f, 0}));
    tree.leaf(0, Torus{.major_radius = 0.158f, .minor_radius = 0.016f}, at({0, -0.2f, 0}));
    tree.leaf(0, Ellipsoid{.radii = {0.08f, 0.12f, 0.08f}}, at({0, -0.53f, 0}));
    return tree.take();
}

}  // namespace kiln::sdf
