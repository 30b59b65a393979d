// SPDX-License-Identifier: MIT
// What the reader checks of a file, for edits and objects that a program makes.

#include "scene/scene_file.h"

#include "scene/format.h"

#include "sdf/expression_code.h"

#include "base/format.h"

#include <cmath>

namespace kiln::scene {

namespace {

using Fault = std::optional<Error>;

Fault fault(const std::string& message) { return Error{message, ErrorKind::Usage}; }

Fault check_length(std::string_view key, float v, bool positive) {
    if (!std::isfinite(v)) return fault(formatted("{}: {} is not finite; use a finite number", key, shortest(v)));
    if (std::abs(v) > kFarthest)
        return fault(formatted("{}: {} is too large; at most {} metres", key, shortest(v), shortest(kFarthest)));
    if (positive && v < 0) return fault(formatted("{}: {} is negative; must be 0 or more", key, shortest(v)));
    return std::nullopt;
}

Fault check_params(const sdf::KindRow& row, const std::array<float, kMaxParams>& params) {
    for (const sdf::FieldRow& field : row.fields()) {
        if (field.range == "internal") continue;
        for (int k = 0; k < field.arity; ++k) {
            const float v = params[size_t(field.offset + k)];
            if (field.unit == "m")
                if (auto f = check_length(field.name, v, false)) return f;
            if (const auto why = sdf::out_of_range(field, v))
                return fault(formatted("{}: {} is out of range; {}{}", field.name, shortest(v),
                                       why->starts_with('[') || why->starts_with('(') ? "must be in " : "", *why));
        }
    }
    return std::nullopt;
}

Fault check_transform(const Transform& t) {
    for (const float v : {t.position.x, t.position.y, t.position.z})
        if (auto f = check_length("position", v, false)) return f;
    for (const float v : {t.scale.x, t.scale.y, t.scale.z})
        if (!(v >= kSmallestScale && v <= kLargestScale))
            return fault(formatted("scale: {} is out of range; a scale is between {} and {}", shortest(v),
                                   shortest(kSmallestScale), shortest(kLargestScale)));
    const quat& q = t.rotation;
    const float length = std::sqrt(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w);
    if (!(std::abs(length - 1) <= 1e-3f))
        return fault(formatted("rotation: a quaternion of length {}; its length must be 1", shortest(length)));
    return std::nullopt;
}

Fault check_node(const Node& node, size_t objects, size_t materials) {
    if (node.kind == Node::Kind::Shape) {
        if (node.shape.kind >= sdf::shape_rows().size())
            return fault("shape: no such kind; use the structs of <kiln/shapes.h>");
        const sdf::KindRow& row = sdf::shape_rows()[node.shape.kind];
        if (auto f = check_params(row, node.shape.params)) return f;
        if (row.how == sdf::KindRow::Sampled && node.shape.data.empty())
            return fault(formatted("shape: a {} needs a file in `data`", row.name));
        if (row.how == sdf::KindRow::Formula && node.shape.data.starts_with(sdf::kModelText))
            return fault("shape: an expression holds its formula or the name of a model, \"file:NAME.vm\"");
    } else if (node.kind == Node::Kind::Object && node.object.index >= objects) {
        return fault("object: there is no such object; add it first");
    }
    for (const Warp& warp : node.domain) {
        if (warp.kind >= sdf::warp_rows().size())
            return fault("domain: no such warp; use the structs of <kiln/shapes.h>");
        if (auto f = check_params(sdf::warp_rows()[warp.kind], warp.params)) return f;
    }
    if (node.material && node.material.index >= materials)
        return fault("material: there is no such material; add it first");
    return check_transform(node.transform);
}

}  // namespace

std::optional<Error> check_edit(const Edit& edit, size_t objects, size_t materials) {
    if (edit.node.kind == Node::Kind::Fold) return fault("an edit has no children; add an object and place it");
    if (auto f = check_node(edit.node, objects, materials)) return f;
    if (auto f = check_length("blend_radius", edit.blend_radius, true)) return f;
    if (auto f = check_length("material_blend_radius", edit.material_blend_radius, false)) return f;
    if (edit.op == Op::Paint && !edit.node.material) return fault("paint without a material; give the edit one");
    return std::nullopt;
}

std::optional<Error> check_object(const Object& object, size_t objects, size_t materials) {
    if (object.name.empty()) return fault("an object needs a name");
    if (object.nodes.empty()) return fault("an object needs a node");
    std::vector<uint8_t> parents(object.nodes.size(), 0);
    for (size_t n = 0; n < object.nodes.size(); ++n) {
        const Node& node = object.nodes[n];
        if (auto f = check_node(node, objects, materials)) return f;
        if (node.kind != Node::Kind::Fold) continue;
        if (node.op == Op::Paint)
            return fault("paint is an operation of edits, not of trees; use union, subtract or intersect");
        if (node.children.empty()) return fault("a fold without children; give it at least one");
        if (auto f = check_length("blend_radius", node.blend_radius, true)) return f;
        if (auto f = check_length("material_blend_radius", node.material_blend_radius, false)) return f;
        for (const uint32_t c : node.children) {
            if (c <= n || c >= object.nodes.size())
                return fault(formatted("child {} of node {}: children have higher indices than their parent", c, n));
            if (parents[c]++) return fault(formatted("node {} has two parents; it may have one", c));
        }
    }
    return std::nullopt;
}

}  // namespace kiln::scene
