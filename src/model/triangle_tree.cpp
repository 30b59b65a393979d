// SPDX-License-Identifier: MIT

#include "model/triangle_tree.h"

#include <algorithm>
#include <cmath>
#include <immintrin.h>
#include <limits>
#include <numbers>
#include <tuple>

namespace kiln::model {
namespace {

typedef int32_t FourInt __attribute__((vector_size(16)));

// A group is far beyond this many of its radii: dipoles are then right to a few parts in a hundred of their own solid angle.
constexpr double kFarRadii = 2.5;

Four all(float v) { return Four{v, v, v, v}; }
Four smaller(Four a, Four b) { return Four(_mm_min_ps(__m128(a), __m128(b))); }
Four larger(Four a, Four b) { return Four(_mm_max_ps(__m128(a), __m128(b))); }
Four dot4(const Four* a, const Four* b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
Four clamp01(Four t) { return smaller(larger(t, Four{}), all(1)); }
Four root(Four a) { return Four(_mm_sqrt_ps(__m128(a))); }

Four magnitude(Four a) { return Four(FourInt(a) & 0x7fffffff); }

// Within 1.2e-5: Abramowitz and Stegun, "Handbook of Mathematical Functions", 1964, 4.4.49. 0 at the origin.
Four angle_of(Four y, Four x) {
    const Four up = magnitude(y), along = magnitude(x);
    const Four r = smaller(up, along) / larger(larger(up, along), all(1e-30f));
    const Four s = r * r;
    Four t = r * (0.9998660f + s * (-0.3302995f + s * (0.1801410f + s * (-0.0851330f + s * 0.0208351f))));
    t = up > along ? std::numbers::pi_v<float> / 2 - t : t;
    t = x < Four{} ? std::numbers::pi_v<float> - t : t;
    return y < Four{} ? -t : t;
}

// Squared length of p - t * e.
Four off_edge(const Four* p, const Four* e, Four inverse) {
    const Four t = clamp01(dot4(p, e) * inverse);
    const Four q[3] = {p[0] - t * e[0], p[1] - t * e[1], p[2] - t * e[2]};
    return dot4(q, q);
}

}  // namespace

TriangleTree::TriangleTree(std::span<const vec3> positions, std::span<const Face> faces)
    : positions_(positions), faces_(faces) {
    if (faces.empty()) return;
    std::vector<uint32_t> order(faces.size());
    middles_.resize(faces.size());
    for (uint32_t f = 0; f < faces.size(); ++f) {
        order[f] = f;
        const vec3 a = positions[faces[f][0]], b = positions[faces[f][1]], c = positions[faces[f][2]];
        middles_[f] = min(a, min(b, c)) + max(a, max(b, c));
    }
    Group group;
    leaves_.reserve(faces.size() / 3 + 1);
    const int32_t root_node = build(order, group);
    if (root_node < 0) {  // a single leaf still wants a node
        Node node;
        for (int c = 0; c < 4; ++c) {
            node.child[c] = c == 0 ? root_node : kNone;
            for (size_t axis = 0; axis < 3; ++axis) {
                node.lo[axis][c] = c == 0 ? float(group.lo[axis]) : std::numeric_limits<float>::infinity();
                node.hi[axis][c] = c == 0 ? float(group.hi[axis]) : std::numeric_limits<float>::infinity();
                node.center[axis][c] = node.moment[axis][c] = 0;
            }
            node.far_squared[c] = std::numeric_limits<float>::infinity();
        }
        nodes_.push_back(node);
    }
    middles_ = {};
    positions_ = {};
    faces_ = {};
}

int32_t TriangleTree::make_leaf(std::span<const uint32_t> range, Group& group) {
    Leaf leaf;
    group = {};
    for (size_t axis = 0; axis < 3; ++axis) {
        group.lo[axis] = std::numeric_limits<double>::infinity();
        group.hi[axis] = -group.lo[axis];
    }
    for (size_t i = 0; i < 4; ++i) {
        const Face& f = faces_[range[std::min(i, range.size() - 1)]];
        const bool present = i < range.size();
        double p[3][3], ab[3], ac[3], n[3];
        for (size_t k = 0; k < 3; ++k) {
            const vec3 c = positions_[f[k]];
            p[k][0] = double(c.x);
            p[k][1] = double(c.y);
            p[k][2] = double(c.z);
        }
        double ab2 = 0, ac2 = 0, bc2 = 0, abac = 0, n2 = 0;
        for (size_t axis = 0; axis < 3; ++axis) {
            ab[axis] = p[1][axis] - p[0][axis];
            ac[axis] = p[2][axis] - p[0][axis];
            ab2 += ab[axis] * ab[axis];
            ac2 += ac[axis] * ac[axis];
            bc2 += (ac[axis] - ab[axis]) * (ac[axis] - ab[axis]);
            abac += ab[axis] * ac[axis];
        }
        for (size_t axis = 0; axis < 3; ++axis) {
            n[axis] = ab[(axis + 1) % 3] * ac[(axis + 2) % 3] - ab[(axis + 2) % 3] * ac[(axis + 1) % 3];
            n2 += n[axis] * n[axis];
        }
        // A needle narrower than a millionth of its length is its edges: its plane is not known to floats.
        const double longest = std::max({ab2, ac2, bc2});
        const bool flat = !(n2 > 1e-12 * longest * longest);
        const auto lane = int(i);
        for (size_t axis = 0; axis < 3; ++axis) {
            leaf.a[axis][lane] = float(p[0][axis]);
            leaf.ab[axis][lane] = float(ab[axis]);
            leaf.ac[axis][lane] = float(ac[axis]);
            // u = (ac2 ab - abac ac) / n2: 1 along ab, 0 along ac; v likewise.
            leaf.u[axis][lane] = flat ? 0.0f : float((ac2 * ab[axis] - abac * ac[axis]) / n2);
            leaf.v[axis][lane] = flat ? 0.0f : float((ab2 * ac[axis] - abac * ab[axis]) / n2);
            leaf.n[axis][lane] = flat ? 0.0f : float(n[axis] / std::sqrt(n2));
        }
        leaf.limit[lane] = flat ? -1.0f : 1.0f;
        const auto inverse = [](double squared) { return squared > 0 ? float(1 / squared) : 0.0f; };
        leaf.inverse_ab[lane] = inverse(ab2);
        leaf.inverse_ac[lane] = inverse(ac2);
        leaf.inverse_bc[lane] = inverse(bc2);
        leaf.weight[lane] = present ? 1.0f : 0.0f;
        if (!present) continue;
        const double area = 0.5 * std::sqrt(n2);
        group.area += area;
        for (size_t axis = 0; axis < 3; ++axis) {
            for (size_t k = 0; k < 3; ++k) {
                group.lo[axis] = std::min(group.lo[axis], p[k][axis]);
                group.hi[axis] = std::max(group.hi[axis], p[k][axis]);
            }
            group.center[axis] += area * (p[0][axis] + p[1][axis] + p[2][axis]) / 3;
            group.moment[axis] += 0.5 * n[axis];
        }
    }
    leaves_.push_back(leaf);
    return ~int32_t(leaves_.size() - 1);
}

int32_t TriangleTree::build(std::span<uint32_t> range, Group& group) {
    if (range.size() <= 4) return make_leaf(range, group);
    const auto halves = [&](std::span<uint32_t> whole) {
        vec3 lo = middles_[whole[0]], hi = lo;
        for (const uint32_t f : whole) {
            lo = min(lo, middles_[f]);
            hi = max(hi, middles_[f]);
        }
        const vec3 size = hi - lo;
        const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
        const auto at = [&](uint32_t f) {
            return axis == 0 ? middles_[f].x : axis == 1 ? middles_[f].y : middles_[f].z;
        };
        const size_t middle = std::min((whole.size() / 2 + 3) / 4 * 4, whole.size() - 1);  // full leaves
        std::nth_element(whole.begin(), whole.begin() + long(middle), whole.end(),
                         [&](uint32_t a, uint32_t b) { return at(a) != at(b) ? at(a) < at(b) : a < b; });
        return std::pair(whole.first(middle), whole.subspan(middle));
    };
    std::span<uint32_t> parts[4];
    size_t count = 0;
    const auto [left, right] = halves(range);
    for (const std::span<uint32_t> half : {left, right}) {
        if (half.size() <= 4) {
            parts[count++] = half;
        } else {
            std::tie(parts[count], parts[count + 1]) = halves(half);
            count += 2;
        }
    }
    Node node;
    group = {};
    for (size_t axis = 0; axis < 3; ++axis) {
        group.lo[axis] = std::numeric_limits<double>::infinity();
        group.hi[axis] = -group.lo[axis];
    }
    for (size_t c = 0; c < 4; ++c) {
        const auto lane = int(c);
        if (c >= count) {
            node.child[c] = kNone;
            for (size_t axis = 0; axis < 3; ++axis) {
                node.lo[axis][lane] = node.hi[axis][lane] = std::numeric_limits<float>::infinity();
                node.center[axis][lane] = node.moment[axis][lane] = 0;
            }
            node.far_squared[lane] = 0;
            continue;
        }
        Group part;
        node.child[c] = build(parts[c], part);
        double radius2 = 0;
        for (size_t axis = 0; axis < 3; ++axis) {
            const double middle = part.area > 0 ? part.center[axis] / part.area : 0.5 * (part.lo[axis] + part.hi[axis]);
            node.lo[axis][lane] = float(part.lo[axis]);
            node.hi[axis][lane] = float(part.hi[axis]);
            node.center[axis][lane] = float(middle);
            node.moment[axis][lane] = float(part.moment[axis]);
            const double reach = std::max(middle - part.lo[axis], part.hi[axis] - middle);
            radius2 += reach * reach;
            group.lo[axis] = std::min(group.lo[axis], part.lo[axis]);
            group.hi[axis] = std::max(group.hi[axis], part.hi[axis]);
            group.center[axis] += part.center[axis];
            group.moment[axis] += part.moment[axis];
        }
        group.area += part.area;
        node.far_squared[lane] = float(kFarRadii * kFarRadii * radius2);
    }
    nodes_.push_back(node);
    return int32_t(nodes_.size() - 1);
}

float TriangleTree::leaf_distance(const Leaf& leaf, const Four* p, float bound) {
    const Four q[3] = {p[0] - leaf.a[0], p[1] - leaf.a[1], p[2] - leaf.a[2]};
    const Four u = dot4(q, leaf.u), v = dot4(q, leaf.v), height = dot4(q, leaf.n);
    const Four from_b[3] = {q[0] - leaf.ab[0], q[1] - leaf.ab[1], q[2] - leaf.ab[2]};
    const Four bc[3] = {leaf.ac[0] - leaf.ab[0], leaf.ac[1] - leaf.ab[1], leaf.ac[2] - leaf.ab[2]};
    const Four edges = smaller(off_edge(q, leaf.ab, leaf.inverse_ab),
                               smaller(off_edge(q, leaf.ac, leaf.inverse_ac), off_edge(from_b, bc, leaf.inverse_bc)));
    const FourInt over = (u >= Four{}) & (v >= Four{}) & (u + v <= leaf.limit);
    const Four squared = over ? height * height : edges;
    for (int i = 0; i < 4; ++i) bound = squared[i] < bound ? squared[i] : bound;
    return bound;
}

float TriangleTree::squared_distance(vec3 point, float bound, int32_t* near) const {
    if (nodes_.empty()) return bound;
    const Four p[3] = {all(point.x), all(point.y), all(point.z)};
    // The leaf that was nearest to a point near by is seldom far from the nearest one now.
    int32_t nearest = near != nullptr ? *near : -1;
    if (nearest >= 0) bound = leaf_distance(leaves_[size_t(nearest)], p, bound);
    struct Waiting {
        float squared;
        int32_t child;
    };
    Waiting stack[128];  // a tree of 2^26 triangles is 13 nodes deep, with at most 3 waiting on each level
    int top = 0;
    stack[top++] = {0, int32_t(nodes_.size() - 1)};
    while (top > 0) {
        const Waiting next = stack[--top];
        if (!(next.squared < bound)) continue;
        if (next.child < 0) {
            const float closer = leaf_distance(leaves_[size_t(~next.child)], p, bound);
            if (closer < bound) nearest = ~next.child;
            bound = closer;
            continue;
        }
        const Node& node = nodes_[size_t(next.child)];
        Four squared{};
        for (size_t axis = 0; axis < 3; ++axis) {
            const Four out = larger(larger(node.lo[axis] - p[axis], p[axis] - node.hi[axis]), Four{});
            squared += out * out;
        }
        // Nearest child last, so that it is taken first.
        const int from = top;
        for (int c = 0; c < 4; ++c) {
            if (!(squared[c] < bound) || node.child[c] == kNone) continue;
            int at = top++;
            for (; at > from && stack[at - 1].squared < squared[c]; --at) stack[at] = stack[at - 1];
            stack[at] = {squared[c], node.child[c]};
        }
    }
    if (near != nullptr) *near = nearest;
    return bound;
}

float TriangleTree::winding(vec3 point) const {
    if (nodes_.empty()) return 0;
    const Four p[3] = {all(point.x), all(point.y), all(point.z)};
    int32_t stack[128];
    int top = 0;
    stack[top++] = int32_t(nodes_.size() - 1);
    Four far_sum{};   // of 4 pi w
    Four near_sum{};  // of 2 pi w
    while (top > 0) {
        const int32_t next = stack[--top];
        if (next < 0) {
            const Leaf& leaf = leaves_[size_t(~next)];
            Four a[3], b[3], c[3];
            for (size_t axis = 0; axis < 3; ++axis) {
                a[axis] = leaf.a[axis] - p[axis];
                b[axis] = a[axis] + leaf.ab[axis];
                c[axis] = a[axis] + leaf.ac[axis];
            }
            const Four la = root(dot4(a, a)), lb = root(dot4(b, b)), lc = root(dot4(c, c));
            const Four det = a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) +
                             a[2] * (b[0] * c[1] - b[1] * c[0]);
            const Four rest = la * lb * lc + dot4(a, b) * lc + dot4(b, c) * la + dot4(c, a) * lb;
            near_sum += angle_of(det, rest) * leaf.weight;
            continue;
        }
        const Node& node = nodes_[size_t(next)];
        const Four d[3] = {node.center[0] - p[0], node.center[1] - p[1], node.center[2] - p[2]};
        const Four squared = dot4(d, d);
        const FourInt far = squared > node.far_squared;
        const Four part = dot4(d, node.moment) / (squared * root(squared));
        far_sum += far ? part : Four{};
        for (int c = 0; c < 4; ++c)
            if (!far[c] && node.child[c] != kNone) stack[top++] = node.child[c];
    }
    const Four sum = far_sum + 2 * near_sum;
    return (sum[0] + sum[1] + sum[2] + sum[3]) / (4 * std::numbers::pi_v<float>);
}

}  // namespace kiln::model
