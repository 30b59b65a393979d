// SPDX-License-Identifier: MIT
// Plain vectors, quaternions and boxes of the public interface.
// Right-handed, +Y up, metres and radians; quaternions are (x, y, z, w). Only what the interface and the CPU modules share.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

namespace kiln {

struct vec2 {
    float x = 0, y = 0;
    friend bool operator==(const vec2&, const vec2&) = default;
};

struct vec3 {
    float x = 0, y = 0, z = 0;
    friend bool operator==(const vec3&, const vec3&) = default;
};

struct vec4 {
    float x = 0, y = 0, z = 0, w = 0;
    friend bool operator==(const vec4&, const vec4&) = default;
};

/// Double precision: positions of judges and of worlds far from the origin.
struct dvec3 {
    double x = 0, y = 0, z = 0;
    friend bool operator==(const dvec3&, const dvec3&) = default;
};

/// The same place or direction, in double precision.
constexpr dvec3 wide(vec3 a) { return {a.x, a.y, a.z}; }

/// Rotation, (x, y, z, w) with w the scalar part; unit length.
struct quat {
    float x = 0, y = 0, z = 0, w = 1;
    friend bool operator==(const quat&, const quat&) = default;
};

constexpr vec3 operator+(vec3 a, vec3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
constexpr vec3 operator-(vec3 a, vec3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
constexpr vec3 operator-(vec3 a) { return {-a.x, -a.y, -a.z}; }
constexpr vec3 operator*(vec3 a, vec3 b) { return {a.x * b.x, a.y * b.y, a.z * b.z}; }
constexpr vec3 operator*(vec3 a, float s) { return {a.x * s, a.y * s, a.z * s}; }
constexpr vec3 operator*(float s, vec3 a) { return a * s; }
constexpr vec3 operator/(vec3 a, float s) { return {a.x / s, a.y / s, a.z / s}; }
constexpr float dot(vec3 a, vec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
constexpr vec3 cross(vec3 a, vec3 b) { return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }
inline float length(vec3 a) { return std::sqrt(dot(a, a)); }
inline vec3 normalize(vec3 a) { return a / length(a); }
constexpr vec3 min(vec3 a, vec3 b) { return {std::min(a.x, b.x), std::min(a.y, b.y), std::min(a.z, b.z)}; }
constexpr vec3 max(vec3 a, vec3 b) { return {std::max(a.x, b.x), std::max(a.y, b.y), std::max(a.z, b.z)}; }

/// q · v · q⁻¹ for a unit quaternion.
constexpr vec3 rotate(quat q, vec3 v) {
    const vec3 u{q.x, q.y, q.z};
    const vec3 t = 2.0f * cross(u, v);
    return v + q.w * t + cross(u, t);
}
constexpr quat conjugate(quat q) { return {-q.x, -q.y, -q.z, q.w}; }
/// First b, then a.
constexpr quat operator*(quat a, quat b) {
    return {a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y, a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x,
            a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w, a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z};
}
/// Rotation by `angle` radians about the unit vector `axis`.
inline quat axis_angle(vec3 axis, float angle) {
    const float s = std::sin(0.5f * angle);
    return {axis.x * s, axis.y * s, axis.z * s, std::cos(0.5f * angle)};
}

/// Axis-aligned box; empty when min > max, infinite faces allowed.
struct Box3 {
    vec3 min{std::numeric_limits<float>::infinity(), std::numeric_limits<float>::infinity(),
             std::numeric_limits<float>::infinity()};
    vec3 max{-std::numeric_limits<float>::infinity(), -std::numeric_limits<float>::infinity(),
             -std::numeric_limits<float>::infinity()};

    constexpr bool empty() const { return !(min.x <= max.x && min.y <= max.y && min.z <= max.z); }
    bool finite() const {
        return std::isfinite(min.x) && std::isfinite(min.y) && std::isfinite(min.z) && std::isfinite(max.x) &&
               std::isfinite(max.y) && std::isfinite(max.z);
    }
    constexpr vec3 center() const { return (min + max) * 0.5f; }
    constexpr vec3 half_extents() const { return (max - min) * 0.5f; }
    constexpr Box3 inflated(float by) const { return {min - vec3{by, by, by}, max + vec3{by, by, by}}; }
    constexpr bool contains(vec3 p) const {
        return p.x >= min.x && p.y >= min.y && p.z >= min.z && p.x <= max.x && p.y <= max.y && p.z <= max.z;
    }
    constexpr bool overlaps(const Box3& o) const {
        return min.x <= o.max.x && min.y <= o.max.y && min.z <= o.max.z && o.min.x <= max.x && o.min.y <= max.y &&
               o.min.z <= max.z;
    }
    friend bool operator==(const Box3&, const Box3&) = default;
};
constexpr Box3 box_union(const Box3& a, const Box3& b) { return {min(a.min, b.min), max(a.max, b.max)}; }
constexpr Box3 box_intersection(const Box3& a, const Box3& b) { return {max(a.min, b.min), min(a.max, b.max)}; }

/// local -> parent: position + rotation · (scale ∘ local). Every scale > 0.
struct Transform {
    vec3 position{};
    quat rotation{};
    vec3 scale{1, 1, 1};
    friend bool operator==(const Transform&, const Transform&) = default;
};

/// A rigid frame: parent = position + rotation · local.
struct Pose {
    vec3 position{};
    quat rotation{};
    friend bool operator==(const Pose&, const Pose&) = default;
};
constexpr vec3 operator*(const Pose& a, vec3 p) { return a.position + rotate(a.rotation, p); }
/// First b, then a.
constexpr Pose operator*(const Pose& a, const Pose& b) { return {a * b.position, a.rotation * b.rotation}; }
constexpr Pose inverse(const Pose& a) {
    const quat r = conjugate(a.rotation);
    return {-rotate(r, a.position), r};
}
constexpr vec3 direction_into(const Pose& a, vec3 d) { return rotate(conjugate(a.rotation), d); }

}  // namespace kiln
