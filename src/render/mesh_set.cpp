// SPDX-License-Identifier: MIT
#include "render/mesh_set.h"

#include <algorithm>
#include <cmath>

namespace kiln::render {

using model::BvhNode;
using model::Drawable;
using model::Matrix;
using model::Primitive;

namespace {

Box3 box_of(const Box3& local, const Matrix& place) {
    Box3 out;
    if (local.empty()) return out;
    for (int corner = 0; corner < 8; ++corner) {
        const dvec3 q = model::transform_point(
            place, {double(corner & 1 ? local.max.x : local.min.x), double(corner & 2 ? local.max.y : local.min.y),
                    double(corner & 4 ? local.max.z : local.min.z)});
        const vec3 at{float(q.x), float(q.y), float(q.z)};
        out = box_union(out, {at, at});
    }
    const vec3 far = max(out.max, -out.min);
    return out.inflated(4e-7f * std::max({std::fabs(far.x), std::fabs(far.y), std::fabs(far.z)}));
}

// Vertices of a skinned primitive where its joints take them, in the model's frame; the node's own place does not count (glTF 2.0, 3.7.3.3).
void skin(MeshSet& set, MeshSet::Part& part, const Drawable& d, const Primitive& p, const std::vector<Matrix>& joints,
          const Matrix& world) {
    part.first_moved = uint32_t(set.moved.size());
    for (uint32_t i = 0; i < p.vertex_count; ++i) {
        const model::SkinWeights& w = d.weights[p.first_weights + i];
        Matrix m{};
        for (size_t k = 0; k < 4; ++k)
            if (w.weights[k] > 0)
                for (size_t e = 0; e < 16; ++e) m[e] += double(w.weights[k]) * joints[w.joints[k]][e];
        model::Vertex v = d.vertices[p.first_vertex + i];
        const dvec3 q = model::transform_point(m, {v.position.x, v.position.y, v.position.z});
        v.position = {float(q.x), float(q.y), float(q.z)};
        const Matrix back = model::inverse(m);
        const auto turned = [&](vec3 n, bool normal) {
            const dvec3 from{n.x, n.y, n.z};
            const dvec3 to = normal ? dvec3{back[0] * from.x + back[1] * from.y + back[2] * from.z,
                                            back[4] * from.x + back[5] * from.y + back[6] * from.z,
                                            back[8] * from.x + back[9] * from.y + back[10] * from.z}
                                    : model::transform_vector(m, from);
            const double size = std::sqrt(to.x * to.x + to.y * to.y + to.z * to.z);
            return size > 0 ? vec3{float(to.x / size), float(to.y / size), float(to.z / size)} : n;
        };
        v.normal = turned(v.normal, true);
        const vec3 t = turned({v.tangent.x, v.tangent.y, v.tangent.z}, false);
        v.tangent = {t.x, t.y, t.z, v.tangent.w};
        set.moved.push_back(v);
    }
    part.first_node = uint32_t(set.moved_nodes.size());
    set.moved_nodes.insert(set.moved_nodes.end(), d.bvh.begin() + p.first_node,
                           d.bvh.begin() + p.first_node + p.node_count);
    std::vector<Box3> boxes(p.index_count / 3);
    for (size_t t = 0; t < boxes.size(); ++t)
        for (size_t c = 0; c < 3; ++c) {
            const vec3 at =
                set.moved[part.first_moved + d.indices[p.first_index + 3 * t + c] - p.first_vertex].position;
            boxes[t] = box_union(boxes[t], {at, at});
        }
    const std::span<BvhNode> nodes = std::span(set.moved_nodes).subspan(part.first_node);
    model::refit_bvh(nodes, boxes);
    part.place = world;
    part.bounds = nodes.empty() ? Box3{} : box_of({nodes[0].min, nodes[0].max}, world);
}

}  // namespace

const model::Vertex* MeshSet::vertices(const Part& part) const {
    if (part.first_moved == UINT32_MAX) return drawable(part).vertices.data();
    return moved.data() + part.first_moved - primitive(part).first_vertex;
}

const BvhNode* MeshSet::nodes(const Part& part) const {
    return part.first_moved == UINT32_MAX ? drawable(part).bvh.data() + primitive(part).first_node
                                          : moved_nodes.data() + part.first_node;
}

MeshSet make_mesh_set(const Frame& frame) {
    MeshSet out;
    std::vector<MeshSet::Part> parts;
    for (size_t m = 0; m < frame.meshes.size(); ++m) {
        const MeshInstance& mesh = frame.meshes[m];
        if (!mesh.model) continue;
        const Drawable& d = *mesh.model;
        const auto known = std::find(out.models.begin(), out.models.end(), mesh.model);
        const auto number = uint32_t(known - out.models.begin());
        if (known == out.models.end()) out.models.push_back(mesh.model);
        const Matrix world = model::matrix_of(mesh.transform), world_before = model::matrix_of(mesh.before);
        const std::vector<Matrix> places = model::pose(d, frame.time);
        const bool moves = d.duration > 0 && frame.time_before != frame.time;
        const std::vector<Matrix> before = moves ? model::pose(d, frame.time_before) : places;
        for (size_t n = 0; n < d.nodes.size(); ++n) {
            const model::DrawNode& node = d.nodes[n];
            std::vector<Matrix> joints;
            if (node.skin >= 0 && node.primitive_count > 0) {
                const model::Skin& skin = d.skins[size_t(node.skin)];
                for (size_t j = 0; j < skin.joints.size(); ++j)
                    joints.push_back(model::times(places[skin.joints[j]], skin.from_model[j]));
            }
            for (uint32_t i = 0; i < node.primitive_count; ++i) {
                const uint32_t primitive = node.first_primitive + i;
                const Primitive& p = d.primitives[primitive];
                if (p.index_count == 0) continue;
                MeshSet::Part part;
                part.model = number;
                part.primitive = primitive;
                part.mesh = uint32_t(m);
                part.place = model::times(world, places[n]);
                part.before = model::times(world_before, before[n]);
                if (p.first_weights != UINT32_MAX && !joints.empty()) {
                    part.before = world_before;  // joints count as they are now
                    skin(out, part, d, p, joints, world);
                } else {
                    part.bounds = box_of(p.bounds, part.place);
                }
                const double size = model::determinant(part.place);
                // Flattened to nothing: a scale of 0 hides a node.
                if (!(std::fabs(size) > 1e-30) || !part.bounds.finite()) continue;
                part.number = uint32_t(parts.size());
                parts.push_back(part);
            }
        }
    }
    std::vector<Box3> boxes;
    for (const MeshSet::Part& part : parts) boxes.push_back(part.bounds);
    std::vector<uint32_t> order;
    out.tree = model::build_bvh(boxes, order);
    for (const uint32_t i : order) out.parts.push_back(parts[i]);
    return out;
}

}  // namespace kiln::render
