// SPDX-License-Identifier: MIT

#include "physics/sdf_collision.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace kiln::physics {

namespace {

constexpr int kDescentSteps = 12;
constexpr float kEnough = 2e-4f;  // of the body's radius: a step that gains or loses less ends a descent
constexpr float kAlike =
    0.9f;  // cosine: starts that the field faces so like a place already found lead there, after kSure descents
constexpr size_t kSure = 2;
constexpr int kShellSteps = 8;
constexpr int kBisections = 6;         // of an edge that leaves the solid: to 1/64 of its length
constexpr float kSamePlace = 0.02f;    // of the body's radius: two contacts nearer than that are one
constexpr float kSameNormal = 0.996f;  // cosine of 5 degrees
constexpr float kLeastSlope = 0.25f;   // gradients below are not trusted to tell how far the surface is

struct Probe {
    vec3 p;       // in the field
    float depth;  // -distance / |gradient|
    vec3 normal;  // unit
};

// From a distance and a gradient. `otherwise` is the normal where there is none.
Probe probe(vec3 p, float d, vec3 g, vec3 otherwise) {
    const float slope = length(g);
    if (!(slope > 1e-4f)) return {p, -d, otherwise};
    return {p, -d / std::max(slope, kLeastSlope), g / slope};
}

Probe probe(const field::SdfField& field, vec3 p, vec3 otherwise) {
    vec3 g;
    const float d = field.distance(p, g);
    return probe(p, d, g, otherwise);
}

// A body over a field: points in the body's frame, answers in the field's.
struct Over {
    const field::SdfField& field;
    const Convex& body;
    const Pose& pose;
    float radius;
    Probe at(vec3 local, vec3 otherwise) const { return probe(field, pose * local, otherwise); }
    // Many at once.
    template <size_t N>
    void at(const std::array<vec3, N>& local, size_t count, vec3 otherwise, std::array<Probe, N>& out) const {
        std::array<vec3, N> p, g;
        std::array<float, N> d;
        for (size_t i = 0; i < count; ++i) p[i] = pose * local[i];
        field.distances(std::span(p.data(), count), d.data(), g.data());
        for (size_t i = 0; i < count; ++i) out[i] = probe(p[i], d[i], g[i], otherwise);
    }

    struct Lowest {
        vec3 local;
        Probe probe;
    };
    // Projected gradient descent; steps that do not go down are quartered.
    Lowest descend(vec3 local, Probe now) const {
        float step = 2 * radius;
        for (int i = 0; i < kDescentSteps; ++i) {
            const vec3 next = project(body, local - direction_into(pose, now.normal) * step);
            const vec3 move = next - local;
            if (dot(move, move) < 1e-8f * radius * radius) break;
            const Probe there = at(next, now.normal);
            const float gain = there.depth - now.depth;
            if (gain > 0) {
                local = next, now = there;
            } else {
                step *= 0.25f;
            }
            if (std::abs(gain) < kEnough * radius) break;
        }
        return {local, now};
    }
};

class Contacts {
public:
    Contacts(std::vector<FieldContact>& out, float margin, float apart)
        : out_(out), margin_(margin), apart2_(apart * apart) {}
    // Whether it is near enough to count; of two at one place the deeper stays.
    bool add(const Probe& p) {
        if (!(p.depth > -margin_)) return false;
        for (FieldContact& c : out_) {
            const vec3 between = c.point - p.p;
            if (dot(between, between) > apart2_ || dot(c.normal, p.normal) < kSameNormal) continue;
            if (p.depth > c.depth) c = made(p);
            return true;
        }
        if (out_.size() < kMostContacts) out_.push_back(made(p));
        return true;
    }

private:
    static FieldContact made(const Probe& p) { return {p.p, p.normal, std::min(p.depth, kMostDepth)}; }
    std::vector<FieldContact>& out_;
    float margin_, apart2_;
};

// The corners of the face that looks at the surface, and where its edges leave it.
int add_face(const Over& over, const Probe& lowest, float margin, Contacts& contacts) {
    std::array<vec3, kMostCorners> corners;
    const size_t n = size_t(face(over.body, direction_into(over.pose, -lowest.normal), corners));
    if (n < 2) return 0;
    std::array<Probe, kMostCorners> probes;
    over.at(corners, n, lowest.normal, probes);
    std::array<bool, kMostCorners> in{};
    int count = 0;
    for (size_t i = 0; i < n; ++i) {
        in[i] = contacts.add(probes[i]);
        count += in[i];
    }
    const size_t edges = n == 2 ? 1 : n;
    for (size_t i = 0; i < edges && n <= 4; ++i) {
        const size_t j = (i + 1) % n;
        if (in[i] == in[j]) continue;
        float inside = in[i] ? 0.0f : 1.0f, outside = 1 - inside;
        Probe edge = probes[in[i] ? i : j];
        for (int step = 0; step < kBisections; ++step) {
            const float t = 0.5f * (inside + outside);
            const Probe middle = over.at(corners[i] + (corners[j] - corners[i]) * t, lowest.normal);
            if (middle.depth > -margin) {
                inside = t, edge = middle;
            } else {
                outside = t;
            }
        }
        count += contacts.add(edge);
    }
    return count;
}

}  // namespace

void collide(const field::SdfField& field, const Convex& body, const Pose& field_from_body, float margin,
             std::vector<FieldContact>& out) {
    out.clear();
    const Over over{field, body, field_from_body, outer_radius(body)};
    vec3 gradient;
    const float center = field.distance(field_from_body.position, gradient);
    if (center > over.radius + margin) return;  // 1-Lipschitz: nothing within reach
    Contacts contacts(out, margin, kSamePlace * over.radius);
    const vec3 up{0, 1, 0};
    const auto from = starts(body);
    // A ball's lowest point is as far below its centre's value as its radius, wherever one place of the surface is the nearest.
    constexpr size_t count = kStarts;
    if (body.kind == Convex::Kind::Sphere) {
        const Over::Lowest low = over.descend({}, probe(field_from_body.position, center, gradient, up));
        if (low.probe.depth > over.radius - center - kSamePlace * over.radius) {
            contacts.add(low.probe);
            return;
        }
    }
    std::array<Probe, kStarts> first;
    std::array<size_t, kStarts> order{};
    over.at(from, count, up, first);
    for (size_t i = 0; i < count; ++i) order[i] = i;
    std::sort(order.begin(), order.end(), [&](size_t a, size_t b) {
        return first[a].depth != first[b].depth ? first[a].depth > first[b].depth : a < b;
    });
    std::array<vec3, kStarts> flat, seen;  // normals of places that a face already covers, and of all that were found
    size_t flats = 0, descents = 0;
    const auto like = [](const std::array<vec3, kStarts>& normals, size_t n, vec3 normal, float cosine) {
        return std::any_of(normals.begin(), normals.begin() + std::ptrdiff_t(n),
                           [&](vec3 m) { return dot(m, normal) > cosine; });
    };
    for (size_t i = 0; i < count; ++i) {
        const Probe& start = first[order[i]];
        if (like(flat, flats, start.normal, kSameNormal)) continue;
        if (descents >= kSure && like(seen, descents, start.normal, kAlike)) continue;
        const Over::Lowest low = over.descend(from[order[i]], start);
        seen[descents++] = low.probe.normal;
        if (!contacts.add(low.probe)) continue;
        if (add_face(over, low.probe, margin, contacts) >= 3) flat[flats++] = low.probe.normal;
    }
}

void collide(const SdfShape& a, const SdfShape& b, const Pose& b_from_a, float margin, std::vector<FieldContact>& out) {
    out.clear();
    struct Candidate {
        FieldContact contact;
        bool of_a;
    };
    std::vector<Candidate> found;
    std::array<float, 64> x, y, z, d;
    // Points of `shell` in `other`'s field, walked along shell's own surface to where they are deepest.
    const auto gather = [&](const SdfShape& shell, const SdfShape& other, const Pose& other_from_shell, bool of_a) {
        const Pose shell_from_other = inverse(other_from_shell);
        const float reach = margin + 0.5f * shell.spacing();
        for (const SdfShape::Group& g : shell.groups()) {
            if (other.field().distance(other_from_shell * g.center) > g.radius + reach) continue;
            for (int i = 0; i < g.count; ++i) {
                const vec3 p = other_from_shell * shell.point(g.first + i);
                x[size_t(i)] = p.x, y[size_t(i)] = p.y, z[size_t(i)] = p.z;
            }
            other.field().distances({x.data(), y.data(), z.data(), g.count}, d.data());
            int lowest = 0;
            for (int i = 1; i < g.count; ++i)
                if (d[size_t(i)] < d[size_t(lowest)]) lowest = i;
            if (!(d[size_t(lowest)] < reach)) continue;
            Probe now = probe(other.field(), {x[size_t(lowest)], y[size_t(lowest)], z[size_t(lowest)]}, {0, 1, 0});
            float step = 2 * float(shell.inner_radius());
            for (int i = 0; i < kShellSteps; ++i) {
                // Down the other field, then back onto the shell's surface.
                vec3 local = shell_from_other * (now.p - now.normal * step);
                for (int back = 0; back < 2; ++back) {
                    vec3 n;
                    const float value = shell.field().distance(local, n);
                    const float slope2 = dot(n, n);
                    if (slope2 > 1e-6f) local = local - n * (value / std::max(slope2, kLeastSlope));
                }
                const Probe there = probe(other.field(), other_from_shell * local, now.normal);
                const float gain = there.depth - now.depth;
                if (gain > 0) now = there;
                if (std::abs(gain) < 1e-3f * shell.spacing()) break;
                if (gain < 0) {
                    step *= 0.3f;
                }
            }
            if (!(now.depth > -margin)) continue;
            FieldContact c{now.p, now.normal, std::min(now.depth, kMostDepth)};
            if (!of_a) {
                // From a's frame to b's. The point was on b; what is asked for is the point of a opposite to it.
                c = {b_from_a * (c.point + c.normal * c.depth), -rotate(b_from_a.rotation, c.normal), c.depth};
            }
            found.push_back({c, of_a});
        }
    };
    gather(a, b, b_from_a, true);
    gather(b, a, inverse(b_from_a), false);
    std::stable_sort(found.begin(), found.end(),
                     [](const Candidate& p, const Candidate& q) { return p.contact.depth > q.contact.depth; });
    const float apart = 2 * std::min(a.moves() ? a.spacing() : b.spacing(), b.moves() ? b.spacing() : a.spacing());
    for (const Candidate& c : found) {
        const bool known = std::any_of(out.begin(), out.end(), [&](const FieldContact& o) {
            return length(o.point - c.contact.point) < apart && dot(o.normal, c.contact.normal) > 0.8f;
        });
        if (known) continue;
        out.push_back(c.contact);
        if (out.size() == kMostContacts) break;
    }
}

std::optional<FieldHit> cast_ray(const field::SdfField& field, vec3 origin, vec3 way, float most) {
    const float size = length(way);
    if (!(size > 0)) return std::nullopt;
    const float near = 1e-5f * (1 + length(origin) * 0.1f);
    float f = 0;
    for (int i = 0; i < 512 && f <= most; ++i) {
        const vec3 p = origin + way * f;
        const float d = field.distance(p);
        if (d <= near) {
            vec3 n;
            (void)field.distance(p, n);
            const float slope = length(n);
            return FieldHit{f, p, slope > 1e-4f ? n / slope : way * (-1 / size)};
        }
        f += d / size;
    }
    return std::nullopt;
}

std::optional<FieldHit> sweep(const field::SdfField& field, const Convex& body, const Pose& field_from_body, vec3 way,
                              float most) {
    const float size = length(way);
    if (!(size > 0)) return std::nullopt;
    Over over{field, body, field_from_body, outer_radius(body)};
    Pose pose = field_from_body;
    const auto from = starts(body);
    const bool ball = body.kind == Convex::Kind::Sphere;
    const float near = 1e-4f * over.radius + 1e-5f;
    float f = 0;
    for (int i = 0; i < 256 && f <= most; ++i) {
        pose.position = field_from_body.position + way * f;
        // Far off one question is enough.
        const float center = field.distance(pose.position) - over.radius;
        if (center > over.radius) {
            f += center / size;
            continue;
        }
        const Over here{field, body, pose, over.radius};
        Over::Lowest low{};
        float lowest = std::numeric_limits<float>::infinity();
        for (size_t s = 0; s < kStarts; ++s) {
            const Over::Lowest found = here.descend(from[s], here.at(from[s], {0, 1, 0}));
            const float d = field.distance(found.probe.p);
            if (d < lowest) lowest = d, low = found;
            if (ball && lowest < center + kSamePlace * over.radius) break;
        }
        if (lowest <= near) {
            if (dot(low.probe.normal, way) < 0) return FieldHit{f, low.probe.p, low.probe.normal};
            // In touch but leaving: go on until it is clear.
            f += std::max(near, 0.05f * over.radius) / size;
            continue;
        }
        f += lowest / size;
    }
    return std::nullopt;
}

}  // namespace kiln::physics
