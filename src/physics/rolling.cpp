// SPDX-License-Identifier: MIT

#include "physics/rolling.h"

#include <algorithm>

namespace kiln::physics {

namespace {

// A place of contact that slips by more than this share of what rolling moves it, or by this speed, does not turn the way into a roll.
constexpr float kSlipShare = 0.2f, kSlipSpeed = 0.02f;

}  // namespace

Velocities resist_rolling(const MassProperties& mass, const Pose& pose, const Velocities& now, const Support& support,
                          vec3 gravity, float seconds) {
    const vec3 arm = support.point - pose.position;
    const float reach = length(arm), kilos = float(mass.mass);
    const float most = support.rolling_friction * reach * support.impulse;  // N m s
    if (!(most > 0) || !(reach > 0)) return now;
    const vec3 spin = now.angular - support.spin;
    const vec3 slip = now.linear + cross(now.angular, arm) - support.velocity;
    const vec3 along = slip - support.normal * dot(slip, support.normal);
    const bool rolls = length(along) <= kSlipSpeed + kSlipShare * length(cross(spin, arm));
    // I ω in the world, about the centre of mass; about where it touches, m (r² ω − r (r · ω)) more.
    const vec3 moments{float(mass.moments.x), float(mass.moments.y), float(mass.moments.z)};
    const auto momentum = [&](vec3 w) {
        const vec3 local = direction_into(pose, w);
        vec3 out = rotate(pose.rotation, {moments.x * local.x, moments.y * local.y, moments.z * local.z});
        if (rolls) out = out + (w * (reach * reach) - arm * dot(arm, w)) * kilos;
        return out;
    };
    // The inverse of that, by the columns of a 3×3 matrix (Cramer's rule).
    const vec3 a = momentum({1, 0, 0}), b = momentum({0, 1, 0}), c = momentum({0, 0, 1});
    const float volume = dot(a, cross(b, c));
    if (!(volume > 0)) return now;
    const vec3 moved = cross(arm, gravity) * (-kilos * seconds);  // by gravity, about where it touches
    const vec3 turned =
        rolls ? vec3{dot(cross(b, c), moved), dot(cross(c, a), moved), dot(cross(a, b), moved)} / volume : vec3{};
    const vec3 would = spin + turned;
    const float size = length(momentum(would));
    if (!(size > 0)) return now;
    const vec3 taken = would * std::min(most / size, 1.0f);
    Velocities out = now;
    out.angular = now.angular - taken;
    // What turns about the place it touches takes its centre along: v = arm × ω.
    if (rolls) out.linear = now.linear - cross(arm, taken);
    return out;
}

}  // namespace kiln::physics
