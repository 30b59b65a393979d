// SPDX-License-Identifier: MIT
// What a world looks like to its engine, as straight lines: shapes, in the colour of how they move; contacts, as short lines along their
// normals. For pictures of what goes wrong.
#pragma once

#include "physics/physics.h"

#include <kiln/math.h>

#include <vector>

namespace kiln::physics {

struct Line {
    dvec3 a, b;  ///< world metres
    vec3 color;  ///< linear Rec. 709
};

struct LineSettings {
    bool shapes = true;    ///< outlines of convex bodies, boxes of fields that move
    bool contacts = true;  ///< of pairs that touch
    float normal = 0.2f;   ///< length of a contact's line, metres
};

inline constexpr vec3 kAwake{1, 0.55f, 0.1f}, kAsleep{0.25f, 0.35f, 1}, kKinematic{0.2f, 0.9f, 0.9f},
    kStanding{0.45f, 0.45f, 0.45f}, kContact{0.2f, 1, 0.2f}, kDeepContact{1, 0.1f, 0.1f};
inline constexpr float kDeep = 0.02f;  ///< metres: contacts above have the second colour

/// By body, then by pair. Between steps.
std::vector<Line> lines(const World& world, std::span<const BodyId> bodies, const LineSettings& settings = {});

}  // namespace kiln::physics
