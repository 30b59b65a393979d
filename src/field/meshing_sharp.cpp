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

// What the surface is where an edge crosses it.
struct Crossing {
    vec3 normal;  // unit, towards the empty side; 0 where the gradient vanishes
    float t = 0;  // along the edge, (0, 1)
};

constexpr int kRootSteps = 8;
constexpr float kRootTolerance = 1e-3f;      // voxels
constexpr float kGradientStep = 1.0f / 32;   // voxels; a float's rounding at 1000 voxels is 6e-5
constexpr float kLeastFraction = 1.0f / 256;  // vertices stay this far inside their voxel: no two share a position
constexpr float kStill = 0.005f;             // voxels off the surface that need no second look
// Of the squared distances to the planes, how much is added for the distance to their middle: planes that agree leave a vertex
// there, planes that differ by more than about 10 degrees meet where they should.
constexpr float kMiddleWeight = 0.004f;

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
    explicit Flips(const MeshEdges& edges, int workers) : edges_(edges) {
        const size_t count = edges.bricks().bricks().size();
        std::vector<std::vector<Candidate>> found(count);
        parallel_for(
            count, workers, [&](int brick) { find(size_t(brick), found[size_t(brick)]); }, 64);
        for (const auto& candidates : found)
            for (const Candidate& c : candidates) mend(c);
    }

    uint32_t at(size_t brick, int z, int bit) const {
        if (flipped_.empty()) return 0;
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
        mine |= 1u << c.face;
        theirs |= 1u << (c.face ^ 1);
    }

    std::optional<size_t> brick_at(ivec3 cell) const {
        const MeshBricks::Row* row = edges_.bricks().row(cell.y, cell.z);
        if (row == nullptr) return std::nullopt;
        const auto all = edges_.bricks().bricks().subspan(row->first, row->end - row->first);
        const auto it = std::lower_bound(all.begin(), all.end(), cell.x,
                                         [](const MeshBrick& b, int x) { return b.cell.x < x; });
        if (it == all.end() || it->cell.x != cell.x) return std::nullopt;
        return size_t(row->first) + size_t(it - all.begin());
    }

    const MeshEdges& edges_;
    std::unordered_map<uint64_t, uint32_t> flipped_;
};

// Points for one call of `exact`, and what it answered.
struct Batch {
    std::vector<float> x, y, z, value;
    void clear() { x.clear(), y.clear(), z.clear(); }
    void add(float px, float py, float pz) { x.push_back(px), y.push_back(py), z.push_back(pz); }
    void run(const ExactBrick& exact, size_t brick) {
        value.resize(x.size());
        if (!x.empty()) exact(brick, {x.data(), y.data(), z.data(), int(x.size())}, value.data());
    }
};

struct Scratch {
    Batch batch;
    // By owned edge.
    std::vector<ivec3> texel;
    std::vector<float> low_t, high_t, low_value, high_value, t;
    std::vector<int8_t> kept_side;
    std::vector<uint32_t> open;
    // By vertex.
    std::vector<ivec3> voxel;
    std::vector<vec3> at, normal, fallback, middle;
    std::vector<float> off;
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

    // Crossings of the edges that a brick owns.
    void cross(size_t index, Scratch& s) const {
        const BrickEdges& edges = edges_[index];
        if (!edges.crossed || edges.edges == 0) return;
        const MeshBrick& brick = edges_.bricks().bricks()[index];
        const size_t count = edges.edges;
        s.texel.resize(count);
        s.low_t.assign(count, 0.0f);
        s.high_t.assign(count, 1.0f);
        s.low_value.resize(count);
        s.high_value.resize(count);
        s.t.resize(count);
        s.kept_side.assign(count, 0);
        s.open.resize(count);
        std::vector<uint8_t>& axes = axes_of(edges);
        size_t e = 0;
        for (int axis = 0; axis < 3; ++axis) {
            const int step = axis == 0 ? 1 : axis == 1 ? 8 : 64;
            for (int z = 0; z < 8; ++z) {
                for (Slice left = edges.owned[size_t(axis * 8 + z)]; left != 0; left &= left - 1, ++e) {
                    const int bit = std::countr_zero(left);
                    s.texel[e] = {brick.cell.x * kBrickVoxels + (bit & 7), brick.cell.y * kBrickVoxels + (bit >> 3),
                                  brick.cell.z * kBrickVoxels + z};
                    s.low_value[e] = stored_voxels(brick.codes, edges_.bricks().format(), z * 64 + bit);
                    s.high_value[e] = stored_voxels(brick.codes, edges_.bricks().format(), z * 64 + bit + step);
                    s.open[e] = uint32_t(e);
                    axes[e] = uint8_t(axis);
                }
            }
        }
        find_roots(index, s, axes);
        find_normals(index, s, axes, crossings_.data() + edges.first_edge);
    }

    // Vertices of a brick's voxels, and the quads' corners.
    void place(size_t index, Scratch& s) const {
        const BrickEdges& edges = edges_[index];
        if (!edges.crossed) return;
        EdgeNumbers numbers;
        edges_.number(index, numbers);
        const MeshBrick& brick = edges_.bricks().bricks()[index];
        const uint32_t first = out_.brick_vertices[index];
        s.voxel.clear(), s.at.clear(), s.normal.clear(), s.fallback.clear(), s.middle.clear();
        for (int z = 0; z < kBrickVoxels; ++z) {
            for (Slice left = active_voxels(edges.solid, z); left != 0; left &= left - 1) {
                const int bit = std::countr_zero(left);
                const uint32_t signs = corner_signs(edges.solid, z, bit);
                const uint32_t flipped = flips_.at(index, z, bit);
                CellLoops other;
                if (flipped != 0) other = cell_loops(signs, flipped);
                const CellLoops& loops = flipped != 0 ? other : cell_tables().loops[signs];
                const uint32_t* const from = numbers.data() + z * 64 + bit;
                for (int loop = 0; loop < loops.count; ++loop) {
                    const uint8_t* const begin = loops.edges + loops.first[loop];
                    const uint8_t* const end = loops.edges + loops.first[loop + 1];
                    const uint32_t vertex = first + uint32_t(s.at.size());
                    for (const uint8_t* edge = begin; edge != end; ++edge)
                        around_[4 * size_t(from[kEdgeOffset[*edge]]) + (*edge & 3u)] = vertex;
                    s.voxel.push_back({brick.cell.x * kBrickVoxels + (bit & 7),
                                       brick.cell.y * kBrickVoxels + (bit >> 3), brick.cell.z * kBrickVoxels + z});
                    meet(begin, end, from, s);
                }
            }
        }
        settle(index, s);
        for (size_t i = 0; i < s.at.size(); ++i) out_.positions[first + i] = world(s.voxel[i], s.at[i]);
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
        const ivec3 cell = edges_.bricks().bricks()[index].cell;
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
                    const ivec3 texel{cell.x * kBrickVoxels + (bit & 7), cell.y * kBrickVoxels + (bit >> 3),
                                      cell.z * kBrickVoxels + z};
                    const int first = diagonal(ring, texel, axis, crossings_[e]);
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
    static std::vector<uint8_t>& axes_of(const BrickEdges& edges) {
        thread_local std::vector<uint8_t> axes;
        axes.resize(edges.edges);
        return axes;
    }
    vec3 world(ivec3 texel, vec3 p) const {
        return {(float(texel.x) + p.x) * h_, (float(texel.y) + p.y) * h_, (float(texel.z) + p.z) * h_};
    }
    static vec3 on_edge(int axis, float t) { return {axis == 0 ? t : 0, axis == 1 ? t : 0, axis == 2 ? t : 0}; }
    bool whole(uint32_t e) const {
        const uint32_t* const q = around_.data() + 4 * size_t(e);
        return q[0] != kNothing && q[1] != kNothing && q[2] != kNothing && q[3] != kNothing;
    }

    // False position with the Illinois rule (Dowell and Jarratt, 1971): the ends' signs are those of the texels.
    void find_roots(size_t index, Scratch& s, const std::vector<uint8_t>& axes) const {
        for (int step = 0; step < kRootSteps && !s.open.empty(); ++step) {
            s.batch.clear();
            for (const uint32_t e : s.open) {
                const float a = s.low_value[e], b = s.high_value[e];
                float share = a / (a - b);
                if (!(share > 0.0f && share < 1.0f)) share = 0.5f;
                const float t = s.low_t[e] + (s.high_t[e] - s.low_t[e]) * share;
                s.t[e] = std::min(std::max(t, kLeastFraction), 1 - kLeastFraction);
                const vec3 p = world(s.texel[e], on_edge(axes[e], s.t[e]));
                s.batch.add(p.x, p.y, p.z);
            }
            s.batch.run(exact_, index);
            size_t kept = 0;
            for (size_t i = 0; i < s.open.size(); ++i) {
                const uint32_t e = s.open[i];
                const float value = s.batch.value[i] * per_voxel_;
                if (std::fabs(value) <= kRootTolerance || s.t[e] == kLeastFraction || s.t[e] == 1 - kLeastFraction) {
                    if (std::fabs(value) <= kRootTolerance || step > 0) continue;
                }
                const bool low_side = (value <= 0) == (s.low_value[e] <= 0);
                if (low_side) {
                    s.low_t[e] = s.t[e];
                    s.low_value[e] = value;
                    if (s.kept_side[e] == 1) s.high_value[e] *= 0.5f;
                } else {
                    s.high_t[e] = s.t[e];
                    s.high_value[e] = value;
                    if (s.kept_side[e] == -1) s.low_value[e] *= 0.5f;
                }
                s.kept_side[e] = low_side ? int8_t(1) : int8_t(-1);
                s.open[kept++] = e;
            }
            s.open.resize(kept);
        }
    }

    // Central differences of the exact field.
    void find_normals(size_t index, Scratch& s, const std::vector<uint8_t>& axes, Crossing* to) const {
        s.batch.clear();
        for (size_t e = 0; e < s.t.size(); ++e) {
            const vec3 p = on_edge(axes[e], s.t[e]);
            for (int axis = 0; axis < 3; ++axis) {
                for (const float step : {kGradientStep, -kGradientStep}) {
                    const vec3 q = world(s.texel[e], p + on_edge(axis, step));
                    s.batch.add(q.x, q.y, q.z);
                }
            }
        }
        s.batch.run(exact_, index);
        for (size_t e = 0; e < s.t.size(); ++e) {
            const float* const v = s.batch.value.data() + 6 * e;
            const vec3 g{v[0] - v[1], v[2] - v[3], v[4] - v[5]};
            const float size = length(g);
            to[e] = {size > 1e-3f * kGradientStep * h_ ? g / size : vec3{}, s.t[e]};
        }
    }

    // Where the planes of one loop meet, near the middle of its crossings.
    void meet(const uint8_t* begin, const uint8_t* end, const uint32_t* from, Scratch& s) const {
        vec3 points[12], middle{}, normal{};
        int count = 0;
        for (const uint8_t* edge = begin; edge != end; ++edge, ++count) {
            const Crossing& c = crossings_[from[kEdgeOffset[*edge]]];
            const int axis = *edge / 4;
            const float u = float(*edge & 1), v = float(*edge >> 1 & 1);
            points[count] = axis == 0 ? vec3{c.t, u, v} : axis == 1 ? vec3{u, c.t, v} : vec3{u, v, c.t};
            middle = middle + points[count];
            normal = normal + c.normal;
        }
        middle = middle / float(count);
        float xx = kMiddleWeight * float(count), yy = xx, zz = xx, xy = 0, xz = 0, yz = 0;
        vec3 right{};
        count = 0;
        for (const uint8_t* edge = begin; edge != end; ++edge, ++count) {
            const vec3 n = crossings_[from[kEdgeOffset[*edge]]].normal;
            xx += n.x * n.x, yy += n.y * n.y, zz += n.z * n.z;
            xy += n.x * n.y, xz += n.x * n.z, yz += n.y * n.z;
            right = right + n * dot(n, points[count] - middle);
        }
        // Cramer's rule: the weight keeps the determinant above 0.
        const float c_xx = yy * zz - yz * yz, c_xy = xz * yz - xy * zz, c_xz = xy * yz - xz * yy;
        const float c_yy = xx * zz - xz * xz, c_yz = xy * xz - xx * yz, c_zz = xx * yy - xy * xy;
        const float scale = 1 / (xx * c_xx + xy * c_xy + xz * c_xz);
        const vec3 step{scale * (c_xx * right.x + c_xy * right.y + c_xz * right.z),
                        scale * (c_xy * right.x + c_yy * right.y + c_yz * right.z),
                        scale * (c_xz * right.x + c_yz * right.y + c_zz * right.z)};
        const float size = length(normal);
        s.at.push_back(inside(middle + step));
        s.normal.push_back(size > 0 ? normal / size : vec3{});
        s.middle.push_back(inside(middle));
        vec3 nearest = points[0];
        for (int i = 1; i < count; ++i) {
            const vec3 a = points[i] - middle, b = nearest - middle;
            if (dot(a, a) < dot(b, b)) nearest = points[i];
        }
        s.fallback.push_back(inside(nearest));
    }
    static vec3 inside(vec3 p) {
        const vec3 low{kLeastFraction, kLeastFraction, kLeastFraction};
        return min(max(p, low), vec3{1, 1, 1} - low);
    }

    // Tries `candidate(i)` for the vertices off the surface by more than `off`, and keeps it where it is nearer.
    template <typename Candidate>
    void improve(size_t index, float off, Candidate&& candidate, Scratch& s) const {
        s.batch.clear();
        s.open.clear();
        for (size_t i = 0; i < s.at.size(); ++i) {
            if (!(std::fabs(s.off[i]) > off)) continue;
            s.open.push_back(uint32_t(i));
            const vec3 p = world(s.voxel[i], candidate(i));
            s.batch.add(p.x, p.y, p.z);
        }
        s.batch.run(exact_, index);
        for (size_t k = 0; k < s.open.size(); ++k) {
            const size_t i = s.open[k];
            const float value = s.batch.value[k] * per_voxel_;
            if (!(std::fabs(value) < std::fabs(s.off[i]))) continue;
            s.at[i] = candidate(i);
            s.off[i] = value;
        }
    }

    // Planes only meet on the surface where it is flat: measure, step once along the normal, and where that is not enough take the
    // middle of the crossings, stepped too, or a crossing itself.
    void settle(size_t index, Scratch& s) const {
        s.off.assign(s.at.size(), std::numeric_limits<float>::infinity());
        improve(index, 0.0f, [&](size_t i) { return s.at[i]; }, s);
        const auto stepped = [&](size_t i) { return inside(s.at[i] - s.normal[i] * s.off[i]); };
        improve(index, kStill, stepped, s);
        improve(index, kSharpTolerance, stepped, s);
        improve(index, kSharpTolerance, [&](size_t i) { return s.middle[i]; }, s);
        improve(index, kSharpTolerance, stepped, s);
        improve(index, kSharpTolerance, [&](size_t i) { return s.fallback[i]; }, s);
        // Two sheets of a voxel may be driven into one corner of it.
        for (size_t i = 1; i < s.at.size(); ++i) {
            for (size_t j = i; j > 0 && s.voxel[j - 1] == s.voxel[i]; --j)
                if (s.at[j - 1] == s.at[i]) s.at[i] = s.fallback[i];
        }
    }

    // Corner that the quad's diagonal starts from. The surface passes the quad's edge at the crossing: the diagonal nearer to it
    // lies along a crease. A diagonal that turns a triangle over comes last.
    int diagonal(const uint32_t (&ring)[4], ivec3 texel, int axis, const Crossing& c) const {
        const vec3 middle = world(texel, on_edge(axis, c.t));
        vec3 p[4];
        for (size_t i = 0; i < 4; ++i) p[i] = (out_.positions[ring[i]] - middle) * per_voxel_;
        float cost[2];
        for (size_t first = 0; first < 2; ++first) {
            const vec3 &a = p[first], &b = p[first + 1], &d = p[first + 2], &e = p[(first + 3) & 3];
            cost[first] = std::fabs(dot(c.normal, a + d)) * 0.5f;
            if (dot(kiln::cross(b - a, d - a), c.normal) < 0) cost[first] += 4;
            if (dot(kiln::cross(d - a, e - a), c.normal) < 0) cost[first] += 4;
        }
        return cost[1] < cost[0] ? 1 : 0;
    }

    const MeshEdges& edges_;
    const Flips& flips_;
    const ExactBrick& exact_;
    Mesh& out_;
    Buffer<Crossing>& crossings_;
    Buffer<uint32_t>& around_;  // by edge: the vertices of the voxels around it, at (e & 3) of their edges
    const float h_, per_voxel_;
};

}  // namespace

ExactBrick exact_of(const HostBricks& host, const MeshBricks& bricks) {
    return [&host, &bricks](size_t brick, const sdf::Points& points, float* out) {
        const Field& field = host.field();
        const BrickRecord& record = field.records()[bricks.bricks()[brick].slot];
        sdf::evaluate(sdf::view(field.program(), field.code().subspan(record.code_first, record.code_count)), points, out);
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
