// SPDX-License-Identifier: MIT

#include "physics/convex.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace kiln::physics {

namespace {

using Kind = Convex::Kind;
constexpr double kPi = std::numbers::pi;
// Below this slope against the axis a capsule's side and a cylinder's cap or side count as facing the direction.
constexpr float kFacing = 0.3f;

vec3 clamped(vec3 p, vec3 h) { return max(min(p, h), -h); }
float radial(vec3 p) { return std::sqrt(p.x * p.x + p.z * p.z); }

}  // namespace

vec3 half_extents(const Convex& c) {
    return c.kind == Kind::Capsule ? vec3{c.size.x, c.size.y + c.size.x, c.size.x} : c.size;
}

float outer_radius(const Convex& c) {
    switch (c.kind) {
    case Kind::Sphere:
        return c.size.x;
    case Kind::Box:
        return length(c.size);
    case Kind::Capsule:
        return c.size.y + c.size.x;
    case Kind::Cylinder:
        return std::hypot(c.size.x, c.size.y);
    }
    return 0;
}

float inner_radius(const Convex& c) {
    switch (c.kind) {
    case Kind::Sphere:
    case Kind::Capsule:
        return c.size.x;
    case Kind::Box:
        return std::min({c.size.x, c.size.y, c.size.z});
    case Kind::Cylinder:
        return std::min(c.size.x, c.size.y);
    }
    return 0;
}

double volume(const Convex& c) {
    const double r = double(c.size.x), h = double(c.size.y);
    switch (c.kind) {
    case Kind::Sphere:
        return 4 * kPi / 3 * r * r * r;
    case Kind::Box:
        return 8 * r * h * double(c.size.z);
    case Kind::Capsule:
        return kPi * r * r * (2 * h + 4 * r / 3);
    case Kind::Cylinder:
        return 2 * kPi * r * r * h;
    }
    return 0;
}

dvec3 moments(const Convex& c) {
    const double r = double(c.size.x), h = double(c.size.y), z = double(c.size.z);
    switch (c.kind) {
    case Kind::Sphere:
        return {0.4 * r * r, 0.4 * r * r, 0.4 * r * r};
    case Kind::Box:
        return {(h * h + z * z) / 3, (r * r + z * z) / 3, (r * r + h * h) / 3};
    case Kind::Cylinder: {
        const double side = r * r / 4 + h * h / 3;
        return {side, r * r / 2, side};
    }
    case Kind::Capsule: {
        // A cylinder and two half balls whose centres of mass lie 3/8 r beyond its ends.
        const double tube = 2 * h / (2 * h + 4 * r / 3), balls = 1 - tube;
        const double side = tube * (r * r / 4 + h * h / 3) + balls * (0.4 * r * r + h * h + 0.75 * h * r);
        return {side, tube * r * r / 2 + balls * 0.4 * r * r, side};
    }
    }
    return {};
}

float reach(const Convex& c, vec3 d) {
    switch (c.kind) {
    case Kind::Sphere:
        return c.size.x;
    case Kind::Box:
        return std::abs(d.x) * c.size.x + std::abs(d.y) * c.size.y + std::abs(d.z) * c.size.z;
    case Kind::Capsule:
        return std::abs(d.y) * c.size.y + c.size.x;
    case Kind::Cylinder:
        return std::abs(d.y) * c.size.y + radial(d) * c.size.x;
    }
    return 0;
}

vec3 project(const Convex& c, vec3 p) {
    switch (c.kind) {
    case Kind::Sphere: {
        const float size = length(p);
        return size > c.size.x ? p * (c.size.x / size) : p;
    }
    case Kind::Box:
        return clamped(p, c.size);
    case Kind::Capsule: {
        const vec3 on{0, std::clamp(p.y, -c.size.y, c.size.y), 0};
        const vec3 away = p - on;
        const float size = length(away);
        return size > c.size.x ? on + away * (c.size.x / size) : p;
    }
    case Kind::Cylinder: {
        const float size = radial(p), k = size > c.size.x ? c.size.x / size : 1;
        return {p.x * k, std::clamp(p.y, -c.size.y, c.size.y), p.z * k};
    }
    }
    return p;
}

int face(const Convex& c, vec3 d, std::array<vec3, kMostCorners>& corners) {
    const float r = c.size.x, h = c.size.y;
    switch (c.kind) {
    case Kind::Sphere:
        corners[0] = d * r;
        return 1;
    case Kind::Box: {
        const float a[3] = {std::abs(d.x), std::abs(d.y), std::abs(d.z)};
        const int axis = a[1] >= a[0] && a[1] >= a[2] ? 1 : a[0] >= a[2] ? 0 : 2;
        const float along[3] = {d.x, d.y, d.z}, size[3] = {c.size.x, c.size.y, c.size.z};
        constexpr float kRound[4][2] = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}};
        for (size_t i = 0; i < 4; ++i) {
            float p[3];
            p[axis] = std::copysign(size[axis], along[axis]);
            p[(axis + 1) % 3] = kRound[i][0] * size[(axis + 1) % 3];
            p[(axis + 2) % 3] = kRound[i][1] * size[(axis + 2) % 3];
            corners[i] = {p[0], p[1], p[2]};
        }
        return 4;
    }
    case Kind::Capsule: {
        if (std::abs(d.y) > kFacing) {
            corners[0] = vec3{0, std::copysign(h, d.y), 0} + d * r;
            return 1;
        }
        corners[0] = vec3{0, h, 0} + d * r;
        corners[1] = vec3{0, -h, 0} + d * r;
        return 2;
    }
    case Kind::Cylinder: {
        if (std::abs(d.y) > 1 - kFacing) {
            // The first corner lies farthest towards d.
            const float across = radial(d);
            const vec3 u = across > 1e-6f ? vec3{d.x / across, 0, d.z / across} : vec3{1, 0, 0}, v{-u.z, 0, u.x};
            for (size_t i = 0; i < 8; ++i) {
                const float angle = float(i) * float(kPi / 4);
                corners[i] = u * (r * std::cos(angle)) + v * (r * std::sin(angle)) + vec3{0, std::copysign(h, d.y), 0};
            }
            return 8;
        }
        const float across = std::max(radial(d), 1e-6f);
        const vec3 side{d.x / across * r, 0, d.z / across * r};
        corners[0] = side + vec3{0, h, 0};
        corners[1] = side - vec3{0, h, 0};
        return 2;
    }
    }
    return 0;
}

std::array<vec3, kStarts> starts(const Convex& c) {
    const vec3 h = half_extents(c);
    return {vec3{0, 0, 0}, {h.x, 0, 0}, {-h.x, 0, 0}, {0, h.y, 0}, {0, -h.y, 0}, {0, 0, h.z}, {0, 0, -h.z}};
}

}  // namespace kiln::physics
