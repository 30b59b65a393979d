// SPDX-License-Identifier: MIT
#include "field/dual_quads.h"

#include "base/assert.h"
#include "base/parallel_for.h"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

namespace kiln::field {
namespace {

typedef int32_t int4 __attribute__((vector_size(16)));

constexpr int kQuadRowGrain = 2;
constexpr float kNearCrossing = 0.125f;  // of the way to the other crossing
constexpr float kWall = 1e-4f;           // voxels a quad keeps from its room's walls, for rounding

// Where an edge of a voxel lies along another axis, 0 or 1; -1 along its own.
int place_of(int edge, int axis) {
    if (edge / 4 == axis) return -1;
    const int u = edge / 4 == 0 ? 1 : 0;
    return (axis == u ? edge : edge >> 1) & 1;
}

// Of the four faces around an edge: 0, 1 between slots that differ in their first bit, 2, 3 in their second.
int side_of(int edge, int face_axis) {
    const int u = edge / 4 == 0 ? 1 : 0;
    return face_axis == u ? edge >> 1 & 1 : 2 + (edge & 1);
}
int side_between(uint32_t slot, uint32_t next) { return (slot ^ next) == 1 ? int(slot >> 1) : 2 + int(slot & 1); }

// Slots in the order of the quad, anticlockwise as seen from the empty side. Around the edge from +u +v over -u +v; u × v is the
// axis, for y its opposite.
struct Ring {
    uint32_t slots[4];
};
Ring ring_of(int axis, bool low_is_solid) {
    const bool forward = low_is_solid != (axis == 1);
    return {{0, forward ? 1u : 2u, 3, forward ? 2u : 1u}};
}

}  // namespace

FacePath face_path(size_t brick, int texel, int a, int b, const EdgeNumbers& numbers, const Crossing* crossings) {
    int axis = 0;
    while (place_of(a, axis) < 0 || place_of(a, axis) != place_of(b, axis)) ++axis;
    FacePath out{};
    out.brick = uint32_t(brick);
    out.texel = texel;
    const auto number = [&](int edge) { return numbers[size_t(texel) + kEdgeOffset[size_t(edge)]]; };
    if (number(a) > number(b)) std::swap(a, b);
    for (const int edge : {a, b}) {
        const size_t i = edge == a ? 0 : 1;
        out.edges[i] = number(edge);
        out.sides[i] = uint8_t(side_of(edge, axis));
        const float t = crossings[number(edge)][3];
        const auto coordinate = [&](int along) { return edge / 4 == along ? t : float(place_of(edge, along)); };
        out.ends[i] = {coordinate(0), coordinate(1), coordinate(2)};
    }
    return out;
}

DualQuads::DualQuads(const MeshEdges& edges, const Buffer<Crossing>& crossings, const Buffer<AroundEdge>& around,
                     Mesh& out)
    : edges_(edges),
      lattice_(edges.bricks()),
      crossings_(crossings),
      around_(around),
      out_(out),
      per_voxel_(1 / edges.bricks().voxel_size()) {}

// Both voxels of a face see the same paths over it: one vertex each.
void DualQuads::add_face_vertices(std::vector<FacePath>& paths, const ExactBrick& exact, int workers) {
    const auto edges = [](const FacePath& p) { return std::pair(p.edges[0], p.edges[1]); };
    const auto order = [&](const FacePath& p) { return std::tuple(edges(p), p.brick); };
    std::sort(paths.begin(), paths.end(), [&](const auto& a, const auto& b) { return order(a) < order(b); });
    const auto same = [&](const FacePath& a, const FacePath& b) { return edges(a) == edges(b); };
    paths.erase(std::unique(paths.begin(), paths.end(), same), paths.end());
    std::stable_sort(paths.begin(), paths.end(), [](const auto& a, const auto& b) { return a.brick < b.brick; });

    const uint32_t first = uint32_t(out_.vertex_count());
    out_.positions.grow(first + paths.size());
    out_.late_bricks.resize(paths.size());
    std::vector<size_t> runs;  // of one brick each
    for (size_t i = 0; i < paths.size(); ++i) {
        out_.late_bricks[i] = paths[i].brick;
        for (const size_t end : {size_t(0), size_t(1)})
            late_.push_back({4 * uint64_t(paths[i].edges[end]) + paths[i].sides[end], first + uint32_t(i)});
        if (i == 0 || paths[i].brick != paths[i - 1].brick) runs.push_back(i);
    }
    runs.push_back(paths.size());
    std::sort(late_.begin(), late_.end(), [](const Late& a, const Late& b) { return a.side < b.side; });

    // The middle of the path, or a place on it that is nearly a crossing.
    parallel_for(runs.size() - 1, workers, [&](int run) {
        const size_t begin = runs[size_t(run)], count = runs[size_t(run) + 1] - begin;
        std::vector<float> x(count), y(count), z(count), value(count);
        const auto along = [&](size_t i, float share) {
            const FacePath& p = paths[begin + i];
            return lattice_.world(p.brick, p.texel, p.ends[0] + (p.ends[1] - p.ends[0]) * share);
        };
        for (size_t i = 0; i < count; ++i) {
            const vec3 p = along(i, 0.5f);
            x[i] = p.x, y[i] = p.y, z[i] = p.z;
        }
        exact(paths[begin].brick, {x.data(), y.data(), z.data(), int(count)}, value.data());
        for (size_t i = 0; i < count; ++i) {
            const bool close = std::fabs(value[i]) * per_voxel_ <= kSharpTolerance;
            out_.positions[first + begin + i] = along(i, close ? 0.5f : kNearCrossing);
        }
    });
}

uint32_t DualQuads::face_vertex(uint32_t edge, int side) const {
    const uint64_t key = 4 * uint64_t(edge) + uint64_t(side);
    const auto it =
        std::lower_bound(late_.begin(), late_.end(), key, [](const Late& a, uint64_t k) { return a.side < k; });
    return it != late_.end() && it->side == key ? it->vertex : kNothing;
}

template <typename Fn>
void DualQuads::each_edge(size_t brick, Fn&& fn) const {
    const BrickEdges& edges = edges_[brick];
    if (!edges.crossed) return;
    uint32_t e = edges.first_edge;
    for (int axis = 0; axis < 3; ++axis) {
        for (int z = 0; z < 8; ++z) {
            for (Slice left = edges.owned[size_t(axis * 8 + z)]; left != 0; left &= left - 1, ++e) {
                const int bit = std::countr_zero(left);
                fn(e, axis, z * 64 + bit, ring_of(axis, (edges.solid[size_t(z)] >> bit & 1u) != 0));
            }
        }
    }
}

// The diagonal that stays in the quad's rooms, and of two the one that lies along a crease: the surface passes the quad's edge at
// the crossing, and the nearer diagonal is that one.
DualQuads::Way DualQuads::way(const uint32_t (&ring)[4], size_t brick, int texel, int axis, const Crossing& c) const {
    const vec3 low = lattice_.world(brick, texel, {});
    const float middle = c[3] / per_voxel_;
    // By corner, from the edge's lower end.
    const auto corners = [&](float vec3::*component) {
        const auto at = [&](size_t i) { return out_.positions[ring[i]].*component - low.*component; };
        return float4{at(0), at(1), at(2), at(3)};
    };
    const float4 x = corners(&vec3::x), y = corners(&vec3::y), z = corners(&vec3::z);
    const auto less = [&](float4 v, int along) { return along == axis ? v - middle : v; };
    const float4 height = less(x, 0) * c[0] + less(y, 1) * c[1] + less(z, 2) * c[2];
    // Voxels; u, v across the edge, w along it.
    const auto along = [&](int a) { return (a == 0 ? x : a == 1 ? y : z) * per_voxel_; };
    const float4 u = along((axis + 1) % 3), v = along((axis + 2) % 3), w = along(axis);

    // Lane i: the diagonal between the corners before and after corner i passes the edge's line on the side of that corner where it meets
    // the half plane of the corner. There it must be in the triangle of edge and corner; the rest follows, as all corners are between the
    // planes of the edge's ends. On the other side the other lane is asked.
    const auto next = [](float4 lanes) { return __builtin_shuffle(lanes, int4{1, 2, 3, 0}); };
    const auto last = [](float4 lanes) { return __builtin_shuffle(lanes, int4{3, 0, 1, 2}); };
    const float4 turn = u * next(v) - v * next(u), before = last(turn);
    const float4 share = before / (before + turn);
    const auto met = [&](float4 lanes) { return last(lanes) + (next(lanes) - last(lanes)) * share; };
    const float4 part = (met(u) * u + met(v) * v) / (u * u + v * v), at = met(w);
    const int4 within = (part <= 1) & (at >= part * w + kWall) & (at <= 1 - kWall + part * (w - 1));
    const int4 stays = (part < 0) | within;

    const bool first = (stays[1] & stays[3]) != 0, second = (stays[0] & stays[2]) != 0;
    if (first && second)
        return std::fabs(height[1] + height[3]) < std::fabs(height[0] + height[2]) ? Way::kSecond : Way::kFirst;
    return first ? Way::kFirst : second ? Way::kSecond : Way::kFan;
}

DualQuads::Counts DualQuads::choose(size_t brick) {
    Counts out;
    each_edge(brick, [&](uint32_t e, int axis, int texel, const Ring& r) {
        const AroundEdge& slots = around_[e];
        if (slots[0] == kNothing || slots[1] == kNothing || slots[2] == kNothing || slots[3] == kNothing) {
            ways_[e] = Way::kNone;
            return;
        }
        uint32_t ring[4], marks = 0;
        for (size_t i = 0; i < 4; ++i) marks |= ring[i] = slots[r.slots[i]];
        ways_[e] = (marks & kNotPlain) != 0 ? Way::kFan : way(ring, brick, texel, axis, crossings_[e]);
        out.triangles += 2;
        if (ways_[e] != Way::kFan) return;
        ++out.fans;
        out.triangles += 2;
        for (size_t i = 0; i < 4; ++i) out.triangles += ((ring[i] | ring[(i + 1) & 3]) & kNotPlain) != 0;
    });
    return out;
}

void DualQuads::write(size_t brick, uint32_t first_triangle, uint32_t first_fan) {
    uint32_t* to = out_.triangles.data() + 3 * size_t(first_triangle);
    uint32_t fan = first_fan;
    each_edge(brick, [&](uint32_t e, int axis, int texel, const Ring& r) {
        const Way way = ways_[e];
        if (way == Way::kNone) return;
        const AroundEdge& slots = around_[e];
        if (way != Way::kFan) {
            const size_t first = way == Way::kFirst ? 0 : 1;
            for (const size_t corner : {0, 1, 2, 0, 2, 3}) *to++ = slots[r.slots[(first + corner) & 3]];
            return;
        }
        out_.positions[fan] = lattice_.world(brick, texel, LatticePoints::on_edge(axis, crossings_[e][3]));
        out_.late_bricks[fan - out_.brick_vertices[edges_.bricks().bricks().size()]] = uint32_t(brick);
        uint32_t border[8], count = 0;
        for (size_t i = 0; i < 4; ++i) {
            const uint32_t slot = r.slots[i], next = r.slots[(i + 1) & 3];
            border[count++] = slots[slot] & ~kNotPlain;
            if (((slots[slot] | slots[next]) & kNotPlain) != 0) {
                const uint32_t vertex = face_vertex(e, side_between(slot, next));
                KILN_ASSERT(vertex != kNothing, "edge {}: no path over a face that is not plain", e);
                border[count++] = vertex;
            }
        }
        for (uint32_t i = 0; i < count; ++i) {
            *to++ = fan;
            *to++ = border[i];
            *to++ = border[i + 1 == count ? 0 : i + 1];
        }
        ++fan;
    });
}

void DualQuads::make(std::vector<FacePath> paths, const ExactBrick& exact, int workers) {
    const MeshBricks& bricks = edges_.bricks();
    const size_t count = bricks.bricks().size();
    add_face_vertices(paths, exact, workers);
    const auto each_brick = [&](auto&& fn) {
        parallel_for(
            bricks.rows().size(), workers,
            [&](int i) {
                const MeshBricks::Row& row = bricks.rows()[size_t(i)];
                for (size_t brick = row.first; brick < row.end; ++brick) fn(brick);
            },
            kQuadRowGrain);
    };
    ways_.resize(edges_.edge_count());
    std::vector<Counts> first(count + 1);
    each_brick([&](size_t brick) { first[brick + 1] = choose(brick); });
    first[0].fans = uint32_t(out_.vertex_count());
    for (size_t i = 0; i < count; ++i) {
        first[i + 1].triangles += first[i].triangles;
        first[i + 1].fans += first[i].fans;
    }
    out_.late_bricks.grow(first[count].fans - out_.brick_vertices[count]);
    out_.positions.grow(first[count].fans);
    out_.triangles.resize(3 * size_t(first[count].triangles));
    each_brick([&](size_t brick) { write(brick, first[brick].triangles, first[brick].fans); });
}

}  // namespace kiln::field
