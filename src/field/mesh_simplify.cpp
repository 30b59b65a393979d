// SPDX-License-Identifier: MIT
// Garland and Heckbert, "Surface Simplification Using Quadric Error Metrics", 1997, moving one end of an edge onto the other. Which
// collapses keep a manifold: Dey, Edelsbrunner, Guha and Nekhayev, "Topology Preserving Edge Contraction", 1999: the ends
// have no common neighbours but the two across the edge's triangles.
#include "field/mesh_simplify.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <queue>

namespace kiln::field {
namespace {

constexpr uint32_t kEnd = UINT32_MAX;
constexpr double kBorderWeight = 10;  // of a border between parts, beside the surface itself
// Where nothing is lost, as on planes, short edges go first: else one corner takes all others to itself, each collapse looks at all
// of its triangles, and what is left are slivers. Of a squared length beside squared distances: below what a bend of 1/100 costs.
constexpr double kShortFirst = 1e-6;
constexpr float kLeastTurn = 0.2f;  // cosine: no triangle turns further in one collapse

dvec3 operator+(dvec3 a, dvec3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
dvec3 operator-(dvec3 a, dvec3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
dvec3 operator/(dvec3 a, double s) { return {a.x / s, a.y / s, a.z / s}; }
dvec3 cross(dvec3 a, dvec3 b) { return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }
double dot(dvec3 a, dvec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
dvec3 precise(vec3 v) { return {double(v.x), double(v.y), double(v.z)}; }

// Sum of weighted squared distances to planes, and the weights.
struct Quadric {
    double xx = 0, xy = 0, xz = 0, yy = 0, yz = 0, zz = 0, x = 0, y = 0, z = 0, one = 0, weight = 0;

    void add(dvec3 n, double offset, double w) {
        xx += w * n.x * n.x, xy += w * n.x * n.y, xz += w * n.x * n.z;
        yy += w * n.y * n.y, yz += w * n.y * n.z, zz += w * n.z * n.z;
        x += w * n.x * offset, y += w * n.y * offset, z += w * n.z * offset;
        one += w * offset * offset;
        weight += w;
    }
    void add(const Quadric& q) {
        xx += q.xx, xy += q.xy, xz += q.xz, yy += q.yy, yz += q.yz, zz += q.zz;
        x += q.x, y += q.y, z += q.z, one += q.one, weight += q.weight;
    }
    double at(dvec3 p) const {
        const double v = p.x * (xx * p.x + 2 * (xy * p.y + xz * p.z + x)) + p.y * (yy * p.y + 2 * (yz * p.z + y)) +
                         p.z * (zz * p.z + 2 * z) + one;
        return std::max(v, 0.0);
    }
};

struct Collapse {
    double cost;
    uint32_t from, to, from_age, to_age;
    // The least cost comes first; equal costs in order of vertices.
    friend bool operator<(const Collapse& a, const Collapse& b) {
        return a.cost != b.cost ? a.cost > b.cost : a.from != b.from ? a.from > b.from : a.to > b.to;
    }
};

class Simplifier {
public:
    Simplifier(std::span<const vec3> positions, std::vector<uint32_t>& triangles, const std::vector<uint32_t>& parts)
        : positions_(positions),
          triangles_(triangles),
          parts_(parts),
          head_(positions.size(), kEnd),
          next_(triangles.size(), kEnd),
          age_(positions.size()),
          mark_(positions.size()),
          quadrics_(positions.size()) {
        for (const uint32_t v : triangles) middle_ = middle_ + precise(positions[v]) / double(triangles.size());
        for (uint32_t c = uint32_t(triangles.size()); c-- > 0;) {
            next_[c] = head_[triangles[c]];
            head_[triangles[c]] = c;
        }
        for (uint32_t c = 0; c < triangles.size(); c += 3) add_planes(c);
        for (uint32_t c = 0; c < triangles.size(); ++c) {
            const uint32_t a = triangles[c], b = triangles[after(c)];
            if (a < b) offer(a, b);
        }
    }

    void run(size_t target, double error) {
        size_t alive = triangles_.size() / 3;
        while (alive > target && !queue_.empty()) {
            const Collapse c = queue_.top();
            queue_.pop();
            if (age_[c.from] != c.from_age || age_[c.to] != c.to_age) continue;
            // By what `from` alone stands for: a wide plane beside it would make a small thing's error look small.
            const Quadric& moved = quadrics_[c.from];
            if (moved.at(at(c.to)) > error * error * moved.weight || !allowed(c.from, c.to)) continue;
            collapse(c.from, c.to);
            alive -= 2;
        }
    }

    bool dead(size_t triangle) const { return triangles_[3 * triangle] == kEnd; }

private:
    static uint32_t after(uint32_t corner) { return corner % 3 == 2 ? corner - 2 : corner + 1; }
    static uint32_t before(uint32_t corner) { return corner % 3 == 0 ? corner + 2 : corner - 1; }
    dvec3 at(uint32_t v) const { return precise(positions_[v]) - middle_; }

    // Two other vertices of each triangle around v, in its order.
    template <typename Fn>
    void around(uint32_t v, Fn&& fn) const {
        for (uint32_t c = head_[v]; c != kEnd; c = next_[c]) fn(triangles_[after(c)], triangles_[before(c)]);
    }

    void add_planes(uint32_t corner) {
        const uint32_t v[3] = {triangles_[corner], triangles_[corner + 1], triangles_[corner + 2]};
        const dvec3 p[3] = {at(v[0]), at(v[1]), at(v[2])};
        const dvec3 n = cross(p[1] - p[0], p[2] - p[0]);
        const double size = std::sqrt(dot(n, n));
        if (!(size > 0)) return;
        const dvec3 unit = n / size;
        for (const uint32_t i : v) quadrics_[i].add(unit, -dot(unit, p[0]), size / 2);
        for (uint32_t k = 0; k < 3; ++k) {
            const uint32_t a = v[k], b = v[(k + 1) % 3];
            if (!is_border(a, b, parts_[corner / 3])) continue;
            const dvec3 along = p[(k + 1) % 3] - p[k];
            const double squared = dot(along, along);
            const dvec3 side = cross(along, unit) / std::sqrt(squared);
            for (const uint32_t i : {a, b}) quadrics_[i].add(side, -dot(side, p[k]), kBorderWeight * squared);
        }
    }
    // Whether the triangle on the other side of a→b is of another part.
    bool is_border(uint32_t a, uint32_t b, uint32_t part) const {
        for (uint32_t c = head_[b]; c != kEnd; c = next_[c])
            if (triangles_[after(c)] == a) return parts_[c / 3] != part;
        return true;
    }

    void offer(uint32_t a, uint32_t b) {
        Quadric q = quadrics_[a];
        q.add(quadrics_[b]);
        const double to_a = q.at(at(a)), to_b = q.at(at(b));
        if (to_a < to_b || (to_a == to_b && a < b)) std::swap(a, b);
        const dvec3 edge = at(b) - at(a);
        const double length = kShortFirst * dot(edge, edge) * q.weight;
        queue_.push({std::min(to_a, to_b) + length, a, b, age_[a], age_[b]});
    }

    bool allowed(uint32_t from, uint32_t to) {
        // Rings must be closed, and meet in two vertices alone.
        ++stamp_;
        uint32_t across[2] = {kEnd, kEnd};
        int triangles = 0, ring = 0, opposite = 0;
        around(to, [&](uint32_t a, uint32_t b) {
            mark_[a] = mark_[b] = stamp_;
            if (a == from || b == from) {
                if (triangles < 2) across[triangles] = a == from ? b : a;
                ++triangles;
            }
            ++ring;
        });
        if (triangles != 2 || !is_ring(to, ring)) return false;
        int common = 0, size = 0;
        bool turned = false, facing = false;
        around(from, [&](uint32_t a, uint32_t b) {
            ++size;
            common += mark_[a] == stamp_;  // each neighbour is once the first of a pair
            if (a == to || b == to) return;
            facing = facing || ((a == across[0] || a == across[1]) && (b == across[0] || b == across[1]));
            const dvec3 n = cross(at(a) - at(from), at(b) - at(from)), m = cross(at(a) - at(to), at(b) - at(to));
            turned = turned || !(dot(n, m) > double(kLeastTurn) * std::sqrt(dot(n, n) * dot(m, m)));
        });
        if (common != 2 || turned || !is_ring(from, size)) return false;
        around(to, [&](uint32_t a, uint32_t b) {
            opposite += (a == across[0] || a == across[1]) && (b == across[0] || b == across[1]);
        });
        return !(facing && opposite > 0);  // a tetrahedron would fold flat
    }
    // Whether the neighbours first in their pairs are the same as those second in them.
    bool is_ring(uint32_t v, int size) const {
        uint64_t first = 0, second = 0, firsts = 0, seconds = 0;
        around(v, [&](uint32_t a, uint32_t b) { first ^= a, second ^= b, firsts += a, seconds += b; });
        return size >= 3 && first == second && firsts == seconds;
    }

    void collapse(uint32_t from, uint32_t to) {
        quadrics_[to].add(quadrics_[from]);
        for (uint32_t c = head_[from], following; c != kEnd; c = following) {
            following = next_[c];
            if (triangles_[after(c)] == to || triangles_[before(c)] == to) {
                const uint32_t first = c - c % 3;
                for (uint32_t k = first; k < first + 3; ++k)
                    if (k != c) unlink(triangles_[k], k);
                for (uint32_t k = first; k < first + 3; ++k) triangles_[k] = kEnd;
                continue;
            }
            triangles_[c] = to;
            next_[c] = head_[to];
            head_[to] = c;
        }
        head_[from] = kEnd;
        ++age_[from];
        ++age_[to];
        ring_.clear();
        around(to, [&](uint32_t a, uint32_t) { ring_.push_back(a); });
        for (const uint32_t v : ring_) offer(to, v);
    }
    void unlink(uint32_t v, uint32_t corner) {
        uint32_t* link = &head_[v];
        while (*link != corner) link = &next_[*link];
        *link = next_[corner];
    }

    std::span<const vec3> positions_;
    std::vector<uint32_t>& triangles_;  // kEnd where collapsed
    const std::vector<uint32_t>& parts_;
    std::vector<uint32_t> head_, next_;  // corners of each vertex
    std::vector<uint32_t> age_, mark_, ring_;
    std::vector<Quadric> quadrics_;  // positions from middle_
    std::priority_queue<Collapse> queue_;
    dvec3 middle_;
    uint32_t stamp_ = 0;
};

}  // namespace

void simplify(std::span<const vec3> positions, std::vector<uint32_t>& triangles, std::vector<uint32_t>& parts,
              float share, float error) {
    // `share` is met by triangles; with all of them wanted the error alone decides.
    const size_t target = share < 1 ? size_t(double(triangles.size() / 3) * double(share)) : 0;
    Simplifier simplifier(positions, triangles, parts);
    simplifier.run(target, double(error));
    size_t kept = 0;
    for (size_t t = 0; t < parts.size(); ++t) {
        if (simplifier.dead(t)) continue;
        std::copy_n(triangles.begin() + ptrdiff_t(3 * t), 3, triangles.begin() + ptrdiff_t(3 * kept));
        parts[kept++] = parts[t];
    }
    triangles.resize(3 * kept);
    parts.resize(kept);
}

}  // namespace kiln::field
