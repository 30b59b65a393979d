// SPDX-License-Identifier: MIT

#include "physics/sdf_shape.h"

#include "base/format.h"
#include "base/parallel_for.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>

namespace kiln::physics {

namespace {

constexpr int kMassCells = 96;  // along the longest side: the volume of a ball comes out to 1e-4
constexpr int kPoints = 1024;   // of a surface, about; a torus then has one every twelfth of its ring's thickness
constexpr int kGroup = 24;
constexpr int kBlock = 8;
constexpr int kTile = 4;
constexpr float kTileReach =
    2.1214f;  // cells, from a tile's middle to the farthest of its cells' middles: (kTile - 1) / sqrt(2)
constexpr size_t kShort = 32;  // instructions: nine points with gradients then cost what they do from bricks

float longest(vec3 v) { return std::max({v.x, v.y, v.z}); }

// Square of cells of slab k whose lowest is i, j; what the field says in its middle.
struct Tile {
    int i, j, k;
    float distance;
};

// Sums of one slab of cells: volume, first and second moments about the middle of the box, and the largest depth but for that of tiles that
// were not looked into.
struct Sums {
    double v = 0, x = 0, y = 0, z = 0, xx = 0, yy = 0, zz = 0, xy = 0, xz = 0, yz = 0;
    float depth = 0;
    std::vector<Tile> deep;
};

// The share of a cell below the surface, for a surface that is flat in it.
double cover(float distance, float cell) { return std::clamp(0.5 - double(distance) / double(cell), 0.0, 1.0); }

struct Grid {
    vec3 low;
    float cell;
    int n[3];
    float at(int axis, int i) const {
        return (axis == 0 ? low.x : axis == 1 ? low.y : low.z) + (float(i) + 0.5f) * cell;
    }
};

template <typename Fn>
void each_cell(const Grid& g, const Tile& t, Fn&& fn) {
    for (int j = t.j; j < std::min(t.j + kTile, g.n[1]); ++j)
        for (int i = t.i; i < std::min(t.i + kTile, g.n[0]); ++i) fn(i, j);
}

// Distances in the cells of a slab, x fastest. Where the field says of a tile of cells that all are in air or all are deep, that is enough:
// infinities; `deep` are the latter.
std::vector<float> slab_distances(const field::SdfField& field, const Grid& g, int k, std::vector<Tile>& deep) {
    std::vector<float> out(size_t(g.n[0]) * size_t(g.n[1]), std::numeric_limits<float>::infinity());
    std::vector<float> x, y, z, d;
    std::vector<Tile> tiles;
    const auto ask = [&](float px, float py) { x.push_back(px), y.push_back(py), z.push_back(g.at(2, k)); };
    const auto answer = [&] {
        d.resize(x.size());
        field.distances({x.data(), y.data(), z.data(), int(x.size())}, d.data());
        x.clear(), y.clear(), z.clear();
    };
    for (int j = 0; j < g.n[1]; j += kTile)
        for (int i = 0; i < g.n[0]; i += kTile) {
            tiles.push_back({i, j, k, 0});
            ask(0.5f * (g.at(0, i) + g.at(0, std::min(i + kTile, g.n[0]) - 1)),
                0.5f * (g.at(1, j) + g.at(1, std::min(j + kTile, g.n[1]) - 1)));
        }
    answer();
    for (size_t t = 0; t < tiles.size(); ++t) tiles[t].distance = d[t];
    const float reach = kTileReach * g.cell + g.cell;  // 1-Lipschitz: beyond, all cells are covered whole or not at all
    for (const Tile& t : tiles)
        if (std::abs(t.distance) <= reach) each_cell(g, t, [&](int i, int j) { ask(g.at(0, i), g.at(1, j)); });
    answer();
    size_t next = 0;
    for (const Tile& t : tiles) {
        const bool border = std::abs(t.distance) <= reach, inside = !border && t.distance < 0;
        if (inside) deep.push_back(t);
        if (!border && !inside) continue;
        each_cell(g, t, [&](int i, int j) {
            out[size_t(j) * size_t(g.n[0]) + size_t(i)] = border ? d[next++] : -std::numeric_limits<float>::infinity();
        });
    }
    return out;
}

Sums sum_slab(const field::SdfField& field, const Grid& g, vec3 middle, int k) {
    Sums s;
    const std::vector<float> d = slab_distances(field, g, k, s.deep);
    for (int j0 = 0; j0 < g.n[1]; j0 += kBlock)
        for (int i0 = 0; i0 < g.n[0]; i0 += kBlock)
            for (int j = j0; j < std::min(j0 + kBlock, g.n[1]); ++j)
                for (int i = i0; i < std::min(i0 + kBlock, g.n[0]); ++i) {
                    const float here = d[size_t(j) * size_t(g.n[0]) + size_t(i)];
                    const double w = cover(here, g.cell);
                    if (w == 0) continue;
                    if (std::isfinite(here)) s.depth = std::max(s.depth, -here);
                    const double px = double(g.at(0, i) - middle.x), py = double(g.at(1, j) - middle.y),
                                 pz = double(g.at(2, k) - middle.z);
                    s.v += w, s.x += w * px, s.y += w * py, s.z += w * pz;
                    s.xx += w * px * px, s.yy += w * py * py, s.zz += w * pz * pz;
                    s.xy += w * px * py, s.xz += w * px * pz, s.yz += w * py * pz;
                }
    return s;
}

// Of what has this much anyway, and of tiles: none is deeper than its middle and how far its cells are from there.
float deepest(const field::SdfField& field, const Grid& g, std::vector<Tile> tiles, float depth) {
    std::sort(tiles.begin(), tiles.end(), [](const Tile& a, const Tile& b) { return a.distance < b.distance; });
    constexpr size_t kAtOnce = 4;
    std::array<float, kAtOnce * kTile * kTile> x, y, z, d;
    for (size_t first = 0; first < tiles.size(); first += kAtOnce) {
        if (kTileReach * g.cell - tiles[first].distance <= depth) break;
        size_t count = 0;
        for (size_t t = first; t < std::min(first + kAtOnce, tiles.size()); ++t)
            each_cell(g, tiles[t], [&](int i, int j) {
                x[count] = g.at(0, i), y[count] = g.at(1, j), z[count] = g.at(2, tiles[t].k);
                ++count;
            });
        field.distances({x.data(), y.data(), z.data(), int(count)}, d.data());
        for (size_t i = 0; i < count; ++i) depth = std::max(depth, -d[i]);
    }
    return depth;
}

quat from_columns(const double (&m)[3][3]) {
    // Shepperd, "Quaternion from Rotation Matrix", 1978: by the largest of the four components.
    const double trace = m[0][0] + m[1][1] + m[2][2];
    double q[4];
    if (trace > 0) {
        const double s = 2 * std::sqrt(trace + 1);
        q[3] = s / 4, q[0] = (m[2][1] - m[1][2]) / s, q[1] = (m[0][2] - m[2][0]) / s, q[2] = (m[1][0] - m[0][1]) / s;
    } else {
        const int i = m[0][0] >= m[1][1] && m[0][0] >= m[2][2] ? 0 : m[1][1] >= m[2][2] ? 1 : 2;
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        const double s = 2 * std::sqrt(1 + m[i][i] - m[j][j] - m[k][k]);
        q[i] = s / 4, q[j] = (m[j][i] + m[i][j]) / s, q[k] = (m[k][i] + m[i][k]) / s, q[3] = (m[k][j] - m[j][k]) / s;
    }
    return {float(q[0]), float(q[1]), float(q[2]), float(q[3])};
}

}  // namespace

MassProperties principal(double mass, vec3 center, const double (&inertia)[6]) {
    // Jacobi's rotations: each zeroes the largest off-diagonal element.
    double a[3][3] = {{inertia[0], inertia[3], inertia[4]},
                      {inertia[3], inertia[1], inertia[5]},
                      {inertia[4], inertia[5], inertia[2]}};
    double v[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    const double size = a[0][0] + a[1][1] + a[2][2];
    for (int turn = 0; turn < 32; ++turn) {
        int p = 0, q = 1;
        if (std::abs(a[0][2]) > std::abs(a[p][q])) p = 0, q = 2;
        if (std::abs(a[1][2]) > std::abs(a[p][q])) p = 1, q = 2;
        // What the sums cannot tell from 0 stays: symmetric bodies keep their own axes.
        if (!(std::abs(a[p][q]) > 1e-6 * size)) break;
        const double theta = (a[q][q] - a[p][p]) / (2 * a[p][q]);
        const double t = std::copysign(1.0, theta) / (std::abs(theta) + std::sqrt(theta * theta + 1));
        const double c = 1 / std::sqrt(t * t + 1), s = t * c;
        for (int k = 0; k < 3; ++k) {
            const double kp = a[k][p], kq = a[k][q];
            a[k][p] = c * kp - s * kq, a[k][q] = s * kp + c * kq;
        }
        for (int k = 0; k < 3; ++k) {
            const double pk = a[p][k], qk = a[q][k], vp = v[k][p], vq = v[k][q];
            a[p][k] = c * pk - s * qk, a[q][k] = s * pk + c * qk;
            v[k][p] = c * vp - s * vq, v[k][q] = s * vp + c * vq;
        }
    }
    return {mass, center, from_columns(v), {a[0][0], a[1][1], a[2][2]}};
}

std::shared_ptr<const SdfShape> SdfShape::fixed(std::shared_ptr<const field::SdfField> field,
                                                std::shared_ptr<const field::SdfField> bricks) {
    std::shared_ptr<SdfShape> out(new SdfShape);
    out->bounds_ = field->bounds();
    out->take(std::move(field), std::move(bricks));
    return out;
}

void SdfShape::take(std::shared_ptr<const field::SdfField> field, std::shared_ptr<const field::SdfField> bricks) {
    field_ = std::move(field);
    bricks_ = bricks != nullptr ? std::move(bricks) : field_;
    slope_ = field_->cost() <= kShort ? field_.get() : bricks_.get();
}

std::shared_ptr<const SdfShape> SdfShape::renewed() const {
    auto bricks = bricks_->renewed();
    if (bricks == nullptr) return nullptr;
    std::shared_ptr<SdfShape> out(new SdfShape(*this));
    out->take(out->field_, std::move(bricks));
    return out;
}

std::shared_ptr<const SdfShape> SdfShape::with(std::shared_ptr<const Regions> regions) const {
    std::shared_ptr<SdfShape> out(new SdfShape(*this));
    out->regions_ = std::move(regions);
    return out;
}

std::shared_ptr<const SdfShape> SdfShape::with(const MassProperties& mass) const {
    std::shared_ptr<SdfShape> out(new SdfShape(*this));
    out->mass_ = mass;
    return out;
}

Result<std::shared_ptr<const SdfShape>> SdfShape::moving(std::shared_ptr<const field::SdfField> field,
                                                         std::shared_ptr<const field::SdfField> bricks) {
    const Box3 box = field->bounds();
    if (box.empty()) return Error{"a body of no volume: nothing in it is solid", ErrorKind::Input};
    if (!box.finite()) return Error{"a body without end: give it edits of finite size", ErrorKind::Input};
    const vec3 size = box.max - box.min;
    if (!(longest(size) > 0)) return Error{"a body of no volume: nothing in it is solid", ErrorKind::Input};

    Grid g;
    g.cell = longest(size) / float(kMassCells);
    const float extent[3] = {size.x, size.y, size.z};
    for (int axis = 0; axis < 3; ++axis) g.n[axis] = int(std::ceil(extent[axis] / g.cell)) + 2;
    const vec3 middle = box.center();
    g.low = middle - vec3{float(g.n[0]), float(g.n[1]), float(g.n[2])} * (0.5f * g.cell);
    std::vector<Sums> slabs(size_t(g.n[2]));
    parallel_for(g.n[2], [&](int k) { slabs[size_t(k)] = sum_slab(*field, g, middle, k); });
    Sums s;
    for (const Sums& b : slabs) {
        s.v += b.v, s.x += b.x, s.y += b.y, s.z += b.z;
        s.xx += b.xx, s.yy += b.yy, s.zz += b.zz, s.xy += b.xy, s.xz += b.xz, s.yz += b.yz;
        s.depth = std::max(s.depth, b.depth);
        s.deep.insert(s.deep.end(), b.deep.begin(), b.deep.end());
    }
    s.depth = deepest(*field, g, std::move(s.deep), s.depth);
    if (!(s.v > 0) || !(s.depth > 0))
        return Error{
            formatted("a body of no volume: nothing in it is solid, or it is thinner than {} m", double(g.cell)),
            ErrorKind::Input};

    std::shared_ptr<SdfShape> out(new SdfShape);
    const double cell = double(g.cell), mass = s.v * cell * cell * cell, cx = s.x / s.v, cy = s.y / s.v, cz = s.z / s.v;
    // Second moments about the centre; a cell's own spread is cell²/12 an axis.
    const double own = cell * cell / 12, xx = s.xx / s.v - cx * cx + own, yy = s.yy / s.v - cy * cy + own,
                 zz = s.zz / s.v - cz * cz + own;
    const double inertia[6] = {mass * (yy + zz),
                               mass * (xx + zz),
                               mass * (xx + yy),
                               -mass * (s.xy / s.v - cx * cy),
                               -mass * (s.xz / s.v - cx * cz),
                               -mass * (s.yz / s.v - cy * cz)};
    out->mass_ = principal(mass, middle + vec3{float(cx), float(cy), float(cz)}, inertia);
    out->bounds_ = box;
    out->inner_radius_ = double(s.depth);
    out->take(std::move(field), std::move(bricks));
    out->sample_surface();
    if (out->groups_.empty()) return Error{"a body of no volume: its surface was not found", ErrorKind::Input};
    return std::shared_ptr<const SdfShape>(std::move(out));
}

// One point a cell that the surface passes, moved onto it along the gradient. The cells are made so small that there are about kPoints.
void SdfShape::sample_surface() {
    const vec3 size = bounds_.max - bounds_.min;
    struct Found {
        vec3 p;
        uint64_t key;
    };
    std::vector<Found> found;
    float cell = longest(size) / 16;
    for (int attempt = 0; attempt < 4; ++attempt) {
        found.clear();
        const vec3 low = bounds_.min - vec3{cell, cell, cell} * 0.5f;
        const int nx = int(size.x / cell) + 2, ny = int(size.y / cell) + 2, nz = int(size.z / cell) + 2;
        std::vector<float> x, y, z, d;
        for (int k = 0; k < nz; ++k)
            for (int j = 0; j < ny; ++j) {
                x.clear(), y.clear(), z.clear();
                for (int i = 0; i < nx; ++i) {
                    x.push_back(low.x + (float(i) + 0.5f) * cell);
                    y.push_back(low.y + (float(j) + 0.5f) * cell);
                    z.push_back(low.z + (float(k) + 0.5f) * cell);
                }
                d.resize(x.size());
                field_->distances({x.data(), y.data(), z.data(), nx}, d.data());
                for (size_t i = 0; i < x.size(); ++i) {
                    if (!(std::abs(d[i]) < 0.9f * cell)) continue;
                    const vec3 start{x[i], y[i], z[i]};
                    vec3 p = start;
                    bool on = false;
                    for (int step = 0; step < 8 && !on; ++step) {
                        vec3 n;
                        const float value = field_->distance(p, n);
                        const float slope2 = dot(n, n);
                        on = std::abs(value) < 1e-3f * cell;
                        if (!on && slope2 > 1e-6f) p = p - n * (value / slope2);
                    }
                    const vec3 away = p - start;
                    if (!on || std::max({std::abs(away.x), std::abs(away.y), std::abs(away.z)}) > 0.75f * cell)
                        continue;
                    // Neighbours in space are neighbours in the list: bits of the coarse cell's place, interleaved.
                    const uint64_t c[3] = {uint64_t(i) / 3, uint64_t(j) / 3, uint64_t(k) / 3};
                    uint64_t key = 0;
                    for (int bit = 0; bit < 16; ++bit)
                        for (int axis = 0; axis < 3; ++axis) key |= (c[axis] >> bit & 1) << (3 * bit + axis);
                    found.push_back({p, key});
                }
            }
        spacing_ = cell;
        const double ratio = double(found.size()) / kPoints;
        if (found.empty()) {
            cell *= 0.5f;
        } else if (ratio < 0.6 || ratio > 1.6) {
            cell *= float(std::clamp(std::sqrt(ratio), 0.35, 3.0));
        } else {
            break;
        }
    }
    std::stable_sort(found.begin(), found.end(), [](const Found& a, const Found& b) { return a.key < b.key; });
    for (const Found& f : found) x_.push_back(f.p.x), y_.push_back(f.p.y), z_.push_back(f.p.z);
    const int count = int(found.size());
    for (int first = 0; first < count;) {
        int last = first + 1;
        while (last < count && last - first < kGroup && found[size_t(last)].key == found[size_t(first)].key) ++last;
        Box3 box;
        for (int i = first; i < last; ++i) box = box_union(box, {point(i), point(i)});
        Group group{first, last - first, box.center(), 0};
        for (int i = first; i < last; ++i) group.radius = std::max(group.radius, length(point(i) - group.center));
        groups_.push_back(group);
        first = last;
    }
}

}  // namespace kiln::physics
