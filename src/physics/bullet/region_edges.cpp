// SPDX-License-Identifier: MIT

#include "physics/bullet/region_edges.h"

#include <algorithm>

namespace kiln::physics {

namespace {

constexpr float kFace = 0.9998f;  // cosine of one degree: as good as the triangle's own normal
constexpr float kAt = 1e-3f;      // of a brick: a contact nearer than that to an edge is on it
constexpr float kFlat = 1e-3f;    // sine: edges bent less are flat

struct Corners {
    vec3 p[3];
    vec3 normal() const {
        const vec3 n = cross(p[1] - p[0], p[2] - p[0]);
        const float size = length(n);
        return size > 0 ? n / size : vec3{};
    }
};
Corners corners_of(const RegionMesh& m, uint32_t t) {
    return {{m.vertices[m.indices[3 * t]], m.vertices[m.indices[3 * t + 1]], m.vertices[m.indices[3 * t + 2]]}};
}

float distance2(vec3 p, vec3 a, vec3 b) {
    const vec3 ab = b - a;
    const float size2 = dot(ab, ab), t = size2 > 0 ? std::clamp(dot(p - a, ab) / size2, 0.0f, 1.0f) : 0;
    const vec3 off = p - (a + ab * t);
    return dot(off, off);
}

}  // namespace

RegionEdges::RegionEdges(const RegionMesh& mesh) {
    struct Edge {
        uint64_t key;
        uint32_t triangle, side;
    };
    std::vector<Edge> edges;
    edges.reserve(mesh.indices.size());
    for (uint32_t t = 0; t < mesh.indices.size() / 3; ++t)
        for (uint32_t i = 0; i < 3; ++i) {
            const uint32_t a = mesh.indices[3 * t + i], b = mesh.indices[3 * t + (i + 1) % 3];
            edges.push_back({uint64_t(std::min(a, b)) << 32 | std::max(a, b), t, i});
        }
    std::sort(edges.begin(), edges.end(),
              [](const Edge& p, const Edge& q) { return p.key != q.key ? p.key < q.key : p.triangle < q.triangle; });
    beside_.assign(mesh.own(), {-1, -1, -1});
    for (size_t i = 0; i + 1 < edges.size(); ++i) {
        const Edge &p = edges[i], &q = edges[i + 1];
        if (p.key != q.key) continue;
        if (p.triangle < mesh.own()) beside_[p.triangle][p.side] = int32_t(q.triangle);
        if (q.triangle < mesh.own()) beside_[q.triangle][q.side] = int32_t(p.triangle);
    }
}

std::optional<vec3> RegionEdges::allowed(const RegionMesh& mesh, uint32_t triangle, vec3 p, vec3 normal) const {
    const Corners own = corners_of(mesh, triangle);
    const vec3 face = own.normal();
    if (dot(face, face) == 0) return std::nullopt;  // no area, so no way out
    const float across = dot(normal, face);
    const float at2 = kAt * mesh.cell * kAt * mesh.cell;
    vec3 out = face;
    float nearest = at2;
    for (size_t i = 0; i < 3; ++i) {
        const float d2 = distance2(p, own.p[i], own.p[(i + 1) % 3]);
        const int32_t other = beside_[triangle][i];
        if (d2 > at2 || other < 0) continue;
        const vec3 beyond = corners_of(mesh, uint32_t(other)).normal();
        const vec3 along = own.p[(i + 1) % 3] - own.p[i];
        // Of an edge that sticks out the normal turns forward about it, from this triangle's to the other's.
        const float bend = dot(cross(face, beyond), along);
        // What is met from inside is lifted by the face.
        if (!(bend > kFlat * length(along))) return across > 0 && across < kFace ? std::nullopt : std::optional(face);
        if (d2 > nearest) continue;
        nearest = d2;
        const bool past_own = dot(cross(face, normal), along) < 0, past_other = dot(cross(normal, beyond), along) < 0;
        out = past_own ? face : past_other ? beyond : normal;
    }
    return out;
}

}  // namespace kiln::physics
