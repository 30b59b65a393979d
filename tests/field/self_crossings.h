// SPDX-License-Identifier: MIT
// Where a mesh passes through itself: pairs of triangles that cross each other, found by a grid of their boxes and told by signs of volumes.
#pragma once

#include <kiln/math.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <unordered_map>
#include <vector>

namespace kiln::field::meshes {

struct Crossings {
    size_t apart = 0;      ///< pairs without a common vertex
    size_t at_vertex = 0;  ///< pairs with one common vertex
    vec3 example;          ///< a corner of one of them
};

class SelfCrossings {
public:
    SelfCrossings(std::span<const vec3> positions, std::span<const uint32_t> triangles)
        : positions_(positions), triangles_(triangles) {}

    /// `cell`: side of the grid, about a triangle's size.
    Crossings count(float cell) const {
        std::unordered_map<uint64_t, std::vector<uint32_t>> grid;
        const auto cells = [&](uint32_t t, auto&& fn) {
            const Box box = box_of(t);
            const auto at = [cell](float v) { return int(std::floor(v / cell)); };
            for (int z = at(box.low.z); z <= at(box.high.z); ++z)
                for (int y = at(box.low.y); y <= at(box.high.y); ++y)
                    for (int x = at(box.low.x); x <= at(box.high.x); ++x)
                        fn(uint64_t(x & 0x1fffff) | uint64_t(y & 0x1fffff) << 21 | uint64_t(z & 0x1fffff) << 42);
        };
        const uint32_t count = uint32_t(triangles_.size() / 3);
        for (uint32_t t = 0; t < count; ++t) cells(t, [&](uint64_t key) { grid[key].push_back(t); });
        std::vector<std::pair<uint32_t, uint32_t>> found;
        for (const auto& [key, members] : grid) {
            for (size_t i = 0; i < members.size(); ++i)
                for (size_t k = i + 1; k < members.size(); ++k)
                    if (cross(members[i], members[k])) found.emplace_back(members[i], members[k]);
        }
        std::sort(found.begin(), found.end());
        found.erase(std::unique(found.begin(), found.end()), found.end());  // pairs that share several cells
        Crossings out;
        for (const auto& [a, b] : found) {
            ++(common(a, b) == 0 ? out.apart : out.at_vertex);
            out.example = corner(a, 0);
        }
        return out;
    }

private:
    struct Box {
        vec3 low, high;
    };
    vec3 corner(uint32_t t, size_t i) const { return positions_[triangles_[3 * size_t(t) + i]]; }
    Box box_of(uint32_t t) const {
        const vec3 a = corner(t, 0), b = corner(t, 1), c = corner(t, 2);
        return {min(min(a, b), c), max(max(a, b), c)};
    }
    int common(uint32_t s, uint32_t t) const {
        int out = 0;
        for (size_t i = 0; i < 3; ++i)
            for (size_t k = 0; k < 3; ++k) out += triangles_[3 * size_t(s) + i] == triangles_[3 * size_t(t) + k];
        return out;
    }

    // Six times the volume of a, b, c, d, by its sign; 0 where rounding could have made it.
    static int side(vec3 a, vec3 b, vec3 c, vec3 d) {
        const auto less = [&d](vec3 p) {
            return std::array<double, 3>{double(p.x) - double(d.x), double(p.y) - double(d.y),
                                         double(p.z) - double(d.z)};
        };
        const auto u = less(a), v = less(b), w = less(c);  // exact
        double volume = 0, size = 0;
        for (size_t i = 0; i < 3; ++i) {
            const size_t k = (i + 1) % 3, l = (i + 2) % 3;
            const double p = u[i] * v[k] * w[l], q = u[i] * v[l] * w[k];
            volume += p - q;
            size += std::abs(p) + std::abs(q);
        }
        constexpr double kRounding = 1e-15;
        return volume > kRounding * size ? 1 : volume < -kRounding * size ? -1 : 0;
    }
    // The segment passes through the inside of the triangle.
    static bool pierces(vec3 from, vec3 to, vec3 a, vec3 b, vec3 c) {
        if (side(a, b, c, from) * side(a, b, c, to) >= 0) return false;
        const int first = side(from, to, a, b);
        return first != 0 && first == side(from, to, b, c) && first == side(from, to, c, a);
    }
    bool cross(uint32_t s, uint32_t t) const {
        const Box p = box_of(s), q = box_of(t);
        if (p.high.x < q.low.x || q.high.x < p.low.x || p.high.y < q.low.y || q.high.y < p.low.y ||
            p.high.z < q.low.z || q.high.z < p.low.z)
            return false;
        if (common(s, t) > 1) return false;
        const auto edges_pierce = [this](uint32_t one, uint32_t other) {
            const uint32_t* const three = &triangles_[3 * size_t(other)];
            for (size_t i = 0; i < 3; ++i) {
                const uint32_t from = triangles_[3 * size_t(one) + i], to = triangles_[3 * size_t(one) + (i + 1) % 3];
                if (std::count(three, three + 3, from) + std::count(three, three + 3, to) > 0) continue;
                if (pierces(positions_[from], positions_[to], corner(other, 0), corner(other, 1), corner(other, 2)))
                    return true;
            }
            return false;
        };
        return edges_pierce(s, t) || edges_pierce(t, s);
    }

    std::span<const vec3> positions_;
    std::span<const uint32_t> triangles_;
};

}  // namespace kiln::field::meshes
