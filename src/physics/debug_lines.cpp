// SPDX-License-Identifier: MIT

#include "physics/debug_lines.h"

#include <array>
#include <cmath>
#include <numbers>

namespace kiln::physics {

namespace {

constexpr int kAround = 24;  // pieces of a circle

class Pen {
public:
    Pen(std::vector<Line>& out, const Pose& pose, vec3 color) : out_(out), pose_(pose), color_(color) {}
    void line(vec3 a, vec3 b) const {
        const vec3 p = pose_ * a, q = pose_ * b;
        out_.push_back({{double(p.x), double(p.y), double(p.z)}, {double(q.x), double(q.y), double(q.z)}, color_});
    }
    void box(const Box3& b) const {
        const std::array<vec3, 2> ends{b.min, b.max};
        const auto corner = [&](int i) {
            return vec3{ends[size_t(i & 1)].x, ends[size_t(i >> 1 & 1)].y, ends[size_t(i >> 2)].z};
        };
        for (int i = 0; i < 8; ++i)
            for (int bit = 1; bit < 8; bit <<= 1)
                if ((i & bit) == 0) line(corner(i), corner(i | bit));
    }
    // Part of a circle around `center`, from u towards v.
    void arc(vec3 center, vec3 u, vec3 v, float turn) const {
        const int pieces = std::max(1, int(std::lround(float(kAround) * turn)));
        const auto at = [&](int i) {
            const float angle = 2 * std::numbers::pi_v<float> * turn * float(i) / float(pieces);
            return center + u * std::cos(angle) + v * std::sin(angle);
        };
        for (int i = 0; i < pieces; ++i) line(at(i), at(i + 1));
    }

private:
    std::vector<Line>& out_;
    Pose pose_;
    vec3 color_;
};

void draw(const Convex& c, const Pen& pen) {
    const float r = c.size.x, h = c.size.y;
    const vec3 x{r, 0, 0}, y{0, r, 0}, z{0, 0, r}, up{0, h, 0};
    switch (c.kind) {
    case Convex::Kind::Box:
        pen.box({-c.size, c.size});
        break;
    case Convex::Kind::Sphere:
        pen.arc({}, x, y, 1);
        pen.arc({}, y, z, 1);
        pen.arc({}, z, x, 1);
        break;
    case Convex::Kind::Capsule:
    case Convex::Kind::Cylinder:
        for (const vec3 end : {up, -up}) pen.arc(end, x, z, 1);
        for (const vec3 side : {x, -x, z, -z}) pen.line(side + up, side - up);
        if (c.kind == Convex::Kind::Cylinder) break;
        for (const vec3 side : {x, z}) {
            pen.arc(up, side, y, 0.5f);
            pen.arc(-up, side, -y, 0.5f);
        }
        break;
    }
}

vec3 color_of(const World& world, BodyId id) {
    switch (world.motion(id)) {
    case Motion::Static:
        return kStanding;
    case Motion::Kinematic:
        return kKinematic;
    case Motion::Dynamic:
        break;
    }
    return world.state(id).asleep ? kAsleep : kAwake;
}

}  // namespace

std::vector<Line> lines(const World& world, std::span<const BodyId> bodies, const LineSettings& settings) {
    std::vector<Line> out;
    for (const BodyId id : bodies) {
        const BodyShape* shape = world.shape(id);
        if (!settings.shapes || shape == nullptr) continue;
        const Pen pen(out, world.state(id).pose, color_of(world, id));
        if (const Convex* convex = std::get_if<Convex>(shape)) {
            draw(*convex, pen);
        } else if (const Box3 box = solid_of(*shape)->bounds(); box.finite() && !box.empty()) {
            pen.box(box);
        }
    }
    if (!settings.contacts) return out;
    for (const World::Touch& touch : world.touches())
        for (const BodyContact& c : world.touch_points(touch)) {
            const Pen pen(out, {}, c.depth > kDeep ? kDeepContact : kContact);
            pen.line(c.position, c.position + c.normal * settings.normal);
        }
    return out;
}

}  // namespace kiln::physics
