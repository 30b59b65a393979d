// SPDX-License-Identifier: MIT

#include "scene/read_nodes.h"

#include "scene/heights.h"

#include "sdf/expression_code.h"

#include "base/format.h"
#include "base/suggest.h"

#include <unordered_set>

namespace kiln::scene {

namespace {

template <typename Map>
std::vector<std::string_view> names_of(const Map& map) {
    std::vector<std::string_view> out;
    for (const auto& [name, index] : map) out.push_back(name);
    std::sort(out.begin(), out.end());
    return out;
}

std::vector<std::string_view> names_of(std::span<const sdf::KindRow> rows) {
    std::vector<std::string_view> out;
    for (const sdf::KindRow& row : rows) out.push_back(row.name);
    return out;
}

void set_defaults(const sdf::KindRow& row, std::array<float, kMaxParams>& params) {
    for (const sdf::FieldRow& field : row.fields())
        for (int k = 0; k < field.arity; ++k) params[size_t(field.offset + k)] = field.defaults[size_t(k)];
}

const sdf::FieldRow* find_field(const sdf::KindRow& row, std::string_view key) {
    for (const sdf::FieldRow& field : row.fields())
        if (field.name == key && field.range != "internal") return &field;
    return nullptr;
}

}  // namespace

bool NodeReader::unknown_node_key(JsonIndex member, const Table& table, const Node& node) {
    std::vector<std::string_view> known;
    if (node.kind == Node::Kind::Shape) {
        const sdf::KindRow& row = sdf::shape_rows()[node.shape.kind];
        for (const sdf::FieldRow& field : row.fields())
            if (field.range != "internal") known.push_back(field.name);
        if (row.how == sdf::KindRow::Sampled || row.how == sdf::KindRow::Formula) known.push_back("file");
        if (row.how == sdf::KindRow::Formula) known.push_back("expression");
        // A size of another shape: say what this one has.
        const std::string_view key = in_.doc.key(member);
        if (nearest_word(key, known).empty() && !find_row(table, key)) {
            for (const sdf::KindRow& other : sdf::shape_rows()) {
                if (!find_field(other, key)) continue;
                std::string own;
                for (const std::string_view k : known) own += (own.empty() ? "" : ", ") + std::string(k);
                return in_.fail_at_key(
                    member, formatted("a {} has no {}; it has {}", row.name, key, own.empty() ? "no sizes" : own));
            }
        }
    }
    for (const KeyRow& row : table.rows) known.push_back(row.name);
    return in_.unknown_key(member, known);
}

bool NodeReader::shape(JsonIndex at, JsonIndex name, Node& out) {
    if (!in_.text(name, "sphere", nullptr)) return false;
    const std::string_view word = in_.doc.text(name);
    const auto kind = sdf::shape_kind(word);
    if (!kind) return in_.unknown_name(name, "shape", names_of(sdf::shape_rows()));
    out.kind = Node::Kind::Shape;
    out.object = {};
    out.shape = {};
    out.shape.kind = *kind;
    const sdf::KindRow& row = sdf::shape_rows()[*kind];
    set_defaults(row, out.shape.params);
    if (row.how == sdf::KindRow::Sampled && !in_.doc.find(at, "file"))
        return in_.fail(at, formatted("a {} needs a \"file\"; name {}, relative to the scene file", row.name,
                                      resource_of(*kind).what));
    if (row.how == sdf::KindRow::Formula) {
        const auto text = in_.doc.find(at, "expression"), file = in_.doc.find(at, "file");
        if (!text && !file)
            return in_.fail(at,
                            "an expression needs its formula; add \"expression\": \"length(p) - 1\", or \"file\" with "
                            "a .vm model or a .glsl function");
        if (text && file) return in_.fail_at_key(*file, "\"expression\" and \"file\" in one place; keep one of them");
    }
    return true;
}

bool NodeReader::domain(JsonIndex at, std::vector<Warp>& out) {
    const JsonDocument& doc = in_.doc;
    if (!doc.is(at, JsonType::Array))
        return in_.wrong_type(at, "an array such as [{\"warp\": \"twist\", \"rate\": 1}]");
    for (JsonIndex c = doc.first(at); c < doc.next(at); c = doc.next(c)) {
        if (!doc.is(c, JsonType::Object))
            return in_.wrong_type(c, "an object such as {\"warp\": \"twist\", \"rate\": 1}");
        const auto name = doc.find(c, "warp");
        if (!name) return in_.fail(c, "the key \"warp\" is missing; add for example \"warp\": \"twist\"");
        if (!in_.text(*name, "twist", nullptr)) return false;
        const auto kind = sdf::warp_kind(doc.text(*name));
        if (!kind) return in_.unknown_name(*name, "warp", names_of(sdf::warp_rows()));
        const sdf::KindRow& row = sdf::warp_rows()[*kind];
        Warp warp;
        warp.kind = *kind;
        set_defaults(row, warp.params);
        for (JsonIndex m = doc.first(c); m < doc.next(c); m = doc.next(m)) {
            if (m == *name) continue;
            const sdf::FieldRow* field = find_field(row, doc.key(m));
            if (!field) {
                std::vector<std::string_view> known{"warp"};
                for (const sdf::FieldRow& f : row.fields())
                    if (f.range != "internal") known.push_back(f.name);
                return in_.unknown_key(m, known);
            }
            if (!in_.numbers(m, *field, warp.params.data() + field->offset)) return false;
        }
        out.push_back(warp);
    }
    return true;
}

bool NodeReader::node(JsonIndex at, Node& out, Edit* edit, bool partly) {
    const JsonDocument& doc = in_.doc;
    if (!doc.is(at, JsonType::Object))
        return in_.wrong_type(at, "an object such as {\"shape\": \"sphere\", \"radius\": 0.5}");
    const auto shape_at = doc.find(at, "shape"), object_at = doc.find(at, "object"),
               children_at = doc.find(at, "children");
    if (edit && children_at)
        return in_.fail_at_key(*children_at,
                               "an edit has no children; put the tree into \"objects\" and name it with \"object\"");
    if (shape_at && object_at)
        return in_.fail_at_key(*object_at, "a shape and an object in one place; keep one of them");
    if (children_at && (shape_at || object_at))
        return in_.fail_at_key(*children_at, "children beside a shape or object; keep one of them");
    if (!shape_at && !object_at && !children_at && !partly)
        return in_.fail(at, edit ? "neither a shape nor an object; add for example \"shape\": \"sphere\""
                                 : "neither a shape, an object nor children; add for example \"shape\": \"sphere\"");
    if (shape_at && !shape(at, *shape_at, out)) return false;
    if (object_at) {
        if (!in_.text(*object_at, "washer", nullptr)) return false;
        const auto found = objects_.find(doc.text(*object_at));
        if (found == objects_.end()) return in_.unknown_name(*object_at, "object", names_of(objects_));
        out.kind = Node::Kind::Object;
        out.shape = {};
        out.object = {found->second, 0};
    }
    if (children_at) {
        if (!doc.is(*children_at, JsonType::Array)) return in_.wrong_type(*children_at, "an array of nodes");
        if (doc.first(*children_at) == doc.next(*children_at))
            return in_.fail(*children_at, "no children; add at least one");
        out.kind = Node::Kind::Fold;
    }
    const Table& table = edit ? kEditTable : kNodeTable;
    const sdf::KindRow* shape_row = out.kind == Node::Kind::Shape ? &sdf::shape_rows()[out.shape.kind] : nullptr;
    for (JsonIndex m = doc.first(at); m < doc.next(at); m = doc.next(m)) {
        const std::string_view key = doc.key(m);
        if (shape_row) {
            if (const sdf::FieldRow* field = find_field(*shape_row, key)) {
                if (!in_.numbers(m, *field, out.shape.params.data() + field->offset)) return false;
                continue;
            }
            if (shape_row->how == sdf::KindRow::Formula && (key == "expression" || key == "file")) {
                const bool file = key == "file";
                if (!in_.text(m, file ? "model.vm" : "length(p) - 1", &out.shape.data)) return false;
                if (file && !out.shape.data.ends_with(".vm") && !out.shape.data.ends_with(".glsl"))
                    return in_.fail(
                        m, "not the name of a .vm model or of a .glsl function; name one, relative to the scene file");
                if (file) out.shape.data = std::string(sdf::kModelFile) + out.shape.data;
                continue;
            }
            if (key == "file" && shape_row->how == sdf::KindRow::Sampled) {
                const Resource resource = resource_of(out.shape.kind);
                if (!in_.text(m, resource.example, &out.shape.data)) return false;
                if (out.shape.data.empty())
                    return in_.fail(m, formatted("an empty name; name {}, relative to the scene file", resource.what));
                continue;
            }
        }
        const KeyRow* row = find_row(table, key);
        if (!row) return unknown_node_key(m, table, out);
        const bool folds = key == "op" || key == "blend_radius" || key == "material_blend_radius";
        if (!edit && folds && out.kind != Node::Kind::Fold)
            return in_.fail_at_key(m, "stands on the node with \"children\", not on a leaf; move it there");
        bool ok = true;
        if (row->type == KeyType::Node) {
            if (key == "domain") out.domain.clear(), ok = domain(m, out.domain);
        } else if (key == "position") {
            ok = in_.numbers(m, row->numbers, &out.transform.position.x);
        } else if (key == "rotation") {
            ok = in_.rotation(m, &out.transform.rotation);
        } else if (key == "scale") {
            ok = in_.scale(m, &out.transform.scale);
        } else if (key == "material") {
            ok = in_.text(m, "clay", nullptr);
            if (ok) {
                const auto found = materials_.find(doc.text(m));
                if (found == materials_.end()) return in_.unknown_name(m, "material", names_of(materials_));
                out.material = {found->second, 0};
            }
        } else if (key == "op") {
            int op = 0;
            ok = in_.choice(m, row->choices, &op);
            (edit ? edit->op : out.op) = Op(op);
        } else if (key == "blend_radius") {
            ok = in_.numbers(m, row->numbers, edit ? &edit->blend_radius : &out.blend_radius);
        } else if (key == "material_blend_radius") {
            ok = in_.numbers(m, row->numbers, edit ? &edit->material_blend_radius : &out.material_blend_radius);
        } else if (edit && key == "id") {
            ok = in_.text(m, "lump", &edit->name);
            if (ok && edit->name.empty()) return in_.fail(m, "an empty id; give it a name or leave the key out");
        } else if (edit && key == "dynamic") {
            ok = in_.boolean(m, &edit->dynamic);
        } else if (edit && key == "hidden") {
            ok = in_.boolean(m, &edit->hidden);
        } else if (edit && key == "group") {
            ok = in_.text(m, "tower", &edit->group);
        } else if (edit && key == "outline") {
            ok = in_.table(m, kOutlineTable, &edit->outline.emplace().color.x);
        } else {
            ok = in_.value(m, *row, nullptr);
        }
        if (!ok) return false;
    }
    if (edit && edit->op == Op::Paint && !out.material)
        return in_.fail(at, "paint without a material; add \"material\"");
    return true;
}

bool NodeReader::edit(JsonIndex at, Edit& out, bool partly) { return node(at, out.node, &out, partly); }

bool NodeReader::object_tree(JsonIndex at, Object& out, std::vector<JsonIndex>& places) {
    out.nodes.resize(1);
    places.assign(1, at);
    // A node's children get the next free indices; `n` then reaches them in its turn.
    for (size_t n = 0; n < out.nodes.size(); ++n) {
        Node read;
        if (!node(places[n], read, nullptr)) return false;
        if (read.kind == Node::Kind::Fold) {
            const JsonIndex children = *in_.doc.find(places[n], "children");
            for (JsonIndex c = in_.doc.first(children); c < in_.doc.next(children); c = in_.doc.next(c)) {
                read.children.push_back(uint32_t(places.size()));
                places.push_back(c);
            }
            out.nodes.resize(places.size());
        }
        out.nodes[n] = std::move(read);
    }
    return true;
}

bool NodeReader::objects(JsonIndex section, SceneData& scene) {
    const JsonDocument& doc = in_.doc;
    for (JsonIndex c = doc.first(section); c < doc.next(section); c = doc.next(c))
        scene.objects.push_back({std::string(doc.key(c)), {}});
    scene.object_places.resize(scene.objects.size());
    size_t n = 0;
    for (JsonIndex c = doc.first(section); c < doc.next(section); c = doc.next(c), ++n)
        if (!object_tree(c, scene.objects[n], scene.object_places[n])) return false;
    return no_cycles(scene);
}

// Depth-first over references with a stack of its own.
bool NodeReader::no_cycles(const SceneData& scene) {
    enum Mark : uint8_t { Unseen, Open, Done };
    struct Visit {
        uint32_t object, node;
    };
    std::vector<Mark> marks(scene.objects.size(), Unseen);
    std::vector<Visit> stack;
    for (uint32_t root = 0; root < scene.objects.size(); ++root) {
        if (marks[root] != Unseen) continue;
        marks[root] = Open;
        stack.push_back({root, 0});
        while (!stack.empty()) {
            Visit& top = stack.back();
            const Object& object = scene.objects[top.object];
            if (top.node == object.nodes.size()) {
                marks[top.object] = Done;
                stack.pop_back();
                continue;
            }
            const uint32_t n = top.node++;
            if (object.nodes[n].kind != Node::Kind::Object) continue;
            const uint32_t next = object.nodes[n].object.index;
            if (marks[next] == Open) {
                const JsonIndex place = *in_.doc.find(scene.object_places[top.object][n], "object");
                std::string path;
                bool inside = false;
                int shown = 0;
                for (const Visit& v : stack) {
                    inside = inside || v.object == next;
                    if (!inside) continue;
                    if (shown == 8) path += "... -> ";
                    if (shown++ < 8) path += scene.objects[v.object].name + " -> ";
                }
                path += scene.objects[next].name;
                return in_.fail(place,
                                formatted("the object contains itself: {}; take one of these references out", path));
            }
            if (marks[next] == Unseen) {
                marks[next] = Open;
                stack.push_back({next, 0});  // `top` is stale from here
            }
        }
    }
    return true;
}

bool NodeReader::edits(JsonIndex section, SceneData& scene) {
    const JsonDocument& doc = in_.doc;
    std::unordered_map<std::string, uint32_t> ids;
    const uint32_t count = doc.count(section);
    scene.edits.reserve(count);
    scene.edit_places.reserve(count);
    ids.reserve(count);
    for (JsonIndex c = doc.first(section); c < doc.next(section); c = doc.next(c)) {
        Edit& edit = scene.edits.emplace_back();
        scene.edit_places.push_back(c);
        if (!node(c, edit.node, &edit)) return false;
        if (edit.name.empty()) continue;
        if (const auto [old, fresh] = ids.emplace(edit.name, uint32_t(scene.edits.size() - 1)); !fresh)
            return in_.fail(*doc.find(c, "id"),
                            formatted("edits[{}] has this id too; ids are unique, choose another", old->second));
    }
    // Ids for those without: "sphere-7" for the seventh edit.
    for (size_t i = 0; i < scene.edits.size(); ++i) {
        Edit& edit = scene.edits[i];
        if (!edit.name.empty()) continue;
        const Node& n = edit.node;
        const std::string base(n.kind == Node::Kind::Shape ? sdf::shape_rows()[n.shape.kind].name
                                                           : scene.objects[n.object.index].name);
        edit.name = formatted("{}-{}", base, i + 1);
        for (int k = 2; !ids.emplace(edit.name, uint32_t(i)).second; ++k)
            edit.name = formatted("{}-{}-{}", base, i + 1, k);
    }
    return true;
}

}  // namespace kiln::scene
