// SPDX-License-Identifier: MIT

#include "field/loose.h"

#include "field/brick.gpu.h"
#include "field/trilinear.gpu.h"

#include "base/parallel_for.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <numeric>
#include <unordered_map>
#include <utility>

namespace kiln::field {

namespace {

// A region goes this far into the air around its part, where that is nearer to it than to the rest: what is left of the field then says no
// less than half of it near where the part was, more than the distance at which bodies take themselves to touch.
constexpr float kReachInMetres = 0.12f;          // metres
constexpr int kLeastReach = 4, kMostReach = 16;  // points
constexpr ivec3 kNeighbours[6] = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};

uint64_t key_of(ivec3 p) {
    const auto part = [](int v) { return uint64_t(uint32_t(v + (1 << 20)) & 0x1fffff); };
    return part(p.x) | part(p.y) << 21 | part(p.z) << 42;
}
ivec3 point_of(uint64_t key) {
    const auto part = [&](int shift) { return int(key >> shift & 0x1fffff) - (1 << 20); };
    return {part(0), part(21), part(42)};
}

vec3 place_of(ivec3 p, float h) { return {float(p.x) * h, float(p.y) * h, float(p.z) * h}; }

// Signs of a field at lattice points, asked in blocks of 8³.
class Solid {
public:
    Solid(const SdfField& field, float h) : field_(field), h_(h) {}
    bool at(ivec3 p) {
        const ivec3 b{p.x >> 3, p.y >> 3, p.z >> 3};
        auto [it, fresh] = blocks_.try_emplace(key_of(b));
        if (fresh) fill(b, it->second);
        const int i = ((p.z & 7) << 6) | ((p.y & 7) << 3) | (p.x & 7);
        return (it->second[size_t(i >> 6)] >> (i & 63) & 1u) != 0;
    }
    /// Asks for a box of points at once.
    void look(ivec3 first, ivec3 size, int workers) {
        std::vector<std::pair<ivec3, Bits*>> blocks;
        const ivec3 last = first + size - ivec3{1, 1, 1};
        for (int z = first.z >> 3; z <= last.z >> 3; ++z)
            for (int y = first.y >> 3; y <= last.y >> 3; ++y)
                for (int x = first.x >> 3; x <= last.x >> 3; ++x)
                    if (auto [it, fresh] = blocks_.try_emplace(key_of({x, y, z})); fresh)
                        blocks.push_back({{x, y, z}, &it->second});  // a map's places stay
        parallel_for(blocks.size(), workers, [&](int i) { fill(blocks[size_t(i)].first, *blocks[size_t(i)].second); });
    }

private:
    using Bits = std::array<uint64_t, 8>;
    void fill(ivec3 block, Bits& bits) const {
        static_assert(kBrickTexels == 8);
        float x[8], y[8], z[8];
        std::array<float, 512> d;
        const vec3 low = place_of({block.x * 8, block.y * 8, block.z * 8}, h_);
        for (int i = 0; i < 8; ++i) {
            x[i] = float(block.x * 8 + i) * h_;
            y[i] = float(block.y * 8 + i) * h_;
            z[i] = float(block.z * 8 + i) * h_;
        }
        const vec3 center = low + vec3{3.5f * h_, 3.5f * h_, 3.5f * h_};
        bits = {};
        if (!field_.texels(center, 7 * h_, 0, x, y, z, d.data())) {  // all of it is on one side
            if (field_.distance(center) < 0) bits.fill(~uint64_t(0));
            return;
        }
        for (size_t i = 0; i < d.size(); ++i)
            if (d[i] <= 0) bits[i >> 6] |= uint64_t(1) << (i & 63);
    }
    const SdfField& field_;
    float h_;
    std::unordered_map<uint64_t, Bits> blocks_;
};

// Sets that join; a set's name is its least member.
class Sets {
public:
    explicit Sets(size_t count) : up_(count) { std::iota(up_.begin(), up_.end(), 0u); }
    uint32_t of(uint32_t i) {
        while (up_[i] != i) i = up_[i] = up_[up_[i]];
        return i;
    }
    void join(uint32_t a, uint32_t b) {
        a = of(a), b = of(b);
        if (a != b) up_[std::max(a, b)] = std::min(a, b);
    }

private:
    std::vector<uint32_t> up_;
};

// Exact squared distances along one axis after another (Felzenszwalb and Huttenlocher, "Distance Transforms of Sampled Functions", 2012).
void transform_axis(std::vector<float>& f, size_t first, size_t stride, int n) {
    const size_t count = size_t(n);
    std::vector<float> in(count), z(count + 1);
    std::vector<int> v(count);
    for (size_t i = 0; i < count; ++i) in[i] = f[first + i * stride];
    const auto meet = [&](int q, int p) {
        return ((in[size_t(q)] + float(q * q)) - (in[size_t(p)] + float(p * p))) / float(2 * (q - p));
    };
    int k = 0;
    v[0] = 0, z[0] = -1e20f, z[1] = 1e20f;
    for (int q = 1; q < n; ++q) {
        float s = meet(q, v[size_t(k)]);
        while (s <= z[size_t(k)]) s = meet(q, v[size_t(--k)]);
        v[size_t(++k)] = q, z[size_t(k)] = s, z[size_t(k) + 1] = 1e20f;
    }
    k = 0;
    for (int q = 0; q < n; ++q) {
        while (z[size_t(k) + 1] < float(q)) ++k;
        const int p = v[size_t(k)];
        f[first + size_t(q) * stride] = float((q - p) * (q - p)) + in[size_t(p)];
    }
}

std::vector<float> distances_to(const std::vector<bool>& set, bool member, ivec3 size) {
    std::vector<float> f(set.size());
    for (size_t i = 0; i < f.size(); ++i) f[i] = set[i] == member ? 0.0f : 1e10f;
    const size_t sx = 1, sy = size_t(size.x), sz = size_t(size.x) * size_t(size.y);
    for (int z = 0; z < size.z; ++z)
        for (int y = 0; y < size.y; ++y) transform_axis(f, size_t(z) * sz + size_t(y) * sy, sx, size.x);
    for (int z = 0; z < size.z; ++z)
        for (int x = 0; x < size.x; ++x) transform_axis(f, size_t(z) * sz + size_t(x), sy, size.y);
    for (int y = 0; y < size.y; ++y)
        for (int x = 0; x < size.x; ++x) transform_axis(f, size_t(y) * sy + size_t(x), sz, size.z);
    for (float& v : f) v = std::sqrt(v);
    return f;
}

}  // namespace

RegionField::RegionField(const RegionMask& mask)
    : low_(place_of(mask.first, mask.voxel_size)), size_(mask.size), voxel_size_(mask.voxel_size) {
    const std::vector<bool>& inside = mask.inside;
    const ivec3 last = mask.first + mask.size - ivec3{1, 1, 1};
    box_ = {low_, place_of(last, voxel_size_)};
    const std::vector<float> out = distances_to(inside, true, size_), in = distances_to(inside, false, size_);
    samples_.resize(inside.size());
    // Neighbours differ by at most a voxel along an axis: the interpolant's slope is at most the root of 3.
    const float k = voxel_size_ / std::sqrt(3.0f);
    for (size_t i = 0; i < samples_.size(); ++i) samples_[i] = k * (inside[i] ? 0.5f - in[i] : out[i] - 0.5f);
}

float RegionField::distance(vec3 p) const {
    vec3 gradient;
    return distance(p, gradient);
}

float RegionField::distance(vec3 p, vec3& gradient) const {
    const vec3 in = max(min(p, box_.max), box_.min), t = (in - low_) / voxel_size_;
    const ivec3 v{std::clamp(int(t.x), 0, size_.x - 2), std::clamp(int(t.y), 0, size_.y - 2),
                  std::clamp(int(t.z), 0, size_.z - 2)};
    const size_t sy = size_t(size_.x), sz = sy * size_t(size_.y);
    const float* d = samples_.data() + size_t(v.z) * sz + size_t(v.y) * sy + size_t(v.x);
    const Corners c{d[0], d[1], d[sy], d[sy + 1], d[sz], d[sz + 1], d[sz + sy], d[sz + sy + 1]};
    const vec3 at{t.x - float(v.x), t.y - float(v.y), t.z - float(v.z)};
    gradient = trilinear_gradient(c, at) / voxel_size_;
    float value = trilinear_value(c, at);
    if (const vec3 away = p - in; dot(away, away) > 0) {
        const float far = length(away);
        if (far > value) gradient = away / far;
        value = std::max(value, far);
    }
    return value;
}

void RegionField::distances(const sdf::Points& points, float* out) const {
    for (int i = 0; i < points.count; ++i) out[i] = distance({points.x[i], points.y[i], points.z[i]});
}

std::vector<LoosePart> loose_parts(const SdfField& before, const SdfField& after, const Box3& changed,
                                   const LooseOptions& options) {
    std::vector<LoosePart> out;
    const float h = options.voxel_size;
    if (changed.empty() || !changed.finite()) return out;
    // The change, and a point around it on each side.
    const ivec3 first{int(std::floor(changed.min.x / h)) - 1, int(std::floor(changed.min.y / h)) - 1,
                      int(std::floor(changed.min.z / h)) - 1};
    const vec3 cells = (changed.max - changed.min) / h;
    if (!(double(cells.x + 4) * double(cells.y + 4) * double(cells.z + 4) < double(options.most_looked_at))) return out;
    const ivec3 size{int(std::ceil(changed.max.x / h)) + 2 - first.x, int(std::ceil(changed.max.y / h)) + 2 - first.y,
                     int(std::ceil(changed.max.z / h)) + 2 - first.z};
    if (std::max({std::abs(first.x), std::abs(first.y), std::abs(first.z)}) > (1 << 19)) return out;
    const size_t count = size_t(size.x) * size_t(size.y) * size_t(size.z);
    const auto index = [&](ivec3 p) {
        return uint32_t((size_t(p.z - first.z) * size_t(size.y) + size_t(p.y - first.y)) * size_t(size.x) +
                        size_t(p.x - first.x));
    };
    const auto in_box = [&](ivec3 p) {
        return p.x >= first.x && p.y >= first.y && p.z >= first.z && p.x < first.x + size.x && p.y < first.y + size.y &&
               p.z < first.z + size.z;
    };
    Solid was(before, h), is(after, h);
    was.look(first, size, options.workers);
    is.look(first, size, options.workers);
    std::vector<uint8_t> state(count);  // bit 0: was solid, bit 1: is
    bool removed = false;
    const auto each = [&](auto&& visit) {
        for (int z = first.z; z < first.z + size.z; ++z)
            for (int y = first.y; y < first.y + size.y; ++y)
                for (int x = first.x; x < first.x + size.x; ++x) visit(ivec3{x, y, z});
    };
    each([&](ivec3 p) {
        const uint8_t s = uint8_t((was.at(p) ? 1 : 0) | (is.at(p) ? 2 : 0));
        state[index(p)] = s;
        removed = removed || s == 1;
    });
    if (!removed) return out;
    Sets now(count), old(count);
    each([&](ivec3 p) {
        for (int axis = 0; axis < 3; ++axis) {
            const ivec3 q = p + kNeighbours[2 * axis];
            if (!in_box(q)) continue;
            const uint32_t i = index(p), k = index(q);
            if ((state[i] & state[k] & 2) != 0) now.join(i, k);
            // What was taken away hangs together with what it touched.
            if ((state[i] & state[k] & 1) != 0 && (state[i] == 1 || state[k] == 1)) old.join(i, k);
        }
    });
    // Pieces that touched what was taken away, one seed each, by the piece that was taken.
    struct Piece {
        uint32_t group;                // of `old`
        std::vector<uint64_t> points;  // found, in order; those before `next` are done
        size_t next = 0;
        bool ended = false, large = false;
    };
    std::vector<Piece> pieces;
    std::unordered_map<uint64_t, uint32_t> owner;  // of a point: its piece
    std::unordered_map<uint32_t, uint32_t> piece_of;
    std::vector<std::pair<uint32_t, uint32_t>> links;
    each([&](ivec3 p) {
        if (state[index(p)] != 1) return;
        for (const ivec3 n : kNeighbours) {
            const ivec3 q = p + n;
            if (!in_box(q) || state[index(q)] != 3) continue;
            const auto [it, fresh] = piece_of.try_emplace(now.of(index(q)), uint32_t(pieces.size()));
            if (fresh) {
                pieces.push_back({old.of(index(p)), {key_of(q)}});
                owner.emplace(key_of(q), it->second);
            }
            links.push_back({it->second, old.of(index(p))});
        }
    });
    if (pieces.size() < 2) return out;
    // Pieces that walk into each other are one; groups that share a piece are one.
    Sets same(pieces.size()), groups(count);
    for (const auto& [piece, group] : links) groups.join(pieces[piece].group, group);
    constexpr size_t kTurn = 512;  // points a piece walks in a turn
    const auto walk = [&](uint32_t i) {
        Piece& piece = pieces[i];
        for (size_t step = 0; step < kTurn && piece.next < piece.points.size(); ++step, ++piece.next) {
            const ivec3 p = point_of(piece.points[piece.next]);
            for (const ivec3 n : kNeighbours) {
                const ivec3 q = p + n;
                if (!is.at(q)) continue;
                const auto [it, fresh] = owner.try_emplace(key_of(q), i);
                if (fresh) {
                    piece.points.push_back(key_of(q));
                } else {
                    same.join(it->second, i);
                }
            }
        }
        piece.ended = piece.next == piece.points.size();
        piece.large = piece.points.size() > options.most_points;
    };
    const auto walks = [](const Piece& p) { return !p.ended && !p.large; };
    for (bool any = true; any;) {
        any = false;
        std::vector<size_t> points(pieces.size());  // of those that met, by set
        std::vector<bool> live(pieces.size());
        for (uint32_t i = 0; i < pieces.size(); ++i) {
            points[same.of(i)] += pieces[i].points.size();
            live[same.of(i)] = live[same.of(i)] || walks(pieces[i]);
        }
        for (uint32_t i = 0; i < pieces.size(); ++i) {
            if (!walks(pieces[i])) continue;
            bool apart = false, others_live = false;
            size_t largest = 0;
            for (uint32_t k = 0; k < pieces.size(); ++k) {
                const uint32_t other = same.of(k);
                if (other == same.of(i) || groups.of(pieces[k].group) != groups.of(pieces[i].group)) continue;
                apart = true;
                others_live = others_live || live[other];
                largest = std::max(largest, points[other]);
            }
            if (!apart) continue;
            if (!others_live && points[same.of(i)] > largest) {
                pieces[i].large = true;  // the largest of its group, which stays
                continue;
            }
            walk(i);
            any = true;
        }
    }
    // By whole: pieces that met.
    struct Whole {
        std::vector<uint64_t> points;
        bool large = false;
        uint32_t group = 0;
    };
    std::unordered_map<uint32_t, Whole> wholes;
    std::vector<uint32_t> order;
    for (uint32_t i = 0; i < pieces.size(); ++i) {
        const auto [it, fresh] = wholes.try_emplace(same.of(i));
        if (fresh) order.push_back(same.of(i));
        Whole& w = it->second;
        w.points.insert(w.points.end(), pieces[i].points.begin(), pieces[i].points.end());
        w.large = w.large || pieces[i].large || !pieces[i].ended;
        w.group = groups.of(pieces[i].group);
    }
    for (const uint32_t a : order) {
        const Whole& w = wholes[a];
        if (w.large || w.points.size() > options.most_points || w.points.size() < options.least_points) continue;
        // The largest of what hung together stays; of two alike the first.
        bool largest = true, alone = true;
        for (const uint32_t b : order) {
            const Whole& o = wholes[b];
            if (b == a || o.group != w.group) continue;
            alone = false;
            largest = largest && !o.large &&
                      (o.points.size() < w.points.size() || (o.points.size() == w.points.size() && a < b));
        }
        if (alone || largest) continue;
        ivec3 low = point_of(w.points[0]), high = low;
        for (const uint64_t key : w.points) {
            const ivec3 p = point_of(key);
            low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
            high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
        }
        // Its points and the air around it, as far as that is nearer to it than to the rest.
        const int reach = std::clamp(int(std::ceil(kReachInMetres / h)), kLeastReach, kMostReach), pad = reach + 2;
        const ivec3 from = low - ivec3{pad, pad, pad};
        const ivec3 n = high - low + ivec3{2 * pad + 1, 2 * pad + 1, 2 * pad + 1};
        const size_t total = size_t(n.x) * size_t(n.y) * size_t(n.z);
        std::vector<bool> mine(total), rest(total);
        const auto at = [&](ivec3 p) {
            return (size_t(p.z - from.z) * size_t(n.y) + size_t(p.y - from.y)) * size_t(n.x) + size_t(p.x - from.x);
        };
        for (const uint64_t key : w.points) mine[at(point_of(key))] = true;
        bool has_rest = false;
        for (int z = 0; z < n.z; ++z)
            for (int y = 0; y < n.y; ++y)
                for (int x = 0; x < n.x; ++x) {
                    const ivec3 p = from + ivec3{x, y, z};
                    const size_t i = at(p);
                    rest[i] = !mine[i] && is.at(p);
                    has_rest = has_rest || rest[i];
                }
        const std::vector<float> to_mine = distances_to(mine, true, n);
        const std::vector<float> to_rest = has_rest ? distances_to(rest, true, n) : std::vector<float>(total, 1e5f);
        for (size_t i = 0; i < total; ++i)
            mine[i] = mine[i] || (!rest[i] && to_mine[i] <= float(reach) && to_mine[i] < to_rest[i]);
        LoosePart part;
        part.region = {from, n, h, std::move(mine)};
        part.box = Box3{place_of(low, h), place_of(high, h)}.inflated(h);
        part.points = w.points.size();
        out.push_back(std::move(part));
    }
    return out;
}

}  // namespace kiln::field
