// SPDX-License-Identifier: MIT
// The sharp mesher: crossings and vertices; triangles are made by dual_quads.h. Lengths here are in voxels, from the first corner of
// a voxel or of an edge, so that they keep their digits anywhere in the world; `exact` answers in metres.
#include "field/meshing.h"

#include "field/cell_cases.h"
#include "field/dual_quads.h"

#include "base/parallel_for.h"
#include "base/profile.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <utility>

namespace kiln::field {
namespace {

constexpr int kSharpRowGrain = 2;

float4 all_of(float v) { return float4{v, v, v, v}; }

Crossing crossing(vec3 normal, float t) { return Crossing{normal.x, normal.y, normal.z, t}; }

constexpr int kRootSteps = 8;
constexpr float kRootTolerance = 1e-3f;     // voxels
constexpr float kNewtonReach = 0.1f;        // voxels off the surface from which one step by the gradient lands on it
constexpr float kGradientStep = 1.0f / 40;  // voxels an axis; a float's rounding at 1000 voxels is 6e-5
constexpr float kStill = 0.005f;            // voxels off the surface that need no second look
// Of the squared distances to the planes, how much is added for the distance to their middle: planes that agree leave a vertex
// there, planes that differ by more than about 10 degrees meet where they should.
constexpr float kMiddleWeight = 0.004f;
constexpr float kAmong = 0.125f;  // of the way from a crossing to their middle

// A crossing's place in its voxel, from the middle of the voxel: origin + t * along.
struct EdgePlace {
    float4 origin, along;
};
constexpr std::array<EdgePlace, 12> kEdgePlace = [] {
    std::array<EdgePlace, 12> out{};
    for (int e = 0; e < 12; ++e) {
        const float u = (e & 1) != 0 ? 0.5f : -0.5f, v = (e & 2) != 0 ? 0.5f : -0.5f;
        if (e / 4 == 0) out[size_t(e)] = {float4{-0.5f, u, v, 0}, float4{1, 0, 0, 0}};
        if (e / 4 == 1) out[size_t(e)] = {float4{u, -0.5f, v, 0}, float4{0, 1, 0, 0}};
        if (e / 4 == 2) out[size_t(e)] = {float4{u, v, -0.5f, 0}, float4{0, 0, 1, 0}};
    }
    return out;
}();

// Points for one call of `exact`, and what it answered.
struct Batch {
    std::vector<float> x, y, z, value;
    size_t count = 0;
    void reserve(size_t most) {
        if (x.size() >= most) return;
        for (std::vector<float>* v : {&x, &y, &z, &value}) v->resize(most);
    }
    void add(vec3 p) {
        x[count] = p.x, y[count] = p.y, z[count] = p.z;
        ++count;
    }
    void run(const ExactBrick& exact, size_t brick) {
        if (count != 0) exact(brick, {x.data(), y.data(), z.data(), int(count)}, value.data());
    }
};

// One sheet of the surface in a voxel.
struct Sheet {
    vec3 at;      // from the voxel's first corner
    vec3 normal;  // unit: the middle one of its crossings
    float off;    // of the exact field there, voxels
    uint16_t voxel;
    uint8_t loop;
    bool among;  // its crossings, as the voxel has other loops
};

struct Scratch {
    Batch batch;
    // By owned edge: its first texel, the position along it, the values at its ends, and what is left to find.
    std::vector<float> x, y, z, t, low, high;
    std::vector<uint32_t> open;
    std::vector<Sheet> sheets;
};

class Sharp {
public:
    Sharp(const MeshEdges& edges, const ExactBrick& exact, Mesh& out, Buffer<Crossing>& crossings,
          Buffer<AroundEdge>& around)
        : edges_(edges),
          lattice_(edges.bricks()),
          exact_(exact),
          out_(out),
          crossings_(crossings),
          around_(around),
          h_(edges.bricks().voxel_size()),
          per_voxel_(1 / h_) {}

    // Crossings of the edges that a brick owns: tangent planes of the exact field where the stored values vanish, moved to the root by
    // one Newton step; by false position where the field bends too much for that.
    void cross(size_t index, Scratch& s) const {
        const BrickEdges& edges = edges_[index];
        if (!edges.crossed || edges.edges == 0) return;
        const MeshBrick& brick = edges_.bricks().bricks()[index];
        const size_t count = edges.edges;
        for (std::vector<float>* v : {&s.x, &s.y, &s.z, &s.t, &s.low, &s.high})
            if (v->size() < count) v->resize(count);
        s.batch.reserve(6 * count);
        s.open.clear();
        size_t first[4] = {0, edges.rank[8], edges.rank[16], count};
        size_t e = 0;
        for (int axis = 0; axis < 3; ++axis) {
            const int step = axis == 0 ? 1 : axis == 1 ? 8 : 64;
            for (int z = 0; z < 8; ++z) {
                for (Slice left = edges.owned[size_t(axis * 8 + z)]; left != 0; left &= left - 1, ++e) {
                    const int bit = std::countr_zero(left);
                    s.x[e] = float(brick.cell.x * kBrickVoxels + (bit & 7));
                    s.y[e] = float(brick.cell.y * kBrickVoxels + (bit >> 3));
                    s.z[e] = float(brick.cell.z * kBrickVoxels + z);
                    s.low[e] = stored_voxels(brick.codes, edges_.bricks().format(), z * 64 + bit);
                    s.high[e] = stored_voxels(brick.codes, edges_.bricks().format(), z * 64 + bit + step);
                }
            }
        }
        for (size_t i = 0; i < count; ++i) s.t[i] = fraction(s.low[i] / (s.low[i] - s.high[i]));
        Crossing* const to = crossings_.data() + edges.first_edge;
        for (int axis = 0; axis < 3; ++axis) add_tetrahedra(axis, first[axis], first[axis + 1], count, s);
        s.batch.count = 4 * count;
        s.batch.run(exact_, index);
        const float* const v = s.batch.value.data();
        const float scale = per_voxel_ / (4 * kGradientStep);
        for (int axis = 0; axis < 3; ++axis) {
            for (size_t i = first[axis]; i < first[size_t(axis) + 1]; ++i) {
                const float a = v[i], b = v[count + i], c = v[2 * count + i], d = v[3 * count + i];
                const vec3 g{((a - b) - (c - d)) * scale, ((d - a) - (b - c)) * scale, ((b - a) + (d - c)) * scale};
                const float value = (a + b + c + d) * 0.25f * per_voxel_;
                const float slope = axis == 0 ? g.x : axis == 1 ? g.y : g.z;
                const float size = length(g);
                const float step = value / slope;
                if (!(std::fabs(value) < kNewtonReach && std::fabs(step) < kNewtonReach && size > 0.01f)) {
                    s.open.push_back(uint32_t(i));
                    continue;
                }
                to[i] = crossing(g / size, fraction(s.t[i] - step));
            }
        }
        if (!s.open.empty()) cross_hard(index, first, s, to);
    }

    // Vertices of a brick's voxels, and the quads' corners.
    void place(size_t index, Scratch& s, std::vector<FacePath>& paths) const {
        const BrickEdges& edges = edges_[index];
        if (!edges.crossed) return;
        EdgeNumbers numbers;
        edges_.number(index, numbers);
        const uint32_t first = out_.brick_vertices[index], count = out_.brick_vertices[index + 1] - first;
        s.sheets.resize(count);
        s.batch.reserve(count);
        uint32_t made = 0;
        for (int z = 0; z < kBrickVoxels; ++z) {
            for (Slice left = active_voxels(edges.solid, z); left != 0; left &= left - 1) {
                const int bit = std::countr_zero(left);
                const uint32_t signs = corner_signs(edges.solid, z, bit);
                const CellLoops& loops = tables_.loops[signs];
                const bool plain = tables_.plain[signs];
                const uint32_t* const from = numbers.data() + z * 64 + bit;
                for (int loop = 0; loop < loops.count; ++loop, ++made) {
                    const uint8_t* const begin = loops.edges + loops.first[loop];
                    const uint8_t* const end = loops.edges + loops.first[loop + 1];
                    Sheet& sheet = s.sheets[made];
                    sheet.voxel = uint16_t(z * 64 + bit);
                    sheet.loop = uint8_t(loop);
                    sheet.among = loops.count > 1;
                    const uint32_t mark = plain ? 0 : kNotPlain;
                    for (const uint8_t* edge = begin; edge != end; ++edge)
                        around_[from[kEdgeOffset[*edge]]][*edge & 3u] = (first + made) | mark;
                    meet(begin, end, from, sheet);
                    if (sheet.among) sheet.at = safe(index, numbers, sheet).middle;
                    if (plain) continue;
                    for (const uint8_t* edge = begin; edge != end; ++edge)
                        paths.push_back(face_path(index, z * 64 + bit, *edge, edge + 1 == end ? *begin : edge[1],
                                                  numbers, crossings_.data()));
                }
            }
        }
        settle(index, numbers, s);
        for (size_t i = 0; i < count; ++i)
            out_.positions[first + i] = lattice_.world(index, s.sheets[i].voxel, s.sheets[i].at);
    }

private:
    static float stored_voxels(const std::byte* codes, DistanceFormat format, int texel) {
        if (format == DistanceFormat::Snorm8) return snorm8_value(uint32_t(codes[texel]));
        uint16_t code;
        std::memcpy(&code, codes + 2 * texel, 2);
        return half_value(code);
    }
    static float fraction(float t) {
        t = t > kLeastFraction ? t : kLeastFraction;
        return t < 1 - kLeastFraction ? t : 1 - kLeastFraction;
    }
    // Corners of a tetrahedron around each of the edges first … end - 1 of one axis, in four runs of `count`: a
    // value and a gradient for four evaluations, the gradient off by the step times the curvature.
    void add_tetrahedra(int axis, size_t first, size_t end, size_t count, Scratch& s) const {
        constexpr vec3 kCorner[4] = {{1, -1, -1}, {-1, -1, 1}, {-1, 1, -1}, {1, 1, 1}};
        const vec3 unit = LatticePoints::on_edge(axis, 1);
        for (size_t i = 0; i < 4; ++i) {
            const vec3 step = kCorner[i] * kGradientStep;
            float* const x = s.batch.x.data() + i * count;
            float* const y = s.batch.y.data() + i * count;
            float* const z = s.batch.z.data() + i * count;
            for (size_t e = first; e < end; ++e) x[e] = (s.x[e] + (s.t[e] * unit.x + step.x)) * h_;
            for (size_t e = first; e < end; ++e) y[e] = (s.y[e] + (s.t[e] * unit.y + step.y)) * h_;
            for (size_t e = first; e < end; ++e) z[e] = (s.z[e] + (s.t[e] * unit.z + step.z)) * h_;
        }
    }

    // The edges in s.open by false position with the Illinois rule (Dowell and Jarratt, 1971), whose ends have the texels' signs,
    // then their gradients.
    void cross_hard(size_t index, const size_t (&first)[4], Scratch& s, Crossing* to) const {
        struct Bracket {
            uint32_t edge;
            int axis, kept = 0;
            float low_t = 0, high_t = 1, low, high;
        };
        std::vector<Bracket> all, open;
        for (const uint32_t e : s.open)
            all.push_back({e, e < first[1] ? 0 : e < first[2] ? 1 : 2, 0, 0, 1, s.low[e], s.high[e]});
        const auto texel = [&](uint32_t e) { return vec3{s.x[e], s.y[e], s.z[e]}; };
        open = all;
        for (int step = 0; step < kRootSteps && !open.empty(); ++step) {
            s.batch.count = 0;
            for (const Bracket& b : open) {
                const float share = b.low / (b.low - b.high);
                s.t[b.edge] = fraction(b.low_t + (b.high_t - b.low_t) * (share > 0 && share < 1 ? share : 0.5f));
                s.batch.add(lattice_.world(texel(b.edge), LatticePoints::on_edge(b.axis, s.t[b.edge])));
            }
            s.batch.run(exact_, index);
            size_t kept = 0;
            for (size_t i = 0; i < open.size(); ++i) {
                Bracket b = open[i];
                const float value = s.batch.value[i] * per_voxel_, t = s.t[b.edge];
                if (std::fabs(value) <= kRootTolerance) continue;
                if ((value <= 0) == (b.low <= 0)) {
                    b.low_t = t;
                    b.low = value;
                    if (b.kept == 1) b.high *= 0.5f;
                    b.kept = 1;
                } else {
                    b.high_t = t;
                    b.high = value;
                    if (b.kept == -1) b.low *= 0.5f;
                    b.kept = -1;
                }
                open[kept++] = b;
            }
            open.resize(kept);
        }
        s.batch.count = 0;
        for (const Bracket& b : all) {
            for (int axis = 0; axis < 3; ++axis) {
                for (const float step : {kGradientStep, -kGradientStep})
                    s.batch.add(lattice_.world(texel(b.edge), LatticePoints::on_edge(b.axis, s.t[b.edge]) +
                                                                  LatticePoints::on_edge(axis, step)));
            }
        }
        s.batch.run(exact_, index);
        for (size_t i = 0; i < all.size(); ++i) {
            const float* const v = s.batch.value.data() + 6 * i;
            const vec3 g{v[0] - v[1], v[2] - v[3], v[4] - v[5]};
            const float size = length(g);
            to[all[i].edge] = crossing(size > 1e-3f * kGradientStep * h_ ? g / size : vec3{}, s.t[all[i].edge]);
        }
    }

    // Where the planes of one loop meet, near the middle of its crossings: least squares, by Cramer's rule.
    void meet(const uint8_t* begin, const uint8_t* end, const uint32_t* from, Sheet& sheet) const {
        float4 middle{}, normal{}, right{}, row_x{}, row_y{}, row_z{};
        for (const uint8_t* edge = begin; edge != end; ++edge) {
            const float4 n = crossings_[from[kEdgeOffset[*edge]]];
            const EdgePlace& place = kEdgePlace[*edge];
            const float4 p = place.origin + place.along * all_of(n[3]);
            middle += p;
            normal += n;
            row_x += n * all_of(n[0]);
            row_y += n * all_of(n[1]);
            row_z += n * all_of(n[2]);
            const float4 product = n * p;
            right += n * all_of(product[0] + product[1] + product[2]);
        }
        const float count = float(end - begin);
        middle *= all_of(1 / count);
        right -= row_x * all_of(middle[0]) + row_y * all_of(middle[1]) + row_z * all_of(middle[2]);
        const float weight = kMiddleWeight * count;  // keeps the determinant above 0
        const float xx = row_x[0] + weight, yy = row_y[1] + weight, zz = row_z[2] + weight;
        const float xy = row_x[1], xz = row_x[2], yz = row_y[2];
        const float c_xx = yy * zz - yz * yz, c_xy = xz * yz - xy * zz, c_xz = xy * yz - xz * yy;
        const float c_yy = xx * zz - xz * xz, c_yz = xy * xz - xx * yz, c_zz = xx * yy - xy * xy;
        const float scale = 1 / (xx * c_xx + xy * c_xy + xz * c_xz);
        const float4 column_x{c_xx, c_xy, c_xz, 0}, column_y{c_xy, c_yy, c_yz, 0}, column_z{c_xz, c_yz, c_zz, 0};
        const float4 at =
            middle +
            (column_x * all_of(right[0]) + column_y * all_of(right[1]) + column_z * all_of(right[2])) * all_of(scale);
        const float most = 0.5f - kLeastFraction;
        const bool out = std::max({std::fabs(at[0]), std::fabs(at[1]), std::fabs(at[2])}) > most;
        const float rows[3][3] = {{xx, xy, xz}, {xy, yy, yz}, {xz, yz, zz}};
        const vec3 p = out ? nearest_inside(rows, right, middle, at) : vec3{at[0], at[1], at[2]};
        sheet.at = inside({p.x + 0.5f, p.y + 0.5f, p.z + 0.5f});
        const vec3 n{normal[0], normal[1], normal[2]};
        const float size = length(n);
        sheet.normal = size > 0 ? n / size : vec3{};
    }
    // The least squares again with the coordinate that is furthest out held at the voxel's face: along a crease that leaves through
    // another side the vertex slides on the crease, where clamping alone would push it off. `free` may be outside.
    static vec3 nearest_inside(const float (&rows)[3][3], float4 right, float4 middle, float4 free) {
        const float most = 0.5f - kLeastFraction;
        const auto held = [&](float v) { return std::min(std::max(v, -most), most); };
        const auto furthest = [&](const float* v, size_t count) {
            size_t best = 0;
            for (size_t i = 1; i < count; ++i)
                if (std::fabs(v[i]) > std::fabs(v[best])) best = i;
            return best;
        };
        float at[3] = {free[0], free[1], free[2]};
        const size_t k = furthest(at, 3), i = k == 0 ? 1 : 0, j = k == 2 ? 1 : 2;
        at[k] = held(at[k]);
        const float x_k = at[k] - middle[int(k)];
        const float r_i = right[int(i)] - rows[i][k] * x_k, r_j = right[int(j)] - rows[j][k] * x_k;
        const float scale = 1 / (rows[i][i] * rows[j][j] - rows[i][j] * rows[i][j]);
        at[i] = middle[int(i)] + scale * (rows[j][j] * r_i - rows[i][j] * r_j);
        at[j] = middle[int(j)] + scale * (rows[i][i] * r_j - rows[i][j] * r_i);
        if (std::max(std::fabs(at[i]), std::fabs(at[j])) > most) {
            const bool first = std::fabs(at[i]) > std::fabs(at[j]);
            const size_t second = first ? i : j, last = first ? j : i;
            at[second] = held(at[second]);
            const float x = at[second] - middle[int(second)];
            at[last] = middle[int(last)] +
                       (right[int(last)] - rows[last][k] * x_k - rows[last][second] * x) / rows[last][last];
        }
        return {at[0], at[1], at[2]};
    }
    static vec3 inside(vec3 p) { return {fraction(p.x), fraction(p.y), fraction(p.z)}; }

    // Points that lie on the sheet or near it whatever its planes do. Those of a vertex that must stay among its crossings do.
    struct Safe {
        vec3 middle, crossing;  // of the crossings, and the one nearest to it or nearly so
    };
    Safe safe(size_t index, const EdgeNumbers& numbers, const Sheet& sheet) const {
        const CellLoops& loops = tables_.loops[corner_signs(edges_[index].solid, sheet.voxel >> 6, sheet.voxel & 63)];
        vec3 points[12], middle{};
        int count = 0;
        for (int i = loops.first[sheet.loop]; i < loops.first[sheet.loop + 1]; ++i) {
            const EdgePlace& place = kEdgePlace[loops.edges[i]];
            const float4 p =
                place.origin + place.along * all_of(crossings_[numbers[sheet.voxel + kEdgeOffset[loops.edges[i]]]][3]);
            points[count] = {p[0] + 0.5f, p[1] + 0.5f, p[2] + 0.5f};
            middle = middle + points[count++];
        }
        middle = middle / float(count);
        vec3 nearest = points[0];
        for (int i = 1; i < count; ++i) {
            const vec3 a = points[i] - middle, b = nearest - middle;
            if (dot(a, a) < dot(b, b)) nearest = points[i];
        }
        if (sheet.among) return {middle, nearest + (middle - nearest) * kAmong};
        return {inside(middle), inside(nearest)};
    }

    // Tries `candidate(sheet)` for those off the surface by more than `off`, and keeps it where it is nearer.
    template <typename Candidate>
    void improve(size_t index, float off, Candidate&& candidate, Scratch& s) const {
        s.batch.count = 0;
        s.open.clear();
        for (uint32_t i = 0; i < s.sheets.size(); ++i) {
            if (!(std::fabs(s.sheets[i].off) > off)) continue;
            s.open.push_back(i);
            s.batch.add(lattice_.world(index, s.sheets[i].voxel, candidate(s.sheets[i])));
        }
        s.batch.run(exact_, index);
        for (size_t k = 0; k < s.open.size(); ++k) {
            Sheet& sheet = s.sheets[s.open[k]];
            const float value = s.batch.value[k] * per_voxel_;
            if (!(std::fabs(value) < std::fabs(sheet.off))) continue;
            sheet.at = candidate(sheet);
            sheet.off = value;
        }
    }

    // Planes only meet on the surface where it is flat: measure, step once along the normal, and where that is not enough take the
    // middle of the crossings, stepped too, or a crossing itself.
    void settle(size_t index, const EdgeNumbers& numbers, Scratch& s) const {
        for (Sheet& sheet : s.sheets) sheet.off = std::numeric_limits<float>::infinity();
        improve(
            index, 0.0f, [](const Sheet& sheet) { return sheet.at; }, s);
        const auto stepped = [](const Sheet& sheet) {
            return sheet.among ? sheet.at : inside(sheet.at - sheet.normal * sheet.off);
        };
        improve(index, kStill, stepped, s);
        const bool far = std::any_of(s.sheets.begin(), s.sheets.end(),
                                     [](const Sheet& sheet) { return !(std::fabs(sheet.off) <= kSharpTolerance); });
        if (far) {
            improve(index, kSharpTolerance, stepped, s);
            improve(
                index, kSharpTolerance, [&](const Sheet& sheet) { return safe(index, numbers, sheet).middle; }, s);
            improve(index, kSharpTolerance, stepped, s);
            improve(
                index, kSharpTolerance, [&](const Sheet& sheet) { return safe(index, numbers, sheet).crossing; }, s);
        }
    }

    const MeshEdges& edges_;
    const LatticePoints lattice_;
    const ExactBrick& exact_;
    Mesh& out_;
    Buffer<Crossing>& crossings_;
    Buffer<AroundEdge>& around_;  // by edge
    const CellTables& tables_ = cell_tables();
    const float h_, per_voxel_;
};

}  // namespace

ExactBrick exact_of(const HostBricks& host, const MeshBricks& bricks) {
    return [&host, &bricks](size_t brick, const sdf::Points& points, float* out) {
        const Field& field = host.field();
        sdf::evaluate(sdf::view(field.program(), field.code_of(bricks.bricks()[brick].slot)), points, out);
    };
}

void mesh_sharp(const MeshBricks& bricks, const ExactBrick& exact, Mesh& out, int workers) {
    KILN_PROFILE("sharp mesh");
    const CellTables& tables = cell_tables();
    const size_t count = bricks.bricks().size();
    const MeshEdges edges(bricks, workers, [&](const BrickEdges& brick) {
        uint32_t vertices = 0;
        for (int z = 0; z < kBrickVoxels; ++z) {
            for (Slice left = active_voxels(brick.solid, z); left != 0; left &= left - 1)
                vertices += tables.loops[corner_signs(brick.solid, z, std::countr_zero(left))].count;
        }
        return vertices;
    });
    out.brick_vertices.resize(count + 1);
    for (size_t i = 0; i < count; ++i) out.brick_vertices[i] = edges[i].first_item;
    out.brick_vertices[count] = edges.item_count();
    out.positions.resize(edges.item_count());

    Buffer<Crossing> crossings;
    Buffer<AroundEdge> around;
    crossings.resize(edges.edge_count());
    around.resize(edges.edge_count());
    std::fill_n(around.data(), around.size(), AroundEdge{kNothing, kNothing, kNothing, kNothing});
    const Sharp sharp(edges, exact, out, crossings, around);
    const auto each_row = [&](auto&& fn) {
        parallel_for(
            bricks.rows().size(), workers,
            [&](int i) {
                thread_local Scratch scratch;
                const MeshBricks::Row& row = bricks.rows()[size_t(i)];
                for (size_t brick = row.first; brick < row.end; ++brick) fn(size_t(i), brick, scratch);
            },
            kSharpRowGrain);
    };
    each_row([&](size_t, size_t brick, Scratch& scratch) { sharp.cross(brick, scratch); });
    std::vector<std::vector<FacePath>> found(bricks.rows().size());
    each_row([&](size_t row, size_t brick, Scratch& scratch) { sharp.place(brick, scratch, found[row]); });
    std::vector<FacePath> paths;
    for (const std::vector<FacePath>& some : found) paths.insert(paths.end(), some.begin(), some.end());
    DualQuads(edges, crossings, around, out).make(std::move(paths), exact, workers);
}

}  // namespace kiln::field
