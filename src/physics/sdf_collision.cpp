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
constexpr float kFlat = 2e-6f;    // of the body's radius: a step that promises less is at most 0.1 degrees of a turn
constexpr float kAlike =
    0.9f;  // cosine: starts that the field faces so like a place already found lead there, after kSure descents
constexpr size_t kSure = 2;
constexpr int kShellSteps = 8;
// Of the distance of shell points: a step that gains less ends a walk. What is at least half as thick as it is wide rolls on what stands:
// with its lowest point, to a fortieth of that distance, it neither sinks nor is slowed.
constexpr float kEnoughRolling = 1e-5f, kEnoughOtherwise = 1e-3f, kThick = 0.5f;
constexpr size_t kMostSeeds = 9;      // as many as ProgramField asks at once
constexpr int kBisections = 6;        // of an edge that leaves the solid: to 1/64 of its length
constexpr float kTouch = 0.25f;       // of the margin: apart by no more counts as lying on it
constexpr size_t kAlong = 7;          // points looked at on an edge whose ends do not touch
constexpr float kSteep = 0.8f;        // gradients above are of one place of the surface
constexpr float kLeastSlope = 0.25f;  // gradients below are not trusted to tell how far the surface is

struct Probe {
    vec3 p;       // in the field
    float depth;  // -distance / |gradient|
    vec3 normal;  // unit
};

// Whether a gradient of this length tells a direction.
bool tells_way(float slope) { return slope > 1e-4f && slope < std::numeric_limits<float>::infinity(); }

// From a distance and a gradient. `otherwise` is the normal where there is none.
Probe probe(vec3 p, float d, vec3 g, vec3 otherwise) {
    const float slope = length(g);
    if (!tells_way(slope)) return {p, -d, otherwise};
    return {p, -d / std::max(slope, kLeastSlope), g / slope};
}

// A body over a field: points in the body's frame, answers in the field's.
struct Over {
    Over(const field::SdfField& over, const Convex& of, const Pose& pose)
        : field(over),
          body(of),
          radius(outer_radius(of)),
          center(pose.position),
          x(rotate(pose.rotation, {1, 0, 0})),
          y(rotate(pose.rotation, {0, 1, 0})),
          z(rotate(pose.rotation, {0, 0, 1})) {}
    const field::SdfField& field;
    const Convex& body;
    float radius;
    vec3 center, x, y, z;  // the body's axes in the field
    field::SdfField::Trail trail;

    vec3 place(vec3 local) const { return center + x * local.x + y * local.y + z * local.z; }
    vec3 into(vec3 direction) const { return {dot(x, direction), dot(y, direction), dot(z, direction)}; }
    Probe at(vec3 local, vec3 otherwise) {
        vec3 g;
        const vec3 p = place(local);
        const float d = field.distance(p, g, trail);
        return probe(p, d, g, otherwise);
    }
    // Many at once.
    template <size_t N>
    void at(const std::array<vec3, N>& local, size_t count, vec3 otherwise, std::array<Probe, N>& out) {
        std::array<vec3, N> p, g;
        std::array<float, N> d;
        for (size_t i = 0; i < count; ++i) p[i] = place(local[i]);
        field.distances(std::span(p.data(), count), d.data(), g.data(), trail);
        for (size_t i = 0; i < count; ++i) out[i] = probe(p[i], d[i], g[i], otherwise);
    }

    struct Lowest {
        vec3 local;
        Probe probe;
    };
    // Projected gradient descent; steps that do not go down are quartered.
    Lowest descend(vec3 local, Probe now) {
        float step = 2 * radius;
        for (int i = 0; i < kDescentSteps; ++i) {
            const vec3 down = into(-now.normal);
            const vec3 next = project(body, local + down * step);
            const float promise = dot(next - local, down);  // what it gains if the field is flat
            if (!(promise > kFlat * radius)) break;
            const Probe there = at(next, now.normal);
            const float gain = there.depth - now.depth;
            if (gain > 0) {
                local = next, now = there;
                if (gain < kEnough * radius) break;
            } else if (promise < kEnough * radius) {
                break;
            } else {
                step *= 0.25f;  // too far: over a ridge, or to the other side of a gap
            }
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

// The corners of the face that looks at the surface, and where its edges leave it. Where its lowest point is none of the corners, also the
// stretches of edges that touch between ends that do not: a plank lies on two beams with lines. Whether all corners touch.
bool add_face(Over& over, const Over::Lowest& low, float margin, Contacts& contacts) {
    std::array<vec3, kMostCorners> corners;
    const size_t n = size_t(face(over.body, over.into(-low.probe.normal), corners));
    if (n < 2) return false;
    std::array<Probe, kMostCorners> probes;
    over.at(corners, n, low.probe.normal, probes);
    // The last point that touches on the way from one that does to one that does not; where values are interpolated, a little before it,
    // so that the exact field finds it touching too.
    const float error = over.field.error(), touch = kTouch * (margin - error);
    const auto last = [&](vec3 in, vec3 out) {
        float inside = 0, outside = 1;
        for (int step = 0; step < kBisections; ++step) {
            const float t = 0.5f * (inside + outside);
            (over.at(in + (out - in) * t, low.probe.normal).depth > -touch ? inside : outside) = t;
        }
        const float back = error / std::max(length(out - in), 1e-6f);
        return over.at(in + (out - in) * std::max(inside - back, 0.0f), low.probe.normal);
    };
    std::array<bool, kMostCorners> in{};
    size_t count = 0;
    bool at_corner = false;
    for (size_t i = 0; i < n; ++i) {
        in[i] = contacts.add(probes[i]);
        count += in[i];
        at_corner = at_corner || length(corners[i] - low.local) < 2 * kSamePlace * over.radius;
    }
    if (count == n) return true;
    // Of a round face two lines across stand for its edges. They are the body's own, so what rests has the same points every step.
    const size_t lines = n == 2 ? 1 : n == 4 ? 4 : 2;
    for (size_t k = 0; k < lines; ++k) {
        const size_t i = n == 8 ? 2 * k : k, j = n == 8 ? i + 4 : (k + 1) % n;
        if (in[i] && in[j]) continue;
        if (in[i] || in[j]) {
            if (n <= 4) contacts.add(in[i] ? last(corners[i], corners[j]) : last(corners[j], corners[i]));
            continue;
        }
        if (at_corner) continue;
        std::array<vec3, kAlong> points;
        std::array<Probe, kAlong> found;
        for (size_t p = 0; p < kAlong; ++p)
            points[p] = corners[i] + (corners[j] - corners[i]) * (float(p + 1) / float(kAlong + 1));
        over.at(points, kAlong, low.probe.normal, found);
        const auto touches = [&](size_t p) { return p < kAlong && found[p].depth > -touch; };
        for (size_t p = 0; p < kAlong; ++p)
            if (touches(p) && !(touches(p - 1) && touches(p + 1))) contacts.add(found[p]);  // ends of a stretch
    }
    return false;
}

}  // namespace

void collide(const field::SdfField& field, const Convex& body, const Pose& field_from_body, float margin,
             std::vector<FieldContact>& out) {
    out.clear();
    Over over(field, body, field_from_body);
    vec3 gradient;
    const float center = field.distance(over.center, gradient, over.trail);
    if (center > over.radius + margin) return;  // 1-Lipschitz: nothing within reach
    Contacts contacts(out, margin, kSamePlace * over.radius);
    const vec3 up{0, 1, 0};
    const auto from = starts(body);
    // A ball's lowest point is as far below its centre's value as its radius, wherever one place of the surface is the nearest. (Blends
    // and interpolation flatten slopes, but where several places are near they vanish.)
    constexpr size_t count = kStarts;
    if (body.kind == Convex::Kind::Sphere) {
        const Over::Lowest low = over.descend({}, probe(over.center, center, gradient, up));
        const float slope = length(gradient), deep = slope > kSteep ? -center / slope : -center;
        if (low.probe.depth > over.radius + deep - kSamePlace * over.radius) {
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
        if (add_face(over, low, margin, contacts)) flat[flats++] = low.probe.normal;
    }
}

void measure(const SdfShape& shape, float margin, std::vector<FieldContact>& contacts) {
    std::array<vec3, kMostContacts> p, g;
    std::array<float, kMostContacts> d;
    field::SdfField::Trail trail;
    const size_t count = contacts.size();
    for (size_t i = 0; i < count; ++i) p[i] = contacts[i].point;
    shape.bricks().measure(std::span(p.data(), count), d.data(), g.data(), trail);
    for (size_t i = 0; i < count; ++i) {
        const Probe at = probe(p[i], d[i], g[i], contacts[i].normal);
        contacts[i] = {at.p, at.normal, std::min(at.depth, kMostDepth)};
    }
    std::erase_if(contacts, [&](const FieldContact& c) { return !(c.depth > -margin); });
}

void collide(const SdfShape& shape, const Convex& body, const Pose& shape_from_body, float margin,
             std::vector<FieldContact>& out) {
    collide(shape.bricks(), body, shape_from_body, margin + shape.bricks().error(), out);
    if (&shape.bricks() == &shape.field() || out.empty()) return;
    measure(shape, margin, out);
    if (body.kind != Convex::Kind::Sphere) return;
    settle_ball(shape, shape_from_body.position, body.size.x, margin, out);
}

// A ball's lowest point lies where the exact normal says: the facets of voxels would have it roll by steps, and sink into hollows that
// are hardly larger than it.
void settle_ball(const SdfShape& shape, vec3 center, float radius, float margin, std::vector<FieldContact>& out) {
    thread_local std::vector<FieldContact> one, settled;
    settled.clear();
    for (const FieldContact& c : out) {
        one.assign(1, c);
        for (int i = 0; i < kDescentSteps; ++i) {
            const FieldContact before = one.front();
            one.front().point = center - before.normal * radius;
            measure(shape, margin, one);
            const float gain = one.empty() ? -1 : one.front().depth - before.depth;
            if (!(gain > 0)) one.assign(1, before);
            if (!(gain > kEnough * radius)) break;
        }
        const FieldContact& now = one.front();
        const bool known = std::any_of(settled.begin(), settled.end(), [&](const FieldContact& o) {
            return length(o.point - now.point) < kSamePlace * radius && dot(o.normal, now.normal) > kSameNormal;
        });
        if (!known) settled.push_back(now);
    }
    out.assign(settled.begin(), settled.end());
}

namespace {

// A surface point of one of two shapes that may be in touch.
struct Seed {
    vec3 p;  // in the other's field
    float distance;
};

// The lowest points of groups of `shell` that come within reach of `other`, spread over where they touch: from each of them contacts are
// looked for. `few` is how many there may be. Asked in batches of what leads the walk from there: short fields are worth more lanes than
// one, and need no bricks.
void find_seeds(const SdfShape& shell, const SdfShape& other, const Pose& other_from_shell, float reach, size_t few,
                std::vector<Seed>& out) {
    constexpr int kBatch = 192;
    std::array<float, kBatch> x, y, z, d;
    std::array<const SdfShape::Group*, kBatch> whose;
    thread_local std::vector<const SdfShape::Group*> near;
    int count = 0;
    const auto put = [&](vec3 p) {
        x[size_t(count)] = p.x, y[size_t(count)] = p.y, z[size_t(count)] = p.z;
        ++count;
    };
    const auto ask = [&] { other.slope().distances({x.data(), y.data(), z.data(), count}, d.data()); };
    near.clear();
    out.clear();
    const Box3 box = other.bounds().inflated(reach);
    const auto rule_out = [&] {
        ask();
        for (int i = 0; i < count; ++i)
            if (!(d[size_t(i)] > whose[size_t(i)]->radius + reach)) near.push_back(whose[size_t(i)]);
        count = 0;
    };
    for (const SdfShape::Group& g : shell.groups()) {
        const vec3 center = other_from_shell * g.center;
        if (!box.inflated(g.radius).contains(center)) continue;
        whose[size_t(count)] = &g;
        put(center);
        if (count == kBatch) rule_out();
    }
    if (count > 0) rule_out();
    for (size_t first = 0; first < near.size();) {
        size_t last = first;
        for (; last < near.size() && count + near[last]->count <= kBatch; ++last)
            for (int i = 0; i < near[last]->count; ++i) put(other_from_shell * shell.point(near[last]->first + i));
        ask();
        size_t from = 0;
        for (; first < last; ++first) {
            const size_t to = from + size_t(near[first]->count);
            const size_t low =
                size_t(std::min_element(d.begin() + std::ptrdiff_t(from), d.begin() + std::ptrdiff_t(to)) - d.begin());
            if (d[low] < reach) out.push_back({{x[low], y[low], z[low]}, d[low]});
            from = to;
        }
        count = 0;
    }
    if (out.size() <= few) return;
    // The deepest, and then those farthest from all that were taken.
    std::iter_swap(out.begin(), std::min_element(out.begin(), out.end(),
                                                 [](const Seed& a, const Seed& b) { return a.distance < b.distance; }));
    for (size_t taken = 1; taken < few; ++taken) {
        size_t best = taken;
        float farthest = -1;
        for (size_t i = taken; i < out.size(); ++i) {
            float nearest = std::numeric_limits<float>::infinity();
            for (size_t k = 0; k < taken; ++k) {
                const vec3 between = out[i].p - out[k].p;
                nearest = std::min(nearest, dot(between, between));
            }
            if (nearest > farthest) farthest = nearest, best = i;
        }
        std::swap(out[taken], out[best]);
    }
    out.resize(few);
}

// One that is in the other with its middle may have surface on all sides that is pushed out, each its own way, and would be held there. Then
// it goes out whole, the way its middle does. So do two that move and cross each other (rods, an arm through an arm): away from each other.
void push_out_whole(const SdfShape& a, const SdfShape& b, const Pose& b_from_a, std::vector<FieldContact>& contacts) {
    vec3 middle = b_from_a * a.mass().center, way;
    if (b.field().distance(middle, way) > 0) {
        if (!b.moves()) return;
        const vec3 of_a = middle;
        middle = b.mass().center;
        if (a.field().distance(inverse(b_from_a) * middle, way) > 0) {
            way = of_a - middle;
            middle = contacts.front().point;
        } else {
            way = -rotate(b_from_a.rotation, way);
        }
    }
    const float slope = length(way);
    const bool agree =
        std::all_of(contacts.begin(), contacts.end(), [&](const FieldContact& c) { return dot(c.normal, way) > 0; });
    if (tells_way(slope) && !agree) contacts.assign(1, {middle, way / slope, kMostDepth});
}

}  // namespace

void collide(const SdfShape& a, const SdfShape& b, const Pose& b_from_a, float margin, std::vector<FieldContact>& out) {
    out.clear();
    struct Candidate {
        FieldContact contact;
        bool of_a;
    };
    thread_local std::vector<Candidate> found;
    thread_local std::vector<Seed> seeds;
    thread_local std::vector<FieldContact> met;
    found.clear();
    // Seeds of `shell` in `other`'s field, walked along shell's own surface to where they are deepest.
    const auto gather = [&](const SdfShape& shell, const SdfShape& other, const Pose& other_from_shell, bool of_a) {
        const Pose shell_from_other = inverse(other_from_shell);
        // What a field itself says needs no second look.
        const bool exact = &other.slope() == &other.field();
        const float reach = margin + (exact ? 0 : other.bricks().error());
        find_seeds(shell, other, other_from_shell, margin + other.bricks().error() + 0.5f * shell.spacing(), kMostSeeds,
                   seeds);
        met.clear();
        const size_t count = seeds.size();
        std::array<vec3, kMostSeeds> at, local, slope;
        std::array<float, kMostSeeds> value, step, off;  // off: from the shell's surface, before the last correction
        std::array<Probe, kMostSeeds> now;
        std::array<size_t, kMostSeeds> going;  // numbers of the seeds that still walk
        size_t walking = count;
        const vec3 half = shell.bounds().half_extents();
        const bool rolls = !other.moves() && float(shell.inner_radius()) > kThick * std::max({half.x, half.y, half.z});
        const float enough = (rolls ? kEnoughRolling : kEnoughOtherwise) * shell.spacing();
        const auto look = [&](const field::SdfField& field, const std::array<vec3, kMostSeeds>& points, size_t n) {
            field.distances(std::span(points.data(), n), value.data(), slope.data());
        };
        for (size_t i = 0; i < count; ++i) at[i] = seeds[i].p;
        look(other.slope(), at, count);
        for (size_t i = 0; i < count; ++i) {
            now[i] = probe(at[i], value[i], slope[i], {0, 1, 0});
            step[i] = 2 * float(shell.inner_radius());
            going[i] = i;
        }
        for (int round = 0; round < kShellSteps && walking > 0; ++round) {
            // Down the other field, then back onto the shell's surface.
            for (size_t k = 0; k < walking; ++k) {
                const Probe& p = now[going[k]];
                local[k] = shell_from_other * (p.p - p.normal * step[going[k]]);
            }
            for (int back = 0; back < 2; ++back) {
                look(shell.slope(), local, walking);
                for (size_t k = 0; k < walking; ++k) {
                    off[k] = std::abs(value[k]);
                    const float slope2 = dot(slope[k], slope[k]);
                    if (slope2 > 1e-6f) local[k] = local[k] - slope[k] * (value[k] / std::max(slope2, kLeastSlope));
                }
            }
            for (size_t k = 0; k < walking; ++k) at[k] = other_from_shell * local[k];
            look(other.slope(), at, walking);
            size_t still = 0;
            for (size_t k = 0; k < walking; ++k) {
                const size_t i = going[k];
                const Probe there = probe(at[k], value[k], slope[k], now[i].normal);
                // Where values are mere bounds, a long step may not find back.
                const bool found_back = off[k] < 0.5f * shell.spacing();
                const float gain = found_back ? there.depth - now[i].depth : -shell.spacing();
                if (gain > 0) now[i] = there;
                if (gain < 0) step[i] *= 0.3f;
                if (!(std::abs(gain) < enough)) going[still++] = i;
            }
            walking = still;
        }
        for (size_t i = 0; i < count; ++i)
            if (now[i].depth > -reach) met.push_back({now[i].p, now[i].normal, std::min(now[i].depth, kMostDepth)});
        if (!exact && !met.empty()) measure(other, margin, met);
        for (FieldContact c : met) {
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
    if (!out.empty() && !(out.front().depth < kMostDepth)) push_out_whole(a, b, b_from_a, out);
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
            return FieldHit{f, p, tells_way(slope) ? n / slope : way * (-1 / size)};
        }
        f += d / size;
    }
    return std::nullopt;
}

std::optional<FieldHit> sweep(const field::SdfField& field, const Convex& body, const Pose& field_from_body, vec3 way,
                              float most) {
    const float size = length(way);
    if (!(size > 0)) return std::nullopt;
    Over here(field, body, field_from_body);
    const auto from = starts(body);
    const bool ball = body.kind == Convex::Kind::Sphere;
    const float near = 1e-4f * here.radius + 1e-5f;
    float f = 0;
    for (int i = 0; i < 256 && f <= most; ++i) {
        here.center = field_from_body.position + way * f;
        // Far off one question is enough.
        const float center = field.distance(here.center) - here.radius;
        if (center > here.radius) {
            f += center / size;
            continue;
        }
        Over::Lowest low{};
        float lowest = std::numeric_limits<float>::infinity();
        for (size_t s = 0; s < kStarts; ++s) {
            const Over::Lowest found = here.descend(from[s], here.at(from[s], {0, 1, 0}));
            const float d = field.distance(found.probe.p);
            if (d < lowest) lowest = d, low = found;
            if (ball && lowest < center + kSamePlace * here.radius) break;
        }
        if (lowest <= near) {
            if (dot(low.probe.normal, way) < 0) return FieldHit{f, low.probe.p, low.probe.normal};
            // In touch but leaving: go on until it is clear.
            f += std::max(near, 0.05f * here.radius) / size;
            continue;
        }
        f += lowest / size;
    }
    return std::nullopt;
}

}  // namespace kiln::physics
