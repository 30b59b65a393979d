// SPDX-License-Identifier: MIT
// Steps: heal; find the bricks that the surface crosses; sample distance and winding number there; where the mesh is open, follow the
// sheet of winding number one half and take it into the surface; add a ring of bricks around; make the whole 1-Lipschitz.
//
// Between levels: a brick of the ring blends from its samples to the trilinear values of the coarse lattice, by the trilinear weight of
// its corners (1 where a coarse brick touches). So both levels agree on every shared face, and bricks on the surface are left alone.

#include "model/bake.h"

#include "model/lipschitz.h"
#include "model/triangle_tree.h"

#include "base/format.h"
#include "base/parallel_for.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>
#include <optional>

namespace kiln::model {
namespace {

constexpr int kCells = sdf::MeshGrid::kBrickCells;  // 7
constexpr int kSide = kCells + 1;                   // samples
constexpr int kBrickSamples = kSide * kSide * kSide;
constexpr int kKnots[4] = {0, 2, 5, kCells};  // see distances()
/// Air around the mesh's box, in cells. Beyond it the text knows less of the distance; the solid keeps inside it (MeshGrid).
constexpr float kAir = sdf::MeshGrid::kAirCells + 1;
/// More than one half by what float sums are off: a sheet does not become solid where a sample lies on it.
constexpr float kInside = 0.5001f;
constexpr size_t kMostPieces = size_t(1) << 23;
constexpr float kUnclear = 0.25f;  // |w - 1/2| below this

struct Brick {
    int x, y, z;
    bool surface = false;                     // crossed by the mesh or its cap
    std::array<uint32_t, kBrickSamples> ids;  // of the samples; neighbours share theirs
    std::array<bool, kBrickSamples> own;      // this brick computes it
};

int at(int i, int j, int k) { return i + kSide * (j + kSide * k); }

class Baker {
public:
    Baker(const Triangles& mesh, const BakeOptions& options, Topology topology) : mesh_(mesh), options_(options) {
        report_.topology = topology;
        report_.claimed_closed = options.closed;
    }

    Result<Baked> run(const std::string& name) {
        place();
        const TriangleTree whole(local_, mesh_.faces);
        whole_ = surface_ = &whole;
        coarse_level();
        surface_bricks();
        sample(0);
        // Parts that lie in each other: what is inside the solid is not its surface.
        std::optional<TriangleTree> outer;
        if (overlaps()) {
            std::vector<Face> faces = separating_pieces();
            report_.overlapping = true;
            outer.emplace(local_, faces);
            surface_ = &*outer;
            start_again();
            coarse_level();
            surface_bricks();
            sample(0);
        }
        std::optional<TriangleTree> cap;
        if (!report_.topology.balanced) {
            follow_openings();
            cap.emplace(cap_positions_, cap_faces_);
            report_.cap_triangles = cap_faces_.size();
        }
        bool solid = false;
        for (size_t s = 0; s < samples_; ++s) solid = solid || (winding_[s] > kInside && off_surface(s));
        if (!solid)
            return Error{name +
                             ": encloses nothing that its resolution can show; is it a sheet without an inside? Close "
                             "it, or raise \"resolution\"",
                         ErrorKind::Input};
        const size_t first_of_ring = bricks_.size();
        ring();
        sample(first_of_ring);
        count_unclear();
        if (cap && !cap->empty()) reach_of(*cap);
        sign();
        flatten();
        Baked out;
        out.grid = packed();
        report_.bricks = bricks_.size();
        report_.bytes = out.grid.values.size() * sizeof(float);
        out.report = report_;
        return out;
    }

private:
    // ---- The grid. Local space: the mesh's own unit and axes, around the middle of its box.

    void place() {
        Box3 box;
        for (const Face& f : mesh_.faces)
            for (const uint32_t c : f) box = box_union(box, {mesh_.positions[c], mesh_.positions[c]});
        middle_ = box.center();
        const vec3 size = box.max - box.min;
        cell_ = std::max({size.x, size.y, size.z}) / float(options_.resolution);
        report_.cell = cell_;
        solid_ = {box.min - middle_, box.max - middle_};
        lo_ = solid_.min - vec3{kAir, kAir, kAir} * cell_;
        hi_ = solid_.max + vec3{kAir, kAir, kAir} * cell_;
        // One cell more than fits exactly: rounding must not carry a point of the box past the last brick.
        const auto count = [&](float side) { return int(std::floor(side / (cell_ * float(kCells)) + 1e-3f)) + 1; };
        columns_ = count(hi_.x - lo_.x);
        rows_ = count(hi_.y - lo_.y);
        layers_ = count(hi_.z - lo_.z);
        local_.reserve(mesh_.positions.size());
        for (const vec3& p : mesh_.positions)
            local_.push_back({float(double(p.x) - double(middle_.x)), float(double(p.y) - double(middle_.y)),
                              float(double(p.z) - double(middle_.z))});
        table_.assign(size_t(columns_) * size_t(rows_) * size_t(layers_), -1);
    }

    vec3 node(int i, int j, int k) const {
        return {lo_.x + float(i) * cell_, lo_.y + float(j) * cell_, lo_.z + float(k) * cell_};
    }
    bool exists(int x, int y, int z) const {
        return x >= 0 && y >= 0 && z >= 0 && x < columns_ && y < rows_ && z < layers_;
    }
    size_t slot(int x, int y, int z) const {
        return size_t(x) + size_t(columns_) * (size_t(y) + size_t(rows_) * size_t(z));
    }
    size_t coarse_at(int x, int y, int z) const {
        return size_t(x) + size_t(columns_ + 1) * (size_t(y) + size_t(rows_ + 1) * size_t(z));
    }
    int brick_at(int x, int y, int z) const { return exists(x, y, z) ? table_[slot(x, y, z)] : -1; }

    // Beyond the mesh's box nothing is solid, whatever the winding number of a broken mesh says.
    float winding_at(vec3 p) const { return solid_.contains(p) ? whole_->winding(p) : 0.0f; }
    float distance_at(vec3 p, int32_t* near) const {
        return std::sqrt(surface_->squared_distance(p, std::numeric_limits<float>::infinity(), near));
    }

    void coarse_level() {
        const size_t count = size_t(columns_ + 1) * size_t(rows_ + 1) * size_t(layers_ + 1);
        coarse_.resize(count);
        coarse_winding_.resize(count);
        parallel_for((rows_ + 1) * (layers_ + 1), options_.workers, [&](int row) {
            const int y = row % (rows_ + 1), z = row / (rows_ + 1);
            int32_t near = -1;
            for (int x = 0; x <= columns_; ++x) {
                const vec3 p = node(kCells * x, kCells * y, kCells * z);
                coarse_[coarse_at(x, y, z)] = distance_at(p, &near);
                coarse_winding_[coarse_at(x, y, z)] = winding_at(p);
            }
        });
    }

    // ---- Bricks.

    // A brick with its samples numbered; those on faces shared with bricks that exist already keep their numbers.
    void add(int x, int y, int z, bool surface) {
        int32_t& place = table_[slot(x, y, z)];
        place = int32_t(bricks_.size());
        Brick& b = bricks_.emplace_back();
        b.x = x;
        b.y = y;
        b.z = z;
        b.surface = surface;
        b.ids.fill(UINT32_MAX);
        for (int dz = -1; dz <= 1; ++dz)
            for (int dy = -1; dy <= 1; ++dy)
                for (int dx = -1; dx <= 1; ++dx) {
                    if (dx == 0 && dy == 0 && dz == 0) continue;
                    const int other = brick_at(x + dx, y + dy, z + dz);
                    if (other < 0) continue;
                    const Brick& o = bricks_[size_t(other)];
                    // Shared range on each axis: one face, or all.
                    const auto range = [](int d) {
                        return d == 0 ? std::pair(0, kCells) : d < 0 ? std::pair(0, 0) : std::pair(kCells, kCells);
                    };
                    const auto [x0, x1] = range(dx);
                    const auto [y0, y1] = range(dy);
                    const auto [z0, z1] = range(dz);
                    for (int k = z0; k <= z1; ++k)
                        for (int j = y0; j <= y1; ++j)
                            for (int i = x0; i <= x1; ++i)
                                b.ids[size_t(at(i, j, k))] =
                                    o.ids[size_t(at(i - kCells * dx, j - kCells * dy, k - kCells * dz))];
                }
        for (size_t s = 0; s < b.ids.size(); ++s) {
            b.own[s] = b.ids[s] == UINT32_MAX;
            if (b.own[s]) b.ids[s] = samples_++;
        }
    }

    // Eight balls cover a brick: half a half's diagonal around the middles of its octants.
    bool crossed(int x, int y, int z) const {
        const float half = 0.5f * float(kCells) * cell_;
        const float reach = std::sqrt(3.0f) * half * 1.0001f;
        const vec3 middle = node(kCells * x, kCells * y, kCells * z) + vec3{half, half, half};
        if (!(surface_->squared_distance(middle, reach * reach) < reach * reach)) return false;
        for (int o = 0; o < 8; ++o) {
            const vec3 p =
                middle + 0.5f * half * vec3{(o & 1) ? 1.0f : -1.0f, (o & 2) ? 1.0f : -1.0f, (o & 4) ? 1.0f : -1.0f};
            if (surface_->squared_distance(p, 0.25f * reach * reach) < 0.25f * reach * reach) return true;
        }
        return false;
    }

    void surface_bricks() {
        std::vector<uint8_t> marks(table_.size(), 0);
        parallel_for(rows_ * layers_, options_.workers, [&](int row) {
            const int y = row % rows_, z = row / rows_;
            for (int x = 0; x < columns_; ++x) marks[slot(x, y, z)] = crossed(x, y, z);
        });
        // Where it is open, also the bricks whose corners lie on both sides.
        if (!report_.topology.balanced) {
            for (int z = 0; z < layers_; ++z)
                for (int y = 0; y < rows_; ++y)
                    for (int x = 0; x < columns_; ++x) {
                        int inside = 0;
                        for (int c = 0; c < 8; ++c)
                            inside += coarse_winding_[coarse_at(x + (c & 1), y + (c >> 1 & 1), z + (c >> 2))] > kInside;
                        if (inside != 0 && inside != 8) marks[slot(x, y, z)] = 1;
                    }
        }
        for (int z = 0; z < layers_; ++z)
            for (int y = 0; y < rows_; ++y)
                for (int x = 0; x < columns_; ++x)
                    if (marks[slot(x, y, z)] != 0) add(x, y, z, true);
    }

    // Distances and winding numbers of the samples that bricks from `first` on own.
    void sample(size_t first) {
        distance_.resize(samples_);
        winding_.resize(samples_);
        unclear_.resize(samples_);
        parallel_for(bricks_.size() - first, options_.workers, [&](int n) { distances(bricks_[first + size_t(n)]); });
        parallel_for(bricks_.size() - first, options_.workers,
                     [&](int n) { between_knots(bricks_[first + size_t(n)]); });
        parallel_for(bricks_.size() - first, options_.workers, [&](int n) { windings(bricks_[first + size_t(n)]); });
    }

    // Bricks on the surface: every sample. Bricks of the ring are seven cells away, where a distance is nearly straight: samples on a
    // lattice of 0, 2, 5, 7, and between them linear.
    void distances(const Brick& b) {
        int32_t near = -1;
        const auto exact = [&](int i, int j, int k) {
            const auto s = size_t(at(i, j, k));
            if (b.own[s])
                distance_[b.ids[s]] = distance_at(node(kCells * b.x + i, kCells * b.y + j, kCells * b.z + k), &near);
        };
        if (b.surface) {
            for (int k = 0; k < kSide; ++k)
                for (int jj = 0; jj < kSide; ++jj) {
                    const int j = (k & 1) ? kCells - jj : jj;  // back and forth: each sample beside the last
                    for (int ii = 0; ii < kSide; ++ii) exact(((j + k) & 1) ? kCells - ii : ii, j, k);
                }
            return;
        }
        for (int k = 0; k < 4; ++k)
            for (int jj = 0; jj < 4; ++jj) {
                const int j = (k & 1) ? 3 - jj : jj;
                for (int ii = 0; ii < 4; ++ii) exact(kKnots[((j + k) & 1) ? 3 - ii : ii], kKnots[j], kKnots[k]);
            }
    }

    // The rest of a brick of the ring.
    void between_knots(const Brick& b) {
        if (b.surface) return;
        const auto span_of = [&](int c) { return c < 2 ? 0 : c < 5 ? 1 : 2; };
        for (int s = 0; s < kBrickSamples; ++s) {
            if (!b.own[size_t(s)]) continue;
            const int c[3] = {s % kSide, s / kSide % kSide, s / (kSide * kSide)};
            float t[3];
            int lo[3], hi[3];
            bool knot = true;
            for (size_t axis = 0; axis < 3; ++axis) {
                lo[axis] = kKnots[span_of(c[axis])];
                hi[axis] = kKnots[span_of(c[axis]) + 1];
                t[axis] = float(c[axis] - lo[axis]) / float(hi[axis] - lo[axis]);
                knot = knot && (c[axis] == lo[axis] || c[axis] == hi[axis]);
            }
            if (knot) continue;
            float corner[8];
            for (int n = 0; n < 8; ++n)
                corner[n] = distance_[b.ids[size_t(
                    at((n & 1) ? hi[0] : lo[0], (n & 2) ? hi[1] : lo[1], (n & 4) ? hi[2] : lo[2]))]];
            distance_[b.ids[size_t(s)]] = trilinear(corner, t);
        }
    }

    // Samples between which no triangle can pass (their distances add up to more than the step) have one winding number if the mesh
    // is balanced, and a smooth one otherwise: one or a few stand for all of them, unless they are unclear.
    void windings(const Brick& b) {
        std::array<int16_t, kBrickSamples> group;
        group.fill(-1);
        std::array<int16_t, kBrickSamples> queue;
        const auto place = [&](int s) {
            return node(kCells * b.x + s % kSide, kCells * b.y + s / kSide % kSide, kCells * b.z + s / (kSide * kSide));
        };
        for (int root = 0; root < kBrickSamples; ++root) {
            if (group[size_t(root)] >= 0) continue;
            int size = 0;
            queue[size_t(size++)] = int16_t(root);
            group[size_t(root)] = int16_t(root);
            int farthest = root;
            bool owns = false;
            for (int n = 0; n < size; ++n) {
                const int s = queue[size_t(n)];
                const float d = distance_[b.ids[size_t(s)]];
                owns = owns || b.own[size_t(s)];
                if (d > distance_[b.ids[size_t(farthest)]]) farthest = s;
                const int xyz[3] = {s % kSide, s / kSide % kSide, s / (kSide * kSide)};
                const int step[3] = {1, kSide, kSide * kSide};
                for (size_t axis = 0; axis < 3; ++axis) {
                    for (const int sign : {-1, 1}) {
                        const int c = xyz[axis] + sign;
                        if (c < 0 || c > kCells) continue;
                        const int other = s + sign * step[axis];
                        if (group[size_t(other)] >= 0) continue;
                        if (!(d + distance_[b.ids[size_t(other)]] > cell_ * 1.001f)) continue;
                        group[size_t(other)] = int16_t(root);
                        queue[size_t(size++)] = int16_t(other);
                    }
                }
            }
            if (!owns) continue;
            bool one_for_all = report_.topology.balanced;
            float value = 0;
            if (one_for_all) {
                value = winding_at(place(farthest));
            } else {
                int seen = 0, inside = 0;
                bool clear = true;
                for (int n = 0; n < size && clear; ++n) {
                    const int s = queue[size_t(n)];
                    const auto on = [](int c) { return c == 0 || c == 3 || c == kCells; };
                    if (!on(s % kSide) || !on(s / kSide % kSide) || !on(s / (kSide * kSide))) continue;
                    value = winding_at(place(s));
                    ++seen;
                    inside += value > kInside;
                    clear = std::fabs(value - 0.5f) > kUnclear;
                }
                one_for_all = clear && seen >= 3 && (inside == 0 || inside == seen);
            }
            for (int n = 0; n < size; ++n) {
                const auto s = size_t(queue[size_t(n)]);
                if (!b.own[s]) continue;
                const float w = one_for_all ? value : winding_at(place(int(s)));
                winding_[b.ids[s]] = w;
                unclear_[b.ids[s]] = std::fabs(w - 0.5f) < kUnclear;
            }
        }
    }

    // ---- Parts inside other parts.

    // On the triangles themselves floats may say anything.
    bool off_surface(size_t sample) const { return distance_[sample] > 0.01f * cell_; }

    bool overlaps() const {
        for (size_t s = 0; s < samples_; ++s)
            if ((winding_[s] > 1.5f || winding_[s] < -0.5f) && off_surface(s)) return true;
        return false;
    }

    void start_again() {
        std::fill(table_.begin(), table_.end(), -1);
        bricks_.clear();
        samples_ = 0;
    }

    // Pieces of triangles, at most two cells long, with the inside on one face and the outside on the other. Their new corners are added
    // to the positions.
    std::vector<Face> separating_pieces() {
        std::vector<Face> pieces = mesh_.faces, out;
        const float longest = 4 * cell_ * cell_;
        for (size_t n = 0; n < pieces.size() && pieces.size() < kMostPieces;) {
            Face& f = pieces[n];
            size_t longest_edge = 0;
            float most = 0;
            for (size_t k = 0; k < 3; ++k) {
                const vec3 e = local_[f[(k + 1) % 3]] - local_[f[k]];
                if (dot(e, e) > most) {
                    most = dot(e, e);
                    longest_edge = k;
                }
            }
            if (most <= longest) {
                ++n;
                continue;
            }
            const uint32_t a = f[longest_edge], b = f[(longest_edge + 1) % 3], c = f[(longest_edge + 2) % 3];
            const auto middle = uint32_t(local_.size());
            local_.push_back(0.5f * (local_[a] + local_[b]));
            f = {a, middle, c};
            pieces.push_back({middle, b, c});
        }
        std::vector<uint8_t> keep(pieces.size(), 0);
        parallel_for(
            pieces.size(), options_.workers,
            [&](int n) {
                const Face& f = pieces[size_t(n)];
                const vec3 a = local_[f[0]], b = local_[f[1]], c = local_[f[2]];
                const vec3 across = cross(b - a, c - a);
                const float size = length(across);
                const vec3 middle = (a + b + c) / 3.0f;
                const vec3 step = size > 0 ? across * (0.05f * cell_ / size) : vec3{};
                keep[size_t(n)] = size > 0 && (whole_->winding(middle + step) > kInside) !=
                                                  (whole_->winding(middle - step) > kInside);
            },
            64);
        for (size_t n = 0; n < pieces.size(); ++n)
            if (keep[n] != 0) out.push_back(pieces[n]);
        return out;
    }

    void count_unclear() {
        size_t near = 0, unclear = 0;
        for (size_t s = 0; s < samples_; ++s) {
            if (!(distance_[s] < 1.5f * cell_) || !off_surface(s)) continue;
            ++near;
            unclear += unclear_[s];
        }
        report_.ambiguous_share = near > 0 ? float(double(unclear) / double(near)) : 0;
    }

    // ---- Openings.

    bool inside(uint32_t id) const { return winding_[id] > kInside; }
    // The sides differ, and no triangle lies between: the sheet of winding number one half does.
    bool opening(uint32_t a, uint32_t b, float step) const {
        return inside(a) != inside(b) && distance_[a] + distance_[b] > step * 1.001f;
    }

    // Bricks into which the sheet goes on, wave by wave; then its triangles.
    void follow_openings() {
        for (size_t from = 0; from < bricks_.size();) {
            const size_t end = bricks_.size();
            for (size_t n = from; n < end; ++n) {
                for (int face = 0; face < 6; ++face) {
                    const Brick& b = bricks_[n];
                    const int axis = face / 2, sign = face % 2 == 0 ? -1 : 1;
                    const int x = b.x + (axis == 0 ? sign : 0), y = b.y + (axis == 1 ? sign : 0),
                              z = b.z + (axis == 2 ? sign : 0);
                    if (!exists(x, y, z) || brick_at(x, y, z) >= 0) continue;
                    const int fixed = sign < 0 ? 0 : kCells;
                    bool in = false, out = false;
                    for (int v = 0; v < kSide; ++v)
                        for (int u = 0; u < kSide; ++u) {
                            const int s = axis == 0 ? at(fixed, u, v) : axis == 1 ? at(u, fixed, v) : at(u, v, fixed);
                            (inside(b.ids[size_t(s)]) ? in : out) = true;
                        }
                    if (in && out) add(x, y, z, true);
                }
            }
            sample(end);
            from = end;
        }
        for (const Brick& b : bricks_) cap_of(b);
    }

    // Each cell in six tetrahedra around its diagonal; in each, the zero of the linear interpolant of w - 1/2.
    void cap_of(const Brick& b) {
        constexpr int kTets[6][4] = {{0, 1, 3, 7}, {0, 3, 2, 7}, {0, 2, 6, 7},
                                     {0, 6, 4, 7}, {0, 4, 5, 7}, {0, 5, 1, 7}};
        for (int k = 0; k < kCells; ++k)
            for (int j = 0; j < kCells; ++j)
                for (int i = 0; i < kCells; ++i) {
                    uint32_t ids[8];
                    int in = 0;
                    for (int c = 0; c < 8; ++c) {
                        ids[c] = b.ids[size_t(at(i + (c & 1), j + (c >> 1 & 1), k + (c >> 2)))];
                        in += inside(ids[c]);
                    }
                    if (in == 0 || in == 8) continue;
                    const auto corner = [&](int c) {
                        return node(kCells * b.x + i + (c & 1), kCells * b.y + j + (c >> 1 & 1),
                                    kCells * b.z + k + (c >> 2));
                    };
                    for (const auto& tet : kTets) {
                        vec3 cut[4];
                        int cuts = 0;
                        bool all_open = true;
                        int inner[4], outer[4], inners = 0, outers = 0;
                        for (const int c : tet) inside(ids[c]) ? inner[inners++] = c : outer[outers++] = c;
                        if (inners == 0 || outers == 0) continue;
                        for (int n = 0; n < inners; ++n)
                            for (int m = 0; m < outers; ++m) {
                                // Around a quadrilateral the cuts go in this order.
                                const int a = inner[n], o = outer[n == 1 && inners == 2 ? outers - 1 - m : m];
                                const int bits = a ^ o;
                                const float step = cell_ * std::sqrt(float((bits & 1) + (bits >> 1 & 1) + (bits >> 2)));
                                all_open = all_open && opening(ids[a], ids[o], step);
                                const float wa = winding_[ids[a]] - kInside, wo = winding_[ids[o]] - kInside;
                                const float t = wa / (wa - wo);
                                cut[cuts++] = corner(a) + t * (corner(o) - corner(a));
                            }
                        if (!all_open) continue;
                        const auto first = uint32_t(cap_positions_.size());
                        cap_positions_.insert(cap_positions_.end(), cut, cut + cuts);
                        cap_faces_.push_back({first, first + 1, first + 2});
                        if (cuts == 4) cap_faces_.push_back({first, first + 2, first + 3});
                    }
                }
    }

    void reach_of(const TriangleTree& cap) {
        parallel_for(bricks_.size(), options_.workers, [&](int n) {
            const Brick& b = bricks_[size_t(n)];
            for (int s = 0; s < kBrickSamples; ++s) {
                if (!b.own[size_t(s)]) continue;
                float& d = distance_[b.ids[size_t(s)]];
                const vec3 p = node(kCells * b.x + s % kSide, kCells * b.y + s / kSide % kSide,
                                    kCells * b.z + s / (kSide * kSide));
                d = std::sqrt(cap.squared_distance(p, d * d));
            }
        });
        for (int z = 0; z <= layers_; ++z)
            for (int y = 0; y <= rows_; ++y)
                for (int x = 0; x <= columns_; ++x) {
                    float& d = coarse_[coarse_at(x, y, z)];
                    d = std::sqrt(cap.squared_distance(node(kCells * x, kCells * y, kCells * z), d * d));
                }
    }

    // ---- Levels.

    void ring() {
        const size_t count = bricks_.size();
        for (size_t n = 0; n < count; ++n)
            for (int d = 0; d < 27; ++d) {
                const int x = bricks_[n].x + d % 3 - 1, y = bricks_[n].y + d / 3 % 3 - 1, z = bricks_[n].z + d / 9 - 1;
                if (exists(x, y, z) && brick_at(x, y, z) < 0) add(x, y, z, false);
            }
    }

    void sign() {
        for (size_t s = 0; s < samples_; ++s)
            if (winding_[s] > kInside) distance_[s] = -distance_[s];
        for (size_t c = 0; c < coarse_.size(); ++c)
            if (coarse_winding_[c] > kInside) coarse_[c] = -coarse_[c];
    }

    // 1 where a brick without samples touches the lattice point.
    float coarse_weight(int x, int y, int z) const {
        for (int c = 0; c < 8; ++c) {
            const int bx = x - (c & 1), by = y - (c >> 1 & 1), bz = z - (c >> 2);
            if (exists(bx, by, bz) && brick_at(bx, by, bz) < 0) return 1;
        }
        return 0;
    }

    void flatten() {
        LipschitzCells coarse(float(kCells) * cell_);
        for (int z = 0; z < layers_; ++z)
            for (int y = 0; y < rows_; ++y)
                for (int x = 0; x < columns_; ++x) {
                    // With the ring: where it touches coarse bricks on two sides, its samples are the lattice's values too.
                    if (brick_at(x, y, z) >= 0 && bricks_[size_t(brick_at(x, y, z))].surface) continue;
                    std::array<uint32_t, 8> ids;
                    for (int c = 0; c < 8; ++c)
                        ids[size_t(c)] = uint32_t(coarse_at(x + (c & 1), y + (c >> 1 & 1), z + (c >> 2)));
                    coarse.add(ids);
                }
        coarse.flatten(coarse_, std::vector<float>(coarse_.size(), 1.0f));

        std::vector<float> mobility(samples_, 1.0f);
        std::vector<uint8_t> blended(samples_, 0);
        for (const Brick& b : bricks_) {
            float weight[8], value[8];
            float any = 0;
            for (int c = 0; c < 8; ++c) {
                const int x = b.x + (c & 1), y = b.y + (c >> 1 & 1), z = b.z + (c >> 2);
                weight[c] = coarse_weight(x, y, z);
                value[c] = coarse_[coarse_at(x, y, z)];
                any = std::max(any, weight[c]);
            }
            if (any == 0) continue;
            for (int s = 0; s < kBrickSamples; ++s) {
                const uint32_t id = b.ids[size_t(s)];
                if (blended[id] != 0) continue;
                blended[id] = 1;
                const float t[3] = {float(s % kSide) / kCells, float(s / kSide % kSide) / kCells,
                                    float(s / (kSide * kSide)) / kCells};
                const float w = trilinear(weight, t), v = trilinear(value, t);
                distance_[id] = w == 1.0f ? v : distance_[id] + (v - distance_[id]) * w;
                mobility[id] = w == 1.0f ? 0.0f : 1.0f;
            }
        }
        LipschitzCells fine(cell_);
        for (const Brick& b : bricks_)
            for (int k = 0; k < kCells; ++k)
                for (int j = 0; j < kCells; ++j)
                    for (int i = 0; i < kCells; ++i) {
                        std::array<uint32_t, 8> ids;
                        for (int c = 0; c < 8; ++c)
                            ids[size_t(c)] = b.ids[size_t(at(i + (c & 1), j + (c >> 1 & 1), k + (c >> 2)))];
                        fine.add(ids);
                    }
        fine.flatten(distance_, mobility);
        // The interpolant is evaluated in float: a little more than the measured steepness keeps it below 1.
        report_.divisor = std::max(1.0f, std::max(coarse.steepest(coarse_), fine.steepest(distance_))) * 1.00001f;
        for (float& d : coarse_) d /= report_.divisor;
        for (float& d : distance_) d /= report_.divisor;
    }

    static float trilinear(const float* corner, const float* t) {
        const auto mix = [](float a, float b, float s) { return a + (b - a) * s; };
        return mix(mix(mix(corner[0], corner[1], t[0]), mix(corner[2], corner[3], t[0]), t[1]),
                   mix(mix(corner[4], corner[5], t[0]), mix(corner[6], corner[7], t[0]), t[1]), t[2]);
    }

    sdf::MeshGrid packed() const {
        sdf::MeshGrid out;
        out.lo = lo_ + middle_;
        out.hi = hi_ + middle_;
        out.cell = cell_;
        out.columns = columns_;
        out.rows = rows_;
        out.layers = layers_;
        const size_t head = (2 * coarse_.size() + kBrickSamples - 1) / kBrickSamples;
        out.values.assign((head + bricks_.size()) * kBrickSamples, 0.0f);
        for (int z = 0; z <= layers_; ++z)
            for (int y = 0; y <= rows_; ++y)
                for (int x = 0; x <= columns_; ++x) {
                    const size_t c = coarse_at(x, y, z);
                    const int brick = brick_at(x, y, z);
                    out.values[2 * c] = coarse_[c];
                    out.values[2 * c + 1] = brick < 0 ? -1.0f : float(head + size_t(brick));
                }
        parallel_for(bricks_.size(), options_.workers, [&](int n) {
            float* to = out.values.data() + (head + size_t(n)) * kBrickSamples;
            for (const uint32_t id : bricks_[size_t(n)].ids) *to++ = distance_[id];
        });
        return out;
    }

    const Triangles& mesh_;
    const BakeOptions& options_;
    BakeReport report_;
    const TriangleTree* whole_ = nullptr;    // whose winding number counts
    const TriangleTree* surface_ = nullptr;  // whose distance counts
    std::vector<vec3> local_;
    vec3 middle_, lo_, hi_;
    Box3 solid_;
    float cell_ = 0;
    int columns_ = 0, rows_ = 0, layers_ = 0;
    std::vector<float> coarse_, coarse_winding_;
    std::vector<int32_t> table_;  // brick of a place, or -1
    std::deque<Brick> bricks_;
    uint32_t samples_ = 0;
    std::vector<float> distance_, winding_;  // by sample; signed at the end
    std::vector<uint8_t> unclear_;
    std::vector<vec3> cap_positions_;
    std::vector<Face> cap_faces_;
};

}  // namespace

Result<Baked> bake(const Triangles& mesh, const std::string& name, const BakeOptions& options) {
    Topology topology;
    const Triangles healed = heal(mesh, topology);
    if (healed.faces.empty())
        return Error{name + ": its triangles have no area, or come in opposite pairs; it encloses nothing",
                     ErrorKind::Input};
    return Baker(healed, options, topology).run(name);
}

std::string BakeReport::sentence() const {
    const Topology& t = topology;
    std::string out;
    if (t.closed_manifold()) {
        out = formatted("closed manifold of {} triangles", t.triangles);
    } else {
        out = formatted("{}: {} triangles, {} open and {} non-manifold edges",
                        t.balanced ? "closed, inside by winding number" : "not closed, inside by winding number",
                        t.triangles, t.open_edges, t.non_manifold_edges);
        out += formatted("; {:.2f} % of the samples at the surface ambiguous", 100 * double(ambiguous_share));
    }
    if (t.duplicate_faces > 0) out += formatted("; {} duplicate triangles left out", t.duplicate_faces);
    if (t.degenerate_faces > 0) out += formatted("; {} triangles without area left out", t.degenerate_faces);
    if (t.flipped_faces > 0) out += formatted("; {} triangles turned to face as their neighbours", t.flipped_faces);
    if (overlapping) out += "; parts overlap, what lies inside was left out";
    if (t.turned_inside_out) out += "; all turned: it faced inwards";
    if (claimed_closed && !t.closed_manifold()) out += "; declared closed, which it is not";
    return out;
}

}  // namespace kiln::model
