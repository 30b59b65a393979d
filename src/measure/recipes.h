// SPDX-License-Identifier: MIT
// The benchmark scenes, reproducible from a kind, a seed and a count, without tables: pebbles (kind 0), carve (kind 1: every
// edit i with i mod 10 >= 7 subtracts), cluster (kind 2: pebbles crowded around the centre); domain [-1, 1]^3. And the work done on them:
// bites, points, rays. Benchmarks, their peers and bench/ all take them from here.
#pragma once

#include <kiln/query.h>
#include <kiln/shapes.h>

#include <cstdint>
#include <vector>

namespace kiln::measure {

/// Integer hash "lowbias32" (Wellons, "Prospecting for Hash Functions", 2018).
inline uint32_t lb32(uint32_t x) {
    x ^= x >> 16;
    x *= 0x7feb352du;
    x ^= x >> 15;
    x *= 0x846ca68bu;
    return x ^ x >> 16;
}

/// Uniform in [0, 1): number k of item i of the stream s.
inline float uniform(uint32_t s, uint32_t i, uint32_t k) { return float(lb32(lb32(lb32(s) + i) + k) >> 8) * 0x1p-24f; }

inline std::vector<Edit> recipe(int kind, uint32_t seed, uint32_t count) {
    std::vector<Edit> edits(count);
    for (uint32_t i = 0; i < count; ++i) {
        float c[3];
        for (uint32_t a = 0; a < 3; ++a) {
            float t = uniform(seed, i, a);
            if (kind == 2) t = (t + uniform(seed, i, 8 + a) + uniform(seed, i, 11 + a)) / 3.0f;
            c[a] = -0.9f + 1.8f * t;
        }
        const float r = 0.02f + 0.06f * uniform(seed, i, 4);
        Edit& e = edits[i];
        e.node.transform.position = {c[0], c[1], c[2]};
        if (uniform(seed, i, 3) < 0.5f) {
            e.node.shape = Sphere{.radius = r};
        } else {
            const auto half = [&](uint32_t a) { return r * (0.5f + 0.5f * uniform(seed, i, 5 + a)); };
            e.node.shape = Box{.half_extents = {half(0), half(1), half(2)}};
        }
        if (kind == 1 && i % 10 >= 7) e.op = Op::Subtract;
    }
    return edits;
}

inline constexpr float kBiteRadius = 0.05f;
inline constexpr float kSmoothRadius = 0.02f;  ///< blend of the edits that are smooth: 2.6 voxels at 256 a side

/// The m-th incremental edit: a bite.
inline Edit bite(uint32_t m) {
    Edit e;
    e.node.shape = Sphere{.radius = kBiteRadius};
    const auto c = [&](uint32_t a) { return -0.7f + 1.4f * uniform(7777, m, a); };
    e.node.transform.position = {c(0), c(1), c(2)};
    e.op = Op::Subtract;
    return e;
}

/// `count` points, uniform in [-1, 1]^3.
inline std::vector<vec3> random_points(uint32_t count) {
    std::vector<vec3> out(count);
    for (uint32_t i = 0; i < count; ++i) {
        const auto c = [&](uint32_t a) { return -1.0f + 2.0f * uniform(91, i, a); };
        out[i] = {c(0), c(1), c(2)};
    }
    return out;
}

/// A picture's rays from (0, 0, -3), row by row; the square of tangent 0.7 fills the height.
inline std::vector<Ray> picture_rays(int width, int height) {
    std::vector<Ray> out;
    out.reserve(size_t(width) * size_t(height));
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            const float u = ((float(x) + 0.5f) / float(width) - 0.5f) * 2 * 0.7f * float(width) / float(height);
            const float v = ((float(y) + 0.5f) / float(height) - 0.5f) * 2 * 0.7f;
            out.push_back({.origin = {0, 0, -3}, .direction = normalize(vec3{u, v, 2})});
        }
    }
    return out;
}

/// The same rays in squares of 4x4, so that neighbours in the list are neighbours in the picture. Sides are multiples of 4.
inline std::vector<Ray> picture_rays_in_tiles(int width, int height) {
    const std::vector<Ray> rows = picture_rays(width, height);
    std::vector<Ray> out;
    out.reserve(rows.size());
    for (int y = 0; y < height; y += 4) {
        for (int x = 0; x < width; x += 4) {
            for (int i = 0; i < 16; ++i) out.push_back(rows[size_t(y + i / 4) * size_t(width) + size_t(x + i % 4)]);
        }
    }
    return out;
}

}  // namespace kiln::measure
