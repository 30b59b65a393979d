// SPDX-License-Identifier: MIT
#include "field/cell_cases.h"

#include "base/assert.h"

#include <algorithm>

namespace kiln::field {
namespace {

constexpr int kNone = -1;

int bit_of(int corner, int axis) { return corner >> axis & 1; }

// The edge between two corners that differ along one axis.
int edge_between(int a, int b) {
    const int axis = (a ^ b) == 1 ? 0 : (a ^ b) == 2 ? 1 : 2;
    const int u = axis == 0 ? 1 : 0, v = axis == 2 ? 1 : 2;
    return axis * 4 + bit_of(a, u) + 2 * bit_of(a, v);
}

// Corners of a face, anticlockwise as seen from outside the voxel.
std::array<int, 4> face_corners(int face) {
    const int axis = face / 2, side = face & 1, u = (axis + 1) % 3, v = (axis + 2) % 3;
    std::array<int, 4> out;
    for (int i = 0; i < 4; ++i) {
        const int along_u = i == 1 || i == 2, along_v = i >= 2;
        out[size_t(i)] = side << axis | along_u << u | along_v << v;
    }
    if (side == 0) std::swap(out[1], out[3]);
    return out;
}

struct Middle {
    int x, y, z;  // of an edge, in halves of a voxel
};
Middle middle_of(int edge) {
    const int axis = edge / 4, u = axis == 0 ? 1 : 0, v = axis == 2 ? 1 : 2;
    int p[3];
    p[axis] = 1;
    p[u] = 2 * (edge & 1);
    p[v] = 2 * (edge >> 1 & 1);
    return {p[0], p[1], p[2]};
}

bool share_a_face(int a, int b) {
    const Middle p = middle_of(a), q = middle_of(b);
    const auto on_side = [](int s, int t) { return s == t && s != 1; };
    return on_side(p.x, q.x) || on_side(p.y, q.y) || on_side(p.z, q.z);
}

int squared_length(int a, int b) {
    const Middle p = middle_of(a), q = middle_of(b);
    return (p.x - q.x) * (p.x - q.x) + (p.y - q.y) * (p.y - q.y) + (p.z - q.z) * (p.z - q.z);
}

// Least-cost triangulation of one loop (Klincsek, "Minimal Triangulations of Polygonal Domains", 1980).
class Triangulation {
public:
    Triangulation(const uint8_t* edges, int count) : edges_(edges) {
        for (int size = 1; size < count; ++size) {
            for (int i = 0; i + size < count; ++i) {
                Part& part = parts_[i][i + size];
                const bool side = size == 1 || size == count - 1;
                part.cost = size == 1 ? 0 : kImpossible;
                for (int k = i + 1; k < i + size; ++k) {
                    const int cost = parts_[i][k].cost + parts_[k][i + size].cost;
                    if (cost < part.cost) part = {cost, k};
                }
                if (side) continue;
                part.cost += share_a_face(edges_[i], edges_[i + size]) ? kImpossible
                                                                       : squared_length(edges_[i], edges_[i + size]);
            }
        }
        possible_ = parts_[0][count - 1].cost < kImpossible;
    }
    bool possible() const { return possible_; }
    void emit(int i, int j, CellTriangles& out) const {
        if (j - i < 2) return;
        const int k = parts_[i][j].apex;
        emit(i, k, out);
        KILN_ASSERT(out.count < kMostTriangles, "{} triangles", int(out.count));
        for (const int corner : {i, k, j})
            out.edges[3 * out.count + (corner == i ? 0 : corner == k ? 1 : 2)] = edges_[corner];
        ++out.count;
        emit(k, j, out);
    }

private:
    static constexpr int kImpossible = 1 << 20;
    struct Part {
        int cost = 0, apex = 0;
    };
    const uint8_t* edges_;
    Part parts_[12][12];
    bool possible_;
};

}  // namespace

uint32_t ambiguous_faces(uint32_t solid) {
    uint32_t out = 0;
    for (int face = 0; face < 6; ++face) {
        const std::array<int, 4> c = face_corners(face);
        const auto is = [&](size_t i) { return (solid >> c[i] & 1u) != 0; };
        if (is(0) == is(2) && is(1) == is(3) && is(0) != is(1)) out |= 1u << face;
    }
    return out;
}

CellLoops cell_loops(uint32_t solid) {
    int next[12];
    std::fill_n(next, 12, kNone);
    for (int face = 0; face < 6; ++face) {
        const std::array<int, 4> c = face_corners(face);
        const auto is = [&](int i) { return (solid >> c[size_t(i & 3)] & 1u) != 0; };
        for (int i = 0; i < 4; ++i) {
            if (is(i) || !is(i + 1)) continue;  // enters the solid between corners i and i + 1
            int leave = i + 1;
            while (is(leave + 1)) ++leave;
            next[edge_between(c[size_t(i)], c[size_t(i + 1) & 3])] =
                edge_between(c[size_t(leave & 3)], c[size_t(leave + 1) & 3]);
        }
    }
    CellLoops out;
    bool done[12] = {};
    for (int edge = 0; edge < 12; ++edge) {
        if (next[edge] == kNone || done[edge]) continue;
        uint8_t end = out.first[out.count];
        for (int e = edge; !done[e]; e = next[e]) {
            KILN_ASSERT(next[e] != kNone, "corner signs {}: edge {} ends no segment", solid, e);
            done[e] = true;
            out.edges[end++] = uint8_t(e);
        }
        out.first[++out.count] = end;
    }
    return out;
}

CellTriangles cell_triangles(const CellLoops& loops) {
    CellTriangles out;
    for (int loop = 0; loop < loops.count; ++loop) {
        const int size = loops.first[loop + 1] - loops.first[loop];
        const Triangulation best(loops.edges + loops.first[loop], size);
        KILN_ASSERT(best.possible(), "a loop of {} edges has no diagonals off the faces", size);
        best.emit(0, size - 1, out);
    }
    return out;
}

const CellTables& cell_tables() {
    static const CellTables tables = [] {
        CellTables out;
        for (uint32_t solid = 0; solid < 256; ++solid) {
            out.loops[solid] = cell_loops(solid);
            out.triangles[solid] = cell_triangles(out.loops[solid]);
            out.plain[solid] = out.loops[solid].count <= 1 && ambiguous_faces(solid) == 0;
        }
        return out;
    }();
    return tables;
}

}  // namespace kiln::field
