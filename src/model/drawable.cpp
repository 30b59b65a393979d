// SPDX-License-Identifier: MIT

#include "model/drawable.h"

#include "model/closed.h"
#include "model/triangles.h"

#include <algorithm>

namespace kiln::model {

void finish(Drawable& d) {
    d.bvh.clear();
    std::vector<vec3> positions;
    for (const Vertex& v : d.vertices) positions.push_back(v.position);
    for (Primitive& p : d.primitives) {
        const uint32_t triangles = p.index_count / 3;
        std::vector<Box3> boxes(triangles);
        const std::span<uint32_t> corners = std::span(d.indices).subspan(p.first_index, p.index_count);
        for (uint32_t t = 0; t < triangles; ++t) {
            for (uint32_t c = 0; c < 3; ++c) {
                const vec3 q = d.vertices[corners[3 * t + c]].position;
                boxes[t] = box_union(boxes[t], {q, q});
            }
        }
        std::vector<uint32_t> order;
        const std::vector<BvhNode> nodes = build_bvh(boxes, order);
        p.first_node = uint32_t(d.bvh.size());
        p.node_count = uint32_t(nodes.size());
        d.bvh.insert(d.bvh.end(), nodes.begin(), nodes.end());
        p.bounds = nodes.empty() ? Box3{} : Box3{nodes[0].min, nodes[0].max};
        const std::vector<uint32_t> old(corners.begin(), corners.end());
        for (uint32_t t = 0; t < triangles; ++t)
            for (uint32_t c = 0; c < 3; ++c) corners[3 * t + c] = old[3 * order[t] + c];
        std::vector<uint32_t> counted(corners.begin(), corners.end());
        for (uint32_t& corner : counted) corner -= p.first_vertex;
        p.closed = is_closed(std::span(positions).subspan(p.first_vertex, p.vertex_count), counted);
    }
}

Drawable drawable_of(const Triangles& triangles, const std::string& name) {
    Drawable out;
    out.name = name;
    out.vertices.resize(triangles.positions.size());
    for (size_t i = 0; i < out.vertices.size(); ++i) out.vertices[i].position = triangles.positions[i];
    out.indices.reserve(triangles.faces.size() * 3);
    for (const Face& f : triangles.faces) out.indices.insert(out.indices.end(), f.begin(), f.end());
    constexpr float kCreaseDegrees = 40;
    make_creased_normals(out.vertices, out.indices, kCreaseDegrees);
    Surface grey;
    grey.base_color = {0.5f, 0.5f, 0.5f, 1};
    grey.metallic = 0;
    grey.roughness = 0.6f;
    grey.double_sided = true;  // nothing says which way its faces look
    out.surfaces.push_back(std::move(grey));
    Primitive p;
    p.index_count = uint32_t(out.indices.size());
    p.vertex_count = uint32_t(out.vertices.size());
    out.primitives.push_back(p);
    DrawNode node;
    node.primitive_count = 1;
    out.nodes.push_back(std::move(node));
    finish(out);
    return out;
}

Box3 bounds_of(const Drawable& d) {
    Box3 out;
    const std::vector<Matrix> places = pose(d, 0);
    for (size_t n = 0; n < d.nodes.size(); ++n) {
        for (uint32_t i = 0; i < d.nodes[n].primitive_count; ++i) {
            const Box3& b = d.primitives[d.nodes[n].first_primitive + i].bounds;
            if (b.empty()) continue;
            for (int corner = 0; corner < 8; ++corner) {
                const dvec3 q = transform_point(
                    places[n], {double(corner & 1 ? b.max.x : b.min.x), double(corner & 2 ? b.max.y : b.min.y),
                                double(corner & 4 ? b.max.z : b.min.z)});
                const vec3 at{float(q.x), float(q.y), float(q.z)};
                out = box_union(out, {at, at});
            }
        }
    }
    return out;
}

}  // namespace kiln::model
