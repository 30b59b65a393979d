// SPDX-License-Identifier: MIT
// The sharp mesher. Lengths here are in voxels, from the first corner of a voxel or of an edge, so that they keep their digits
// anywhere in the world; `exact` answers in metres.
#include "field/meshing.h"

#include "field/cell_cases.h"
#include "field/mesh_edges.h"

#include "base/parallel_for.h"
#include "base/profile.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>
#include <unordered_map>

namespace kiln::field {
namespace {

constexpr int kRowGrain = 2;
constexpr uint32_t kNothing = UINT32_MAX;

typedef float float4 __attribute__((vector_size(16)));
float4 all_of(float v) { return float4{v, v, v, v}; }

// What the surface is where an edge crosses it: the normal, of unit length and towards the empty side (0 where the gradient
// vanishes), and in the last place how far along the edge, (0, 1).
using Crossing = float4;
Crossing crossing(vec3 normal, float t) { return Crossing{normal.x, normal.y, normal.z, t}; }

constexpr int kRootSteps = 8;
constexpr float kRootTolerance = 1e-3f;       // voxels
constexpr float kNewtonReach = 0.1f;          // voxels off the surface from which one step by the gradient lands on it
constexpr float kGradientStep = 1.0f / 40;    // voxels an axis; a float's rounding at 1000 voxels is 6e-5
constexpr float kLeastFraction = 1.0f / 256;  // vertices stay this far inside their voxel: no two share a position
constexpr float kStill = 0.005f;              // voxels off the surface that need no second look
// Of the squared distances to the planes, how much is added for the distance to their middle: planes that agree leave a vertex
// there, planes that differ by more than about 10 degrees meet where they should.
constexpr float kMiddleWeight = 0.004f;

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

// The voxel across a face.
struct Voxel {
    size_t brick;
    ivec3 at;  // 0 … 6
};

// Where two voxels share an ambiguous face and each has a single loop through it, their two vertices would be joined by two edges, and
// four quads would meet in them. Cutting off the face's empty corners instead splits both loops (in a loop, two oriented
// segments a→b … c→d become a→d and c→b), and never joins others, so one pass in any fixed order mends all. Wenger, "Isosurfaces",
// 2013, shows the same for dual marching cubes with one ambiguous face a voxel.
class Flips {
public:
    Flips(const MeshEdges& edges, int workers) : edges_(edges), in_brick_(edges.bricks().bricks().size()) {
        const size_t count = in_brick_.size();
        std::vector<std::vector<Candidate>> found(count);
        parallel_for(
            count, workers, [&](int brick) { find(size_t(brick), found[size_t(brick)]); }, 64);
        for (const auto& candidates : found)
            for (const Candidate& c : candidates) mend(c);
    }

    uint32_t at(size_t brick, int z, int bit) const {
        if (!in_brick_[brick]) return 0;
        const auto it = flipped_.find(key(brick, z, bit));
        return it == flipped_.end() ? 0 : it->second;
    }
    const std::unordered_map<uint64_t, uint32_t>& all() const { return flipped_; }
    static size_t brick_of(uint64_t key) { return size_t(key >> 9); }
    static int z_of(uint64_t key) { return int(key >> 6 & 7); }
    static int bit_of(uint64_t key) { return int(key & 63); }

private:
    struct Candidate {
        Voxel voxel;
        int face;
    };
    static uint64_t key(size_t brick, int z, int bit) { return uint64_t(brick) << 9 | uint64_t(z * 64 + bit); }

    uint32_t signs(const Voxel& v) const { return corner_signs(edges_[v.brick].solid, v.at.z, v.at.y * 8 + v.at.x); }

    // Whether one loop has both segments of an ambiguous face.
    static bool one_loop(const CellLoops& loops, int face) {
        const int axis = face / 2;
        int first = -1;
        for (int e = 0; e < 12; ++e) {
            if (e / 4 == axis) continue;
            const int u = e / 4 == 0 ? 1 : 0;
            const bool on = ((axis == u ? e : e >> 1) & 1) == (face & 1);
            if (!on) continue;
            if (first >= 0 && loops.loop_of[e] != first) return false;
            first = loops.loop_of[e];
        }
        return true;
    }

    // Faces on the high sides only: each face is looked at from one voxel.
    void find(size_t index, std::vector<Candidate>& out) const {
        static const std::array<uint8_t, 256> faces = [] {
            std::array<uint8_t, 256> result{};
            for (uint32_t s = 0; s < 256; ++s)
                for (const int face : {1, 3, 5})
                    if ((ambiguous_faces(s) >> face & 1u) != 0 && one_loop(cell_tables().loops[s], face))
                        result[s] = uint8_t(result[s] | 1 << face);
            return result;
        }();
        const BrickEdges& brick = edges_[index];
        if (!brick.crossed) return;
        for (int z = 0; z < kBrickVoxels; ++z) {
            for (Slice left = active_voxels(brick.solid, z); left != 0; left &= left - 1) {
                const int bit = std::countr_zero(left);
                for (uint32_t f = faces[corner_signs(brick.solid, z, bit)]; f != 0; f &= f - 1)
                    out.push_back({{index, {bit & 7, bit >> 3, z}}, std::countr_zero(f)});
            }
        }
    }

    void mend(const Candidate& c) {
        Voxel other = c.voxel;
        int* const along[3] = {&other.at.x, &other.at.y, &other.at.z};
        int& moved = *along[c.face / 2];
        if (++moved == kBrickVoxels) {
            moved = 0;
            const ivec3 cell = edges_.bricks().bricks()[c.voxel.brick].cell;
            const int axis = c.face / 2;
            const auto neighbour = brick_at({cell.x + (axis == 0), cell.y + (axis == 1), cell.z + (axis == 2)});
            if (!neighbour) return;
            other.brick = *neighbour;
        }
        uint32_t& mine = flipped_[key(c.voxel.brick, c.voxel.at.z, c.voxel.at.y * 8 + c.voxel.at.x)];
        uint32_t& theirs = flipped_[key(other.brick, other.at.z, other.at.y * 8 + other.at.x)];
        if (!one_loop(cell_loops(signs(c.voxel), mine), c.face) ||
            !one_loop(cell_loops(signs(other), theirs), c.face ^ 1)) {
            return;
        }
        in_brick_[c.voxel.brick] = in_brick_[other.brick] = true;
        mine |= 1u << c.face;
        theirs |= 1u << (c.face ^ 1);
    }

    std::optional<size_t> brick_at(ivec3 cell) const {
        const MeshBricks::Row* row = edges_.bricks().row(cell.y, cell.z);
        if (row == nullptr) return std::nullopt;
        const auto all = edges_.bricks().bricks().subspan(row->first, row->end - row->first);
        const auto it =
            std::lower_bound(all.begin(), all.end(), cell.x, [](const MeshBrick& b, int x) { return b.cell.x < x; });
        if (it == all.end() || it->cell.x != cell.x) return std::nullopt;
        return size_t(row->first) + size_t(it - all.begin());
    }

    const MeshEdges& edges_;
    std::vector<bool> in_brick_;  // by brick: some of its voxels are in flipped_
    std::unordered_map<uint64_t, uint32_t> flipped_;
};

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
    Sharp(const MeshEdges& edges, const Flips& flips, const ExactBrick& exact, Mesh& out, Buffer<Crossing>& crossings,
          Buffer<uint32_t>& around)
        : edges_(edges),
          flips_(flips),
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
    void place(size_t index, Scratch& s) const {
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
                CellLoops flipped;
                const CellLoops& loops = loops_of(index, z * 64 + bit, flipped);
                const uint32_t* const from = numbers.data() + z * 64 + bit;
                for (int loop = 0; loop < loops.count; ++loop, ++made) {
                    const uint8_t* const begin = loops.edges + loops.first[loop];
                    const uint8_t* const end = loops.edges + loops.first[loop + 1];
                    Sheet& sheet = s.sheets[made];
                    sheet.voxel = uint16_t(z * 64 + bit);
                    sheet.loop = uint8_t(loop);
                    for (const uint8_t* edge = begin; edge != end; ++edge)
                        around_[4 * size_t(from[kEdgeOffset[*edge]]) + (*edge & 3u)] = first + made;
                    meet(begin, end, from, sheet);
                    // Two sheets of a voxel would reach through each other, were they to look for their creases. The crossings' hulls
                    // are apart.
                    if (loops.count > 1) sheet.at = safe(index, numbers, sheet).middle;
                }
            }
        }
        settle(index, numbers, s);
        for (size_t i = 0; i < count; ++i) out_.positions[first + i] = world(index, s.sheets[i].voxel, s.sheets[i].at);
    }

    // Edges of the brick with all four voxels around them.
    uint32_t count_quads(size_t index) const {
        uint32_t count = 0;
        for (uint32_t e = edges_[index].first_edge; e < edges_[index].first_edge + edges_[index].edges; ++e)
            count += whole(e);
        return count;
    }
    void write_quads(size_t index, uint32_t* to) const {
        const BrickEdges& edges = edges_[index];
        if (!edges.crossed) return;
        uint32_t e = edges.first_edge;
        for (int axis = 0; axis < 3; ++axis) {
            for (int z = 0; z < 8; ++z) {
                for (Slice left = edges.owned[size_t(axis * 8 + z)]; left != 0; left &= left - 1, ++e) {
                    if (!whole(e)) continue;
                    const int bit = std::countr_zero(left);
                    const bool low_is_solid = (edges.solid[size_t(z)] >> bit & 1u) != 0;
                    // Around the edge from +u +v over -u +v; u × v is the axis, for y its opposite.
                    const uint32_t* const q = around_.data() + 4 * size_t(e);
                    const bool forward = low_is_solid != (axis == 1);
                    const uint32_t ring[4] = {q[0], forward ? q[1] : q[2], q[3], forward ? q[2] : q[1]};
                    const vec3 middle = world(index, z * 64 + bit, on_edge(axis, crossings_[e][3]));
                    const int first = diagonal(ring, world(index, z * 64 + bit, {}), middle, axis, crossings_[e]);
                    for (const int corner : {0, 1, 2, 0, 2, 3}) *to++ = ring[(first + corner) & 3];
                }
            }
        }
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
    static vec3 on_edge(int axis, float t) { return {axis == 0 ? t : 0, axis == 1 ? t : 0, axis == 2 ? t : 0}; }
    vec3 world(vec3 texel, vec3 p) const { return {(texel.x + p.x) * h_, (texel.y + p.y) * h_, (texel.z + p.z) * h_}; }
    vec3 world(size_t brick, int texel, vec3 p) const {
        const ivec3 cell = edges_.bricks().bricks()[brick].cell;
        return world(vec3{float(cell.x * kBrickVoxels + (texel & 7)), float(cell.y * kBrickVoxels + (texel >> 3 & 7)),
                          float(cell.z * kBrickVoxels + (texel >> 6))},
                     p);
    }
    bool whole(uint32_t e) const {
        const uint32_t* const q = around_.data() + 4 * size_t(e);
        return q[0] != kNothing && q[1] != kNothing && q[2] != kNothing && q[3] != kNothing;
    }

    // Corners of a tetrahedron around each of the edges first … end - 1 of one axis, in four runs of `count`: a
    // value and a gradient for four evaluations, the gradient off by the step times the curvature.
    void add_tetrahedra(int axis, size_t first, size_t end, size_t count, Scratch& s) const {
        constexpr vec3 kCorner[4] = {{1, -1, -1}, {-1, -1, 1}, {-1, 1, -1}, {1, 1, 1}};
        const vec3 unit = on_edge(axis, 1);
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
                s.batch.add(world(texel(b.edge), on_edge(b.axis, s.t[b.edge])));
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
                    s.batch.add(world(texel(b.edge), on_edge(b.axis, s.t[b.edge]) + on_edge(axis, step)));
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

    const CellLoops& loops_of(size_t index, int voxel, CellLoops& flipped) const {
        const uint32_t signs = corner_signs(edges_[index].solid, voxel >> 6, voxel & 63);
        const uint32_t faces = flips_.at(index, voxel >> 6, voxel & 63);
        if (faces == 0) return loops_[signs];
        flipped = cell_loops(signs, faces);
        return flipped;
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

    // Points that lie on the sheet or near it whatever its planes do.
    struct Safe {
        vec3 middle, crossing;  // of the crossings, and the one nearest to it
    };
    Safe safe(size_t index, const EdgeNumbers& numbers, const Sheet& sheet) const {
        CellLoops flipped;
        const CellLoops& loops = loops_of(index, sheet.voxel, flipped);
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
            s.batch.add(world(index, s.sheets[i].voxel, candidate(s.sheets[i])));
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
        const auto stepped = [](const Sheet& sheet) { return inside(sheet.at - sheet.normal * sheet.off); };
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
        // Two sheets of a voxel may be driven into one corner of it.
        for (size_t i = 1; i < s.sheets.size(); ++i) {
            for (size_t j = i; j > 0 && s.sheets[j - 1].voxel == s.sheets[i].voxel; --j) {
                if (s.sheets[j - 1].at == s.sheets[i].at) s.sheets[i].at = safe(index, numbers, s.sheets[i]).crossing;
            }
        }
    }

    // Corner that the quad's diagonal starts from. The surface passes the quad's edge at the crossing: the diagonal nearer to it
    // lies along a crease. One that leaves the quad's own room comes last: the four tetrahedra of the lattice edge, a vertex and the next
    // one. Rooms of different edges only share faces, so quads that stay in theirs do not cross (Ju and Udeshi, "Intersection-free
    // contouring on an octree grid", 2006).
    int diagonal(const uint32_t (&ring)[4], vec3 low, vec3 middle, int axis, const Crossing& c) const {
        const vec3 normal{c[0], c[1], c[2]};
        float u[4], v[4], w[4], height[4];  // u, v across the edge from its line, w along it, voxels from its lower end
        for (size_t i = 0; i < 4; ++i) {
            const vec3 at = out_.positions[ring[i]], p = (at - low) * per_voxel_;
            height[i] = dot(at - middle, normal);
            u[i] = axis == 0 ? p.y : axis == 1 ? p.z : p.x;
            v[i] = axis == 0 ? p.z : axis == 1 ? p.x : p.y;
            w[i] = axis == 0 ? p.x : axis == 1 ? p.y : p.z;
        }
        // The diagonal passes the edge's line on the side of corner `side` where it meets the half plane of that corner.
        const auto stays = [&](int from, int to, int side) {
            const float before = u[from] * v[side] - v[from] * u[side], after = u[to] * v[side] - v[to] * u[side];
            const float share = before / (before - after);
            const float x = u[from] + (u[to] - u[from]) * share, y = v[from] + (v[to] - v[from]) * share;
            const float way = (x * u[side] + y * v[side]) / (u[side] * u[side] + v[side] * v[side]);
            if (way < 0) return true;  // on the other side, which is asked too
            const float at = w[from] + (w[to] - w[from]) * share;
            return way <= 1 && at >= way * w[side] && at <= 1 + way * (w[side] - 1);
        };
        const auto in_room = [&](int from) {
            return stays(from, (from + 2) & 3, from + 1) && stays(from, (from + 2) & 3, (from + 3) & 3);
        };
        const int wanted = std::fabs(height[1] + height[3]) < std::fabs(height[0] + height[2]) ? 1 : 0;
        return in_room(wanted) || !in_room(1 - wanted) ? wanted : 1 - wanted;
    }

    const MeshEdges& edges_;
    const Flips& flips_;
    const ExactBrick& exact_;
    Mesh& out_;
    Buffer<Crossing>& crossings_;
    Buffer<uint32_t>& around_;  // by edge: the vertices of the voxels around it, at (e & 3) of their edges
    const std::array<CellLoops, 256>& loops_ = cell_tables().loops;
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
    const Flips flips(edges, workers);
    out.brick_vertices.resize(count + 1);
    for (size_t i = 0; i < count; ++i) out.brick_vertices[i] = edges[i].items;
    for (const auto& [key, flipped] : flips.all()) {
        const size_t brick = Flips::brick_of(key);
        const uint32_t signs = corner_signs(edges[brick].solid, Flips::z_of(key), Flips::bit_of(key));
        out.brick_vertices[brick] += uint32_t(cell_loops(signs, flipped).count) - tables.loops[signs].count;
    }
    uint32_t vertices = 0;
    for (size_t i = 0; i < count; ++i) vertices += std::exchange(out.brick_vertices[i], vertices);
    out.brick_vertices[count] = vertices;
    out.positions.resize(vertices);

    Buffer<Crossing> crossings;
    Buffer<uint32_t> around;
    crossings.resize(edges.edge_count());
    around.resize(4 * size_t(edges.edge_count()));
    std::fill_n(around.data(), around.size(), kNothing);
    const Sharp sharp(edges, flips, exact, out, crossings, around);
    const auto each_brick = [&](auto&& fn) {
        parallel_for(
            bricks.rows().size(), workers,
            [&](int i) {
                thread_local Scratch scratch;
                const MeshBricks::Row& row = bricks.rows()[size_t(i)];
                for (size_t brick = row.first; brick < row.end; ++brick) fn(brick, scratch);
            },
            kRowGrain);
    };
    each_brick([&](size_t brick, Scratch& scratch) { sharp.cross(brick, scratch); });
    each_brick([&](size_t brick, Scratch& scratch) { sharp.place(brick, scratch); });

    std::vector<uint32_t> first_quad(count + 1);
    each_brick([&](size_t brick, Scratch&) { first_quad[brick + 1] = sharp.count_quads(brick); });
    for (size_t i = 0; i < count; ++i) first_quad[i + 1] += first_quad[i];
    out.triangles.resize(6 * size_t(first_quad[count]));
    each_brick([&](size_t brick, Scratch&) {
        sharp.write_quads(brick, out.triangles.data() + 6 * size_t(first_quad[brick]));
    });
}

}  // namespace kiln::field
