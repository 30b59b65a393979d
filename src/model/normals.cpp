// SPDX-License-Identifier: MIT
// Normals and tangents that a file leaves out.

#include "model/drawable.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <unordered_map>

namespace kiln::model {
namespace {

vec3 unit_or(vec3 v, vec3 other) {
    const float size = length(v);
    return std::isfinite(size) && size > 1e-30f ? v / size : other;
}

vec3 face_normal(const std::vector<Vertex>& v, const uint32_t* c) {
    const vec3 a = v[c[0]].position, ab = v[c[1]].position - a, ac = v[c[2]].position - a;
    // In the size of the triangle's own sides, so that tiny ones have a normal too.
    const float size = std::max(length(ab), length(ac));
    if (!(size > 0)) return {0, 1, 0};
    return unit_or(cross(ab / size, ac / size), {0, 1, 0});
}

float angle_at(vec3 at, vec3 a, vec3 b) {
    const vec3 u = unit_or(a - at, {}), v = unit_or(b - at, {});
    return std::acos(std::clamp(dot(u, v), -1.0f, 1.0f));
}

}  // namespace

void make_flat_normals(std::vector<Vertex>& vertices, std::vector<uint32_t>& corners) {
    std::vector<Vertex> out;
    out.reserve(corners.size());
    for (size_t t = 0; t + 2 < corners.size(); t += 3) {
        const vec3 n = face_normal(vertices, &corners[t]);
        for (size_t c = 0; c < 3; ++c) {
            out.push_back(vertices[corners[t + c]]);
            out.back().normal = n;
            corners[t + c] = uint32_t(out.size() - 1);
        }
    }
    vertices = std::move(out);
}

void make_creased_normals(std::vector<Vertex>& vertices, std::vector<uint32_t>& corners, float most_degrees) {
    const float least_cosine = std::cos(most_degrees * std::numbers::pi_v<float> / 180);
    const size_t triangles = corners.size() / 3;
    // Vertices at one place are one corner of the solid, whatever the file has made of them.
    struct PlaceHash {
        size_t operator()(const std::array<float, 3>& p) const {
            size_t h = 0;
            for (const float f : p) h = h * 1099511628211u ^ std::hash<float>()(f + 0.0f);
            return h;
        }
    };
    std::unordered_map<std::array<float, 3>, uint32_t, PlaceHash> places;
    std::vector<uint32_t> place(vertices.size());
    for (size_t i = 0; i < vertices.size(); ++i) {
        const vec3 p = vertices[i].position;
        place[i] = places.emplace(std::array{p.x, p.y, p.z}, uint32_t(places.size())).first->second;
    }
    std::vector<vec3> face(triangles);
    std::vector<uint32_t> first(places.size() + 1, 0);
    for (size_t t = 0; t < triangles; ++t) {
        face[t] = face_normal(vertices, &corners[3 * t]);
        for (size_t c = 0; c < 3; ++c) ++first[place[corners[3 * t + c]] + 1];
    }
    for (size_t i = 1; i < first.size(); ++i) first[i] += first[i - 1];
    std::vector<uint32_t> around(corners.size()), fill(first.begin(), first.end() - 1);
    for (size_t i = 0; i < corners.size(); ++i) around[fill[place[corners[i]]]++] = uint32_t(i);

    std::vector<Vertex> out;
    std::vector<uint32_t> numbers(corners.size());
    std::map<std::array<float, 6>, uint32_t> same;
    for (size_t p = 0; p + 1 < first.size(); ++p) {
        same.clear();
        for (uint32_t i = first[p]; i < first[p + 1]; ++i) {
            const uint32_t at = around[i];
            vec3 sum{};
            for (uint32_t k = first[p]; k < first[p + 1]; ++k) {
                const uint32_t other = around[k], t = other / 3;
                if (dot(face[at / 3], face[t]) < least_cosine) continue;
                const uint32_t turn = other % 3;
                const vec3 here = vertices[corners[3 * t + turn]].position;
                sum = sum + face[t] * angle_at(here, vertices[corners[3 * t + (turn + 1) % 3]].position,
                                               vertices[corners[3 * t + (turn + 2) % 3]].position);
            }
            const vec3 n = unit_or(sum, face[at / 3]);
            const vec3 q = vertices[corners[at]].position;
            const auto [known, fresh] = same.emplace(std::array{q.x, q.y, q.z, n.x, n.y, n.z}, uint32_t(out.size()));
            if (fresh) {
                out.push_back(vertices[corners[at]]);
                out.back().normal = n;
            }
            numbers[at] = known->second;
        }
    }
    vertices = std::move(out);
    corners = std::move(numbers);
}

// Tangents of the corners' triangles, in the plane of the vertex's normal, weighted by the corner's angle (Mikkelsen, "Simulation of Wrinkled
// Surfaces Revisited", 2008, section 4.1). A vertex whose triangles disagree about the handedness of the texture is parted in two.
void make_tangents(std::vector<Vertex>& vertices, std::vector<uint32_t>& corners, const TextureUse& texture) {
    const auto uv_of = [&](uint32_t v) {
        const vec2 uv = vertices[v].uv[texture.uv_set];
        const auto& m = texture.map;
        return vec2{m[0] * uv.x + m[2] * uv.y + m[4], m[1] * uv.x + m[3] * uv.y + m[5]};
    };
    constexpr uint32_t kNone = UINT32_MAX;
    const size_t given = vertices.size();
    std::vector<vec3> sums(given);
    std::vector<int8_t> side(given, 0);
    std::vector<uint32_t> twin(given, kNone);
    for (size_t t = 0; t + 2 < corners.size(); t += 3) {
        const uint32_t c[3] = {corners[t], corners[t + 1], corners[t + 2]};
        const vec2 a = uv_of(c[0]), b = uv_of(c[1]), d = uv_of(c[2]);
        const float u1 = b.x - a.x, v1 = b.y - a.y, u2 = d.x - a.x, v2 = d.y - a.y;
        const float area = u1 * v2 - u2 * v1;
        if (!(std::fabs(area) > 0)) continue;
        const vec3 e1 = vertices[c[1]].position - vertices[c[0]].position,
                   e2 = vertices[c[2]].position - vertices[c[0]].position;
        const vec3 along_u = (e1 * v2 - e2 * v1) * (area < 0 ? -1.0f : 1.0f);
        const int8_t hand = area < 0 ? int8_t(-1) : int8_t(1);
        for (uint32_t k = 0; k < 3; ++k) {
            uint32_t v = c[k];
            if (side[v] != 0 && side[v] != hand) {
                if (twin[v] == kNone) {
                    twin[v] = uint32_t(vertices.size());
                    vertices.push_back(Vertex(vertices[v]));
                    sums.push_back({});
                    side.push_back(hand);
                    twin.push_back(kNone);
                }
                v = twin[v];
                corners[t + k] = v;
            }
            side[v] = hand;
            const vec3 n = vertices[v].normal;
            const vec3 flat = unit_or(along_u - n * dot(n, along_u), {});
            const vec3 here = vertices[c[k]].position;
            sums[v] =
                sums[v] + flat * angle_at(here, vertices[c[(k + 1) % 3]].position, vertices[c[(k + 2) % 3]].position);
        }
    }
    for (size_t v = 0; v < vertices.size(); ++v) {
        const vec3 n = vertices[v].normal;
        const vec3 any = std::fabs(n.x) < 0.9f ? vec3{1, 0, 0} : vec3{0, 1, 0};
        const vec3 tangent = unit_or(sums[v] - n * dot(n, sums[v]), normalize(any - n * dot(n, any)));
        // Textures have v downwards, so that a picture seen upright on a front face has hand -1 in (u, v): the bitangent points up.
        vertices[v].tangent = {tangent.x, tangent.y, tangent.z, side[v] < 0 ? 1.0f : -1.0f};
    }
}

}  // namespace kiln::model
