// SPDX-License-Identifier: MIT
// A rigid frame: parent = position + rotation · local.
#pragma once

#include <kiln/math.h>

namespace kiln::physics {

struct Pose {
    vec3 position{};
    quat rotation{};
    friend bool operator==(const Pose&, const Pose&) = default;
};

constexpr vec3 operator*(const Pose& a, vec3 p) { return a.position + rotate(a.rotation, p); }
constexpr Pose operator*(const Pose& a, const Pose& b) { return {a * b.position, a.rotation * b.rotation}; }
constexpr Pose inverse(const Pose& a) {
    const quat r = conjugate(a.rotation);
    return {-rotate(r, a.position), r};
}
constexpr vec3 direction_into(const Pose& a, vec3 d) { return rotate(conjugate(a.rotation), d); }

}  // namespace kiln::physics
