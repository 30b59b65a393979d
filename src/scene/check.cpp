// SPDX-License-Identifier: MIT
// What the reader checks of a file, for edits and objects that a program makes.

#include "scene/scene_file.h"

#include "scene/format.h"
#include "scene/read_values.h"

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

// Numbers of a struct by the rows of its table.
Fault check_table(std::string_view what, const Table& table, const float* floats) {
    for (const KeyRow& row : table.rows) {
        if (row.type != KeyType::Numbers || row.numbers.offset < 0) continue;
        for (int k = 0; k < row.numbers.arity; ++k) {
            const float v = floats[row.numbers.offset + k];
            if (!(std::abs(v) <= 1e12f))
                return fault(formatted("{}.{}: {} is no number that a scene can hold", what, row.name, shortest(v)));
            if (const auto why = sdf::out_of_range(row.numbers, v))
                return fault(formatted("{}.{}: {} is out of range; must be {}", what, row.name, shortest(v), *why));
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

Fault check_text(std::string_view key, std::string_view text) {
    if (is_utf8(text)) return std::nullopt;
    return fault(formatted("{}: bytes that are not UTF-8; no file could hold them", key));
}

Fault check_node(const Node& node, size_t objects, size_t materials) {
    if (node.kind == Node::Kind::Shape) {
        if (node.shape.kind >= sdf::shape_rows().size())
            return fault("shape: no such kind; use the structs of <kiln/shapes.h>");
        const sdf::KindRow& row = sdf::shape_rows()[node.shape.kind];
        if (auto f = check_params(row, node.shape.params)) return f;
        if (auto f = check_text("shape", node.shape.data)) return f;
        if (row.how == sdf::KindRow::Sampled && node.shape.data.empty())
            return fault(formatted("shape: a {} needs a file in `data`", row.name));
        if (row.how == sdf::KindRow::Formula && node.shape.data.starts_with(sdf::kModelText))
            return fault(
                "shape: an expression holds its formula or the name of a model, \"file:NAME.vm\", \"file:NAME.glsl\"");
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

void no_minus_zero(float* values, size_t count) {
    for (size_t i = 0; i < count; ++i)
        if (values[i] == 0) values[i] = 0;
}

// Of a shape or warp: its declared numbers, flags as 0 or 1; the rest as if never set.
void make_canonical(const sdf::KindRow& row, std::array<float, kMaxParams>& params) {
    std::array<float, kMaxParams> out{};
    for (const sdf::FieldRow& field : row.fields())
        for (int k = 0; k < field.arity; ++k) {
            const size_t at = size_t(field.offset + k);
            out[at] = field.range == "internal" ? field.defaults[size_t(k)] : params[at];
            if (field.range == "flag") out[at] = params[at] != 0 ? 1.0f : 0.0f;
        }
    no_minus_zero(out.data(), out.size());
    params = out;
}

void make_canonical(Node& node, bool of_edit) {
    if (node.kind == Node::Kind::Shape) {
        const sdf::KindRow& row = sdf::shape_rows()[node.shape.kind];
        make_canonical(row, node.shape.params);
        if (row.how != sdf::KindRow::Sampled && row.how != sdf::KindRow::Formula) node.shape.data.clear();
    } else {
        node.shape = {};
    }
    if (node.kind != Node::Kind::Object) node.object = {};
    if (node.kind != Node::Kind::Fold || of_edit) {
        node.op = Op::Union;
        node.blend_radius = 0;
        node.material_blend_radius = -1;
        node.children.clear();
    }
    if (node.material_blend_radius < 0) node.material_blend_radius = -1;
    for (Warp& warp : node.domain) make_canonical(sdf::warp_rows()[warp.kind], warp.params);
    make_unit(node.transform.rotation);
    no_minus_zero(&node.transform.position.x, 3);
    no_minus_zero(&node.transform.rotation.x, 4);
    no_minus_zero(&node.blend_radius, 1);
    if (!node.material) node.material = {};
}

}  // namespace

void make_canonical(Edit& edit) {
    make_canonical(edit.node, true);
    no_minus_zero(&edit.blend_radius, 1);
    if (edit.material_blend_radius < 0) edit.material_blend_radius = -1;
    no_minus_zero(&edit.material_blend_radius, 1);
    if (edit.outline) no_minus_zero(&edit.outline->color.x, 3);
}

void make_canonical(Object& object) {
    for (Node& node : object.nodes) make_canonical(node, false);
}

void make_canonical(Material& material) { no_minus_zero(&material.base_color.x, sizeof material / sizeof(float)); }

std::optional<Error> check_material(const std::string& name, const Material& material) {
    if (name.empty()) return fault("a material needs a name");
    if (auto f = check_text("name", name)) return f;
    return check_table(name, kMaterialTable, &material.base_color.x);
}

std::optional<Error> check_edit(const Edit& edit, size_t objects, size_t materials) {
    if (edit.node.kind == Node::Kind::Fold) return fault("an edit has no children; add an object and place it");
    if (auto f = check_node(edit.node, objects, materials)) return f;
    if (auto f = check_length("blend_radius", edit.blend_radius, true)) return f;
    if (auto f = check_length("material_blend_radius", edit.material_blend_radius, false)) return f;
    if (auto f = check_text("name", edit.name)) return f;
    if (auto f = check_text("group", edit.group)) return f;
    if (edit.outline)
        if (auto f = check_table("outline", kOutlineTable, &edit.outline->color.x)) return f;
    if (edit.op == Op::Paint && !edit.node.material) return fault("paint without a material; give the edit one");
    return std::nullopt;
}

std::optional<Error> check_object(const Object& object, size_t objects, size_t materials) {
    if (object.name.empty()) return fault("an object needs a name");
    if (auto f = check_text("name", object.name)) return f;
    if (object.nodes.empty()) return fault("an object needs a node");
    std::vector<uint8_t> parents(object.nodes.size(), 0);
    for (size_t n = 0; n < object.nodes.size(); ++n) {
        const Node& node = object.nodes[n];
        if (auto f = check_node(node, objects, materials)) return f;
        if (node.kind != Node::Kind::Fold) continue;
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
