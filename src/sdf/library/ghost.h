// SPDX-License-Identifier: MIT
// Ghost: a hollow sheet with a scalloped hem, arms, eyes and an open mouth; upright on +Y, its face on +Z.
#pragma once

#include "sdf/library/tree.h"

#include <cmath>

namespace kiln::sdf {

struct GhostRecord {
    param length;  // = 1 m, > 0: hem to crown
};

inline Object ghost_object(const GhostRecord& s) {
    Tree tree("ghost", Op::Subtract, 0.02f, s.length);
    const uint32_t sheet = tree.fold(0, Op::Union, 0.08f);
    tree.leaf(sheet, Sphere{.radius = 0.27f}, at({0, 0.23f, 0}));
    tree.leaf(sheet, Cone{.half_height = 0.345f, .radius_bottom = 0.34f, .radius_top = 0.25f}, at({0, -0.155f, 0}));
    tree.pair(sheet, Capsule{.half_height = 0.12f, .radius = 0.06f},
              at({0.32f, 0.02f, 0.06f}, axis_angle({0, 0, 1}, -0.9f)));
    // Hollow from below, the folds of the hem, then the face.
    tree.leaf(0, Cone{.half_height = 0.3f, .radius_bottom = 0.29f, .radius_top = 0.14f}, at({0, -0.25f, 0}));
    for (int i = 0; i < 7; ++i) {
        const float angle = 6.2831853f * (float(i) + 0.5f) / 7;
        tree.leaf(0, Capsule{.half_height = 0.1f, .radius = 0.085f},
                  at({0.33f * std::sin(angle), -0.52f, 0.33f * std::cos(angle)}));
    }
    const uint32_t eyes = tree.fold(0, Op::Union, 0, {}, {Mirror{.axis = 0}});
    tree.leaf(eyes, Ellipsoid{.radii = {0.045f, 0.07f, 0.06f}},
              at({0.095f, 0.27f, 0.25f}, axis_angle({0, 1, 0}, 0.35f)));
    tree.leaf(0, Ellipsoid{.radii = {0.05f, 0.075f, 0.07f}}, at({0, 0.1f, 0.28f}));
    return tree.take();
}

}  // namespace kiln::sdf
