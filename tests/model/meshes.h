// SPDX-License-Identifier: MIT
// Meshes of these tests, and the slow answers that everything else is compared with.
#pragma once

#include "model/bake.h"
#include "model/triangles.h"
#include "sdf/eval.h"

#include <kiln/shapes.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <random>

namespace kiln::model {

class Random {
public:
    explicit Random(uint32_t seed) : engine_(seed) {}
    float in(float lo, float hi) { return lo + (hi - lo) * float(engine_() >> 8) * 0x1p-24f; }
    int below(int n) { return int(engine_() % uint32_t(n)); }
    vec3 point(float size) { return {in(-size, size), in(-size, size), in(-size, size)}; }

private:
    std::mt19937 engine_;
};

inline Triangles tetrahedron() {
    return {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}};
}

inline Triangles box(vec3 half) {
    Triangles out;
    for (int c = 0; c < 8; ++c)
        out.positions.push_back({(c & 1) ? half.x : -half.x, (c & 2) ? half.y : -half.y, (c & 4) ? half.z : -half.z});
    for (const Face& f : {Face{0, 2, 3},
                          {0, 3, 1},
                          {4, 5, 7},
                          {4, 7, 6},
                          {0, 1, 5},
                          {0, 5, 4},
                          {2, 6, 7},
                          {2, 7, 3},
                          {0, 4, 6},
                          {0, 6, 2},
                          {1, 3, 7},
                          {1, 7, 5}})
        out.faces.push_back(f);
    return out;
}

// An octahedron, each triangle in four `times` times over, on the sphere. Its equator stays an edge.
inline Triangles sphere(int times, float radius = 1, vec3 middle = {}) {
    Triangles out{{{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}},
                  {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}}};
    for (int t = 0; t < times; ++t) {
        std::map<std::pair<uint32_t, uint32_t>, uint32_t> middles;
        std::vector<Face> next;
        const auto between = [&](uint32_t a, uint32_t b) {
            const auto [at, fresh] = middles.emplace(std::minmax(a, b), uint32_t(out.positions.size()));
            if (fresh) out.positions.push_back(normalize(out.positions[a] + out.positions[b]));
            return at->second;
        };
        for (const Face& f : out.faces) {
            const uint32_t ab = between(f[0], f[1]), bc = between(f[1], f[2]), ca = between(f[2], f[0]);
            for (const Face& g : {Face{f[0], ab, ca}, {ab, f[1], bc}, {ca, bc, f[2]}, {ab, bc, ca}}) next.push_back(g);
        }
        out.faces = next;
    }
    for (vec3& p : out.positions) p = radius * p + middle;
    return out;
}

inline Triangles hemisphere(int times) {
    Triangles out = sphere(times);
    std::erase_if(out.faces, [&](const Face& f) {
        return out.positions[f[0]].y + out.positions[f[1]].y + out.positions[f[2]].y < 0;
    });
    return out;
}

inline Triangles together(Triangles a, const Triangles& b) {
    const auto first = uint32_t(a.positions.size());
    a.positions.insert(a.positions.end(), b.positions.begin(), b.positions.end());
    for (const Face& f : b.faces) a.faces.push_back({f[0] + first, f[1] + first, f[2] + first});
    return a;
}

inline Triangles soup(Random& random, int count) {
    Triangles out;
    for (int i = 0; i < 3 * count; ++i) {
        const vec3 near = i % 3 == 0 ? vec3{} : out.positions[size_t(i - i % 3)];
        out.positions.push_back(i % 3 == 0 ? random.point(1) : near + random.point(0.7f));
    }
    for (uint32_t i = 0; i < uint32_t(count); ++i) out.faces.push_back({3 * i, 3 * i + 1, 3 * i + 2});
    return out;
}

// ---- Slow answers, in double.

struct Vector {
    double x, y, z;
    Vector(double x_, double y_, double z_) : x(x_), y(y_), z(z_) {}
    explicit Vector(vec3 v) : x(double(v.x)), y(double(v.y)), z(double(v.z)) {}
    Vector operator-(const Vector& o) const { return {x - o.x, y - o.y, z - o.z}; }
    Vector operator+(const Vector& o) const { return {x + o.x, y + o.y, z + o.z}; }
    Vector operator*(double s) const { return {x * s, y * s, z * s}; }
    double dot(const Vector& o) const { return x * o.x + y * o.y + z * o.z; }
    Vector cross(const Vector& o) const { return {y * o.z - z * o.y, z * o.x - x * o.z, x * o.y - y * o.x}; }
    double length() const { return std::sqrt(dot(*this)); }
};

inline double from_segment(const Vector& p, const Vector& a, const Vector& b) {
    const Vector e = b - a;
    const double t = e.dot(e) > 0 ? std::clamp((p - a).dot(e) / e.dot(e), 0.0, 1.0) : 0.0;
    return (p - (a + e * t)).length();
}

// The foot on the plane when it lies within all three edges, else the nearest edge.
inline double from_triangle(const Vector& p, const Vector& a, const Vector& b, const Vector& c) {
    const Vector n = (b - a).cross(c - a);
    const auto within = [&](const Vector& from, const Vector& to) { return (to - from).cross(p - from).dot(n) >= 0; };
    if (n.dot(n) > 0 && within(a, b) && within(b, c) && within(c, a)) return std::fabs((p - a).dot(n)) / n.length();
    return std::min({from_segment(p, a, b), from_segment(p, b, c), from_segment(p, c, a)});
}

inline double slow_distance(const Triangles& mesh, vec3 p) {
    double least = INFINITY;
    for (const Face& f : mesh.faces)
        least = std::min(least, from_triangle(Vector(p), Vector(mesh.positions[f[0]]), Vector(mesh.positions[f[1]]),
                                              Vector(mesh.positions[f[2]])));
    return least;
}

inline double slow_winding(const Triangles& mesh, vec3 p) {
    double sum = 0;
    for (const Face& f : mesh.faces) {
        const Vector a = Vector(mesh.positions[f[0]]) - Vector(p), b = Vector(mesh.positions[f[1]]) - Vector(p),
                     c = Vector(mesh.positions[f[2]]) - Vector(p);
        const double la = a.length(), lb = b.length(), lc = c.length();
        sum += 2 * std::atan2(a.dot(b.cross(c)), la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
    }
    return sum / (4 * std::numbers::pi);
}

// ---- A baked mesh as the tape reads it.

struct Shape {
    Baked baked;
    sdf::Program program;

    double value(vec3 p) const { return sdf::evaluate(view(program), dvec3{double(p.x), double(p.y), double(p.z)}); }
    /// The value before it was divided to be 1-Lipschitz.
    double distance(vec3 p) const { return value(p) * double(baked.report.divisor); }
    float cell() const { return baked.report.cell; }
};

inline Shape shape_of(const Triangles& mesh, const BakeOptions& options = {}) {
    auto baked = bake(mesh, "mesh", options);
    EXPECT_TRUE(baked) << (baked ? "" : baked.error().message);
    Shape out;
    if (!baked) return out;
    out.baked = std::move(*baked);
    Edit edit;
    edit.node.shape = SampledMesh{};
    edit.node.shape.data = "0";
    auto program = sdf::compile({.edits = {&edit, 1}, .objects = {}, .grids = {}, .meshes = {&out.baked.grid, 1}});
    EXPECT_TRUE(program) << (program ? "" : program.error().message);
    if (program) out.program = std::move(*program);
    return out;
}

}  // namespace kiln::model
