// SPDX-License-Identifier: MIT
// Spaceship: hull, canopy, swept wings, tail fin and two engines; nose on +Y, canopy and fin on +Z.
#pragma once

#include "sdf/library/tree.h"

namespace kiln::sdf {

struct SpaceshipRecord {
    param length;  // = 1 m, > 0: nose to nozzles
};

inline Object spaceship_object(const SpaceshipRecord& s) {
    Tree tree("spaceship", Op::Union, 0, s.length);
    const uint32_t body = tree.fold(0, Op::Union, 0.05f);
    // Hull: a lemon from y = -0.42 to the nose at 0.5, a little wider than high.
    tree.leaf(body, Vesica{.radius = 1.0f, .half_distance = 0.888f}, at({0, 0.04f, 0}, {}, {1.1f, 1, 0.9f}));
    tree.leaf(body, Ellipsoid{.radii = {0.045f, 0.12f, 0.05f}}, at({0, 0.14f, 0.075f}));
    // Wings, swept back and thinner towards their tips: Y of the wing's frame points outwards.
    const quat outwards = axis_angle({0, 0, 1}, -1.95f);
    tree.pair(body, RoundedBox{.half_extents = {0.13f, 0.2f, 0.018f}, .rounding = 0.012f},
              at({0.2f, -0.2f, -0.01f}, outwards), {Taper{.rate = 2.2f}});
    tree.leaf(body, RoundedBox{.half_extents = {0.01f, 0.09f, 0.08f}, .rounding = 0.008f},
              at({0, -0.3f, 0.12f}, axis_angle({1, 0, 0}, -0.35f)));

    // Engines: nacelles with hollow nozzles, joined to the wings by a narrow blend.
    const uint32_t engine = tree.fold(0, Op::Subtract, 0.01f, {}, {Mirror{.axis = 0}});
    const uint32_t nacelle = tree.fold(engine, Op::Union, 0.02f);
    tree.leaf(nacelle, Capsule{.half_height = 0.1f, .radius = 0.05f}, at({0.15f, -0.27f, 0}));
    tree.leaf(nacelle, Cone{.half_height = 0.06f, .radius_bottom = 0.055f, .radius_top = 0.038f},
              at({0.15f, -0.44f, 0}));
    tree.leaf(engine, Cone{.half_height = 0.06f, .radius_bottom = 0.046f, .radius_top = 0.02f}, at({0.15f, -0.46f, 0}));
    // Guns under the wings.
    tree.pair(0, RoundedCylinder{.half_height = 0.09f, .radius = 0.012f, .rounding = 0.006f},
              at({0.29f, -0.12f, -0.02f}));
    return tree.take();
}

}  // namespace kiln::sdf
