// SPDX-License-Identifier: MIT
#include "field/mesh_facts.h"

#include <algorithm>

namespace kiln::field {

MeshFacts mesh_facts(std::span<const vec3> positions, std::span<const uint32_t> triangles,
                     std::vector<uint32_t>* faulty) {
    MeshFacts out;
    out.triangles = triangles.size() / 3;

    // Edges by their lower vertex; of the other end, twice its number, and 1 more where the triangle runs downwards.
    std::vector<size_t> first(positions.size() + 2);
    std::vector<bool> used(positions.size());
    const auto each_edge = [&](auto&& fn) {
        for (size_t t = 0; t + 2 < triangles.size(); t += 3) {
            for (size_t i = 0; i < 3; ++i) fn(triangles[t + i], triangles[t + (i + 1) % 3]);
        }
    };
    each_edge([&](uint32_t a, uint32_t b) {
        used[a] = true;
        ++first[size_t(std::min(a, b)) + 2];
    });
    for (size_t i = 2; i < first.size(); ++i) first[i] += first[i - 1];
    std::vector<uint64_t> ends(triangles.size());
    each_edge([&](uint32_t a, uint32_t b) {
        ends[first[size_t(std::min(a, b)) + 1]++] = 2 * uint64_t(std::max(a, b)) + (a > b ? 1u : 0u);
    });
    for (size_t v = 0; v < positions.size(); ++v) {
        if (used[v]) ++out.vertices;
        const auto begin = ends.begin() + ptrdiff_t(first[v]), end = ends.begin() + ptrdiff_t(first[v + 1]);
        std::sort(begin, end);
        for (auto it = begin; it != end;) {
            const auto same = std::find_if(it, end, [&](uint64_t e) { return e / 2 != *it / 2; });
            ++out.edges;
            const bool open = same - it == 1, odd = same - it > 2 || (!open && *it == *(it + 1));
            out.open_edges += open;
            out.non_manifold_edges += odd;
            if (faulty != nullptr && (open || odd)) faulty->insert(faulty->end(), {uint32_t(v), uint32_t(*it / 2)});
            it = same;
        }
    }

    // Tetrahedra to the middle, so that far-away meshes keep their digits.
    for (size_t v = 0; v < positions.size(); ++v)
        if (used[v]) out.bounds = box_union(out.bounds, {positions[v], positions[v]});
    if (out.bounds.empty()) return out;
    const vec3 middle = out.bounds.center();
    const auto at = [&](uint32_t v) {
        const vec3 p = positions[v];
        return dvec3{double(p.x) - double(middle.x), double(p.y) - double(middle.y), double(p.z) - double(middle.z)};
    };
    for (size_t t = 0; t + 2 < triangles.size(); t += 3) {
        const dvec3 a = at(triangles[t]), b = at(triangles[t + 1]), c = at(triangles[t + 2]);
        const dvec3 u{b.x - a.x, b.y - a.y, b.z - a.z}, v{c.x - a.x, c.y - a.y, c.z - a.z};
        const dvec3 n{u.y * v.z - u.z * v.y, u.z * v.x - u.x * v.z, u.x * v.y - u.y * v.x};
        out.area += 0.5 * std::sqrt(n.x * n.x + n.y * n.y + n.z * n.z);
        out.volume += (a.x * n.x + a.y * n.y + a.z * n.z) / 6;
    }
    return out;
}

}  // namespace kiln::field
