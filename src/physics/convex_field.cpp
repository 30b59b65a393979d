// SPDX-License-Identifier: MIT

#include "physics/convex_field.h"

#include <algorithm>
#include <cmath>

namespace kiln::physics {

float ConvexField::distance(vec3 p) const {
    vec3 gradient;
    return distance(p, gradient);
}

float ConvexField::distance(vec3 p, vec3& gradient) const {
    const vec3 away = p - project(convex_, p);
    if (const float outside = length(away); outside > 0) {
        gradient = away / outside;
        return outside;
    }
    // Inside: the nearest side is the one that the point must leave through.
    const float r = convex_.size.x, h = convex_.size.y, across = std::sqrt(p.x * p.x + p.z * p.z);
    const vec3 side = across > 0 ? vec3{p.x / across, 0, p.z / across} : vec3{1, 0, 0};
    switch (convex_.kind) {
    case Convex::Kind::Sphere:
    case Convex::Kind::Capsule: {
        const float y = convex_.kind == Convex::Kind::Sphere ? 0 : std::clamp(p.y, -h, h);
        const vec3 from{p.x, p.y - y, p.z};
        const float size = length(from);
        gradient = size > 0 ? from / size : vec3{1, 0, 0};
        return size - r;
    }
    case Convex::Kind::Cylinder:
        if (across - r > std::abs(p.y) - h) {
            gradient = side;
            return across - r;
        }
        gradient = {0, std::copysign(1.0f, p.y), 0};
        return std::abs(p.y) - h;
    case Convex::Kind::Box: {
        const vec3 q{std::abs(p.x) - convex_.size.x, std::abs(p.y) - h, std::abs(p.z) - convex_.size.z};
        const float most = std::max({q.x, q.y, q.z});
        gradient = most == q.y   ? vec3{0, std::copysign(1.0f, p.y), 0}
                   : most == q.x ? vec3{std::copysign(1.0f, p.x), 0, 0}
                                 : vec3{0, 0, std::copysign(1.0f, p.z)};
        return most;
    }
    }
    return 0;
}

void ConvexField::distances(const sdf::Points& points, float* out) const {
    for (int i = 0; i < points.count; ++i) out[i] = distance({points.x[i], points.y[i], points.z[i]});
}

}  // namespace kiln::physics
