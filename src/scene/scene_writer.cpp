// SPDX-License-Identifier: MIT
// Writes a scene: keys in the order of the file it came from, new keys in the order of the tables, shortest numbers.
// A default is written only where the file had it.

#include "scene/command.h"
#include "scene/format.h"
#include "scene/scene_file.h"

#include "sdf/expression_code.h"

#include <cstring>
#include <unordered_map>

namespace kiln::scene {

namespace {

constexpr JsonIndex kNowhere = SceneData::kNowhere;
using Members = std::vector<std::pair<std::string_view, JsonIndex>>;  // key, where it stood

class SceneWriter {
public:
    SceneWriter(const SceneData& scene, const SceneData::Stage& stage, const JsonDocument& old,
                std::span<const PlacedEdit> edits)
        : scene_(scene), stage_(stage), old_(old), edits_(edits) {}

    JsonDocument run(bool plain = false) {
        plain_ = plain;
        out_.open(JsonType::Object);
        std::vector<std::string_view> keys;
        for (const KeyRow& row : kSceneTable.rows) keys.push_back(row.name);
        for (const auto& [key, at] : members(old_.empty() ? kNowhere : 0, keys)) section(key, at);
        out_.close();
        return std::move(out_);
    }

    // Parts of a scene as they are written where there was none before.
    std::string run(const CommandView& command) {
        out_.open(JsonType::Object);
        const std::string_view key = command_key(command.kind);
        switch (command.kind) {
        case CommandKind::Add:
        case CommandKind::Change:
            edit(key, *command.edit, kNowhere);
            if (command.kind == CommandKind::Change && command.id != command.edit->name)
                out_.add_text(command.id, "was");
            break;
        case CommandKind::Remove:
        case CommandKind::Reorder:
            out_.add_text(command.id, key);
            break;
        case CommandKind::Material:
        case CommandKind::Object:
            out_.open(JsonType::Object, key);
            if (command.material != nullptr) {
                out_.open(JsonType::Object, command.id);
                material(*command.material, kNowhere);
                out_.close();
            } else if (command.object != nullptr) {
                tree(*command.object, {});
            } else {
                out_.add_null(command.id);
            }
            out_.close();
            break;
        case CommandKind::Field:
        case CommandKind::Lights:
        case CommandKind::Cameras:
        case CommandKind::Meshes:
        case CommandKind::Bodies:
        case CommandKind::Characters:
            whole_ = plain_ = true;
            section(key, kNowhere);
            break;
        case CommandKind::Environment:
            if (stage_.environment) {
                section(key, kNowhere);
            } else {
                out_.add_null(key);
            }
            break;
        }
        if (!command.before.empty()) out_.add_text(command.before, "before");
        out_.close();
        return out_.line();
    }

private:
    // The old object's keys in its order, then those of `keys` that it lacked.
    Members members(JsonIndex object, const std::vector<std::string_view>& keys) const {
        Members list;
        if (object != kNowhere)
            for (JsonIndex c = old_.first(object); c < old_.next(object); c = old_.next(c))
                list.emplace_back(old_.key(c), c);
        const size_t had = list.size();
        for (const std::string_view key : keys) {
            bool known = false;
            for (size_t i = 0; i < had && !known; ++i) known = list[i].first == key;
            if (!known) list.emplace_back(key, kNowhere);
        }
        return list;
    }
    Members members(JsonIndex object, const Table& table) const {
        std::vector<std::string_view> keys;
        for (const KeyRow& row : table.rows) keys.push_back(row.name);
        return members(object, keys);
    }
    void keep(std::string_view key, JsonIndex at) {
        if (at != kNowhere) out_.add_copy(old_, at, key);
    }

    void numbers(std::string_view key, JsonIndex at, const float* values, int count) {
        bool same = true;
        for (int k = 1; k < count; ++k) same = same && values[k] == values[0];
        if (count == 1 || (same && at != kNowhere && old_.is(at, JsonType::Number)))
            return out_.add_float(values[0], key);
        out_.open(JsonType::Array, key);
        for (int k = 0; k < count; ++k) out_.add_float(values[k]);
        out_.close();
    }
    void number_row(const KeyRow& row, JsonIndex at, const float* floats) {
        const float* v = floats + row.numbers.offset;
        const bool is_default =
            std::memcmp(v, row.numbers.defaults.data(), sizeof(float) * size_t(row.numbers.arity)) == 0;
        if (at != kNowhere || !is_default) numbers(row.name, at, v, row.numbers.arity);
    }
    void text(std::string_view key, JsonIndex at, std::string_view value, std::string_view fallback) {
        if (at != kNowhere || value != fallback) out_.add_text(value, key);
    }
    void flag(std::string_view key, JsonIndex at, bool value) {
        if (at != kNowhere || value) out_.add_bool(value, key);
    }

    void section(std::string_view key, JsonIndex stood) {
        const JsonIndex at = plain_ ? kNowhere : stood;
        if (key == "format") return out_.add_number(1, key);
        if (key == "description") {
            if (!scene_.description.empty() || at != kNowhere) out_.add_text(scene_.description, key);
        } else if (key == "field") {
            field(at);
        } else if (key == "materials") {
            named(key, at, scene_.materials, [&](const Material& m, JsonIndex was) { material(m, was); });
        } else if (key == "objects") {
            objects(at);
        } else if (key == "edits") {
            edits(at);
        } else if (key == "lights") {
            lights(at);
        } else if (key == "environment") {
            environment(at);
        } else if (key == "cameras") {
            named(key, at, stage_.cameras, [&](const Camera& c, JsonIndex was) { camera(c, was); });
        } else if (key == "meshes") {
            listed(key, at, scene_.meshes, kMeshTable, [&](auto&... of) { mesh_key(of...); });
        } else if (key == "bodies") {
            listed(key, at, scene_.bodies, kBodyTable, [&](auto&... of) { body_key(of...); });
        } else if (key == "characters") {
            listed(key, at, scene_.characters, kCharacterTable, [&](auto&... of) { character_key(of...); });
        } else {
            keep(key, stood);
        }
    }

    void material(const Material& m, JsonIndex was) {
        for (const auto& [k, w] : members(was, kMaterialTable))
            number_row(*find_row(kMaterialTable, k), w, &m.base_color.x);
    }

    void field(JsonIndex at) {
        const FieldSettings& f = stage_.field;
        if (!whole_ && at == kNowhere && f.voxel_size <= 0 && f.cells == 64 && f.levels == 1 && !f.bounds &&
            !f.distance_8bit)
            return;
        out_.open(JsonType::Object, "field");
        for (const auto& [key, was] : members(at, kFieldTable)) {
            if (key == "voxel_size" && f.voxel_size > 0) out_.add_float(f.voxel_size, key);
            if (key == "levels" && (was != kNowhere || f.levels != 1)) out_.add_number(f.levels, key);
            if (key == "cells" && (was != kNowhere || f.cells != 64)) out_.add_number(f.cells, key);
            if (key == "distance_8bit") flag(key, was, f.distance_8bit);
            if (key == "bounds" && f.bounds) {
                out_.open(JsonType::Object, key);
                for (const auto& [k, w] : members(was, kBoundsTable))
                    numbers(k, kNowhere, k == "min" ? &f.bounds->min.x : &f.bounds->max.x, 3);
                out_.close();
            }
        }
        out_.close();
    }

    // A map section: old names keep their place, new ones follow in their order.
    template <typename T, typename WriteOne>
    void named(std::string_view key, JsonIndex at, const std::vector<std::pair<std::string, T>>& items,
               WriteOne write) {
        if (!whole_ && at == kNowhere && items.empty()) return;
        out_.open(JsonType::Object, key);
        std::unordered_map<std::string_view, const T*> by_name;
        std::vector<std::string_view> names;
        for (const auto& [name, item] : items) {
            by_name.emplace(name, &item);
            names.push_back(name);
        }
        std::unordered_map<std::string_view, JsonIndex> had;
        if (at != kNowhere)
            for (JsonIndex c = old_.first(at); c < old_.next(at); c = old_.next(c)) had.emplace(old_.key(c), c);
        for (const std::string_view name : names) {
            const auto was = had.find(name);
            out_.open(JsonType::Object, name);
            write(*by_name[name], was == had.end() ? kNowhere : was->second);
            out_.close();
        }
        out_.close();
    }

    void camera(const Camera& c, JsonIndex was) {
        for (const auto& [k, w] : members(was, kCameraTable)) {
            if (k == "tone_map") {
                text(k, w, kToneMapNames[size_t(c.tone_map)], "aces");
            } else if (k == "bloom_kind") {
                text(k, w, kBloomKindNames[size_t(c.bloom_kind)], "pyramid");
            } else if (k == "auto_exposure") {
                flag(k, w, c.auto_exposure);
            } else {
                number_row(*find_row(kCameraTable, k), w, &c.position.x);
            }
        }
    }

    void lights(JsonIndex at) {
        if (!whole_ && at == kNowhere && stage_.lights.empty()) return;
        out_.open(JsonType::Array, "lights");
        JsonIndex was = at == kNowhere ? kNowhere : old_.first(at);
        for (const Light& light : stage_.lights) {
            const bool known = was != kNowhere && was < old_.next(at);
            out_.open(JsonType::Object);
            const auto bit = uint8_t(1u << int(light.kind));
            for (const auto& [k, w] : members(known ? was : kNowhere, kLightTable)) {
                const KeyRow& row = *find_row(kLightTable, k);
                if (!(row.kinds & bit)) continue;
                if (k == "type") {
                    out_.add_text(kLightNames[size_t(light.kind)], k);
                } else if (k == "direction" && light.kind == Light::Kind::Spot) {
                    numbers(k, w, &light.direction.x, 3);  // its default is not the table's
                } else {
                    number_row(row, w, reinterpret_cast<const float*>(&light));
                }
            }
            out_.close();
            if (known) was = old_.next(was);
        }
        out_.close();
    }

    // A section of things with ids, each with the keys of its table.
    template <typename T, typename WriteKey>
    void listed(std::string_view section, JsonIndex at, const std::vector<T>& items, const Table& table,
                WriteKey write) {
        if (!whole_ && at == kNowhere && items.empty()) return;
        out_.open(JsonType::Array, section);
        for (const T& item : items) {
            out_.open(JsonType::Object);
            for (const auto& [key, was] : members(plain_ ? kNowhere : item.place, table)) {
                const KeyRow& row = *find_row(table, key);
                if (key == "id") {
                    out_.add_text(item.id, key);
                } else {
                    write(item, row, was);
                }
            }
            out_.close();
        }
        out_.close();
    }
    void list_of_names(std::string_view key, const std::vector<std::string>& names) {
        out_.open(JsonType::Array, key);
        for (const std::string& name : names) out_.add_text(name);
        out_.close();
    }
    void outline(JsonIndex at, const std::optional<Outline>& outline) {
        if (!outline) return;
        out_.open(JsonType::Object, "outline");
        for (const auto& [k, w] : members(at, kOutlineTable))
            number_row(*find_row(kOutlineTable, k), w, &outline->color.x);
        out_.close();
    }

    void mesh_key(const SceneMesh& mesh, const KeyRow& row, JsonIndex was) {
        const std::string_view key = row.name;
        const Transform& t = mesh.transform;
        const auto put = [&](const float* v, int count, bool is_default) {
            if (was != kNowhere || !is_default) numbers(key, was, v, count);
        };
        if (key == "file") out_.add_text(mesh.file, key);
        if (key == "position") put(&t.position.x, 3, t.position == vec3{});
        if (key == "rotation") put(&t.rotation.x, 4, t.rotation == quat{});
        if (key == "scale") put(&t.scale.x, 3, t.scale == vec3{1, 1, 1});
        if (key == "material") text(key, was, mesh.material, "");
        if (key == "hidden") flag(key, was, mesh.hidden);
        if (key == "group") text(key, was, mesh.group, "");
        if (key == "outline") outline(was, mesh.outline);
    }

    void body_key(const SceneBody& body, const KeyRow& row, JsonIndex was) {
        const std::string_view key = row.name;
        if (row.type == KeyType::Numbers) number_row(row, was, &body.numbers.density);
        if (key == "edits" && body.mesh.empty()) list_of_names(key, body.edits);
        if (key == "mesh" && !body.mesh.empty()) out_.add_text(body.mesh, key);
        if (key == "collision" && !body.collision.empty()) out_.add_text(body.collision, key);
        if (key == "motion") text(key, was, kMotionNames[size_t(body.motion)], "dynamic");
        if (key == "continuous") flag(key, was, body.continuous);
        if (key == "surface") text(key, was, body.of_materials ? "materials" : "own", "own");
        if (key == "settles") flag(key, was, body.settles);
    }

    void character_key(const SceneCharacter& character, const KeyRow& row, JsonIndex was) {
        if (row.type == KeyType::Numbers) number_row(row, was, &character.numbers.position.x);
        if (row.name != "path" || (was == kNowhere && character.path.empty())) return;
        out_.open(JsonType::Array, row.name);
        JsonIndex stood = was == kNowhere ? kNowhere : old_.first(was);
        for (const SceneCharacter::Wish& wish : character.path) {
            const bool known = stood != kNowhere && stood < old_.next(was);
            out_.open(JsonType::Object);
            for (const auto& [k, w] : members(known ? stood : kNowhere, kWishTable)) {
                const KeyRow& number = *find_row(kWishTable, k);
                // Its time is always said.
                if (number.required)
                    out_.add_float(*(&wish.time + number.numbers.offset), k);
                else
                    number_row(number, w, &wish.time);
            }
            out_.close();
            if (known) stood = old_.next(stood);
        }
        out_.close();
    }

    void environment(JsonIndex at) {
        if (!stage_.environment) return;
        out_.open(JsonType::Object, "environment");
        for (const auto& [k, w] : members(at, kEnvironmentTable)) {
            if (k == "file") {
                if (!stage_.environment->file.empty()) out_.add_text(stage_.environment->file, k);
            } else {
                number_row(*find_row(kEnvironmentTable, k), w, &stage_.environment->color.x);
            }
        }
        out_.close();
    }

    static bool is_formula(const Node& node) {
        return node.kind == Node::Kind::Shape && sdf::shape_rows()[node.shape.kind].how == sdf::KindRow::Formula;
    }

    // Keys of an edit (edit given) or of a tree node.
    Members node_members(const Node& node, const Edit* edit, JsonIndex at) const {
        std::vector<std::string_view> keys;
        if (edit) keys.push_back("id");
        keys.push_back(node.kind == Node::Kind::Shape ? "shape" : "object");
        if (node.kind == Node::Kind::Fold) keys.back() = "op";
        if (node.kind == Node::Kind::Shape) {
            for (const sdf::FieldRow& f : sdf::shape_rows()[node.shape.kind].fields()) keys.push_back(f.name);
            keys.push_back("file");
            if (is_formula(node)) keys.push_back("expression");
        }
        for (const char* key :
             {"op", "blend_radius", "material_blend_radius", "position", "rotation", "scale", "domain", "material"})
            if (keys.back() != key) keys.push_back(key);
        if (edit) {
            for (const char* key : {"dynamic", "hidden", "group", "outline"}) keys.push_back(key);
        }
        if (node.kind == Node::Kind::Fold) keys.push_back("children");
        return members(at, keys);
    }

    void domain(std::string_view key, JsonIndex at, const std::vector<Warp>& warps) {
        if (warps.empty() && at == kNowhere) return;
        out_.open(JsonType::Array, key);
        JsonIndex was = at == kNowhere ? kNowhere : old_.first(at);
        for (const Warp& warp : warps) {
            const sdf::KindRow& row = sdf::warp_rows()[warp.kind];
            const bool known = was != kNowhere && was < old_.next(at) && old_.find(was, "warp") &&
                               old_.text(*old_.find(was, "warp")) == row.name;
            std::vector<std::string_view> keys{"warp"};
            for (const sdf::FieldRow& f : row.fields()) keys.push_back(f.name);
            out_.open(JsonType::Object);
            for (const auto& [k, w] : members(known ? was : kNowhere, keys)) {
                if (k == "warp") {
                    out_.add_text(row.name, k);
                } else {
                    parameter(k, w, row, warp.params.data());
                }
            }
            out_.close();
            if (was != kNowhere && was < old_.next(at)) was = old_.next(was);
        }
        out_.close();
    }

    void parameter(std::string_view key, JsonIndex at, const sdf::KindRow& row, const float* params) {
        for (const sdf::FieldRow& f : row.fields()) {
            if (f.name != key || f.range == "internal") continue;
            if (f.range == "axis") return out_.add_text(kAxisNames[size_t(params[f.offset])], key);
            if (f.range == "flag") return out_.add_bool(params[f.offset] != 0, key);
            return numbers(key, at, params + f.offset, f.arity);
        }
    }

    void node_key(std::string_view key, JsonIndex at, const Node& node, const Edit* edit) {
        const bool folds = edit || node.kind == Node::Kind::Fold;
        const Transform& t = node.transform;
        const auto put = [&](const float* v, int count, bool is_default) {
            if (at != kNowhere || !is_default) numbers(key, at, v, count);
        };
        if (key == "id") return out_.add_text(edit->name, key);
        if (key == "shape" && node.kind == Node::Kind::Shape)
            return out_.add_text(sdf::shape_rows()[node.shape.kind].name, key);
        if (key == "object" && node.kind == Node::Kind::Object)
            return out_.add_text(scene_.objects[node.object.index].name, key);
        if (is_formula(node) && (key == "file" || key == "expression")) {
            const bool file = node.shape.data.starts_with(sdf::kModelFile);
            if (file != (key == "file")) return;
            return out_.add_text(std::string_view(node.shape.data).substr(file ? sdf::kModelFile.size() : 0), key);
        }
        if (key == "file" && node.kind == Node::Kind::Shape && !node.shape.data.empty())
            return out_.add_text(node.shape.data, key);
        if (key == "op" && folds) return text(key, at, kOpNames[size_t(edit ? edit->op : node.op)], "union");
        if (key == "blend_radius" && folds) {
            const float k = edit ? edit->blend_radius : node.blend_radius;
            return put(&k, 1, k == 0);
        }
        if (key == "material_blend_radius" && folds) {
            const float k = edit ? edit->material_blend_radius : node.material_blend_radius;
            return k < 0 ? void() : numbers(key, at, &k, 1);  // negative: linked to blend_radius
        }
        if (key == "position") return put(&t.position.x, 3, t.position == vec3{});
        if (key == "rotation") return put(&t.rotation.x, 4, t.rotation == quat{});
        if (key == "scale") return put(&t.scale.x, 3, t.scale == vec3{1, 1, 1});
        if (key == "domain") return domain(key, at, node.domain);
        if (key == "material")
            return node.material ? out_.add_text(scene_.materials[node.material.index].first, key) : void();
        if (edit && key == "dynamic") return flag(key, at, edit->dynamic);
        if (edit && key == "hidden") return flag(key, at, edit->hidden);
        if (edit && key == "group") return text(key, at, edit->group, "");
        if (edit && key == "outline") return outline(at, edit->outline);
        if (node.kind == Node::Kind::Shape)
            parameter(key, at, sdf::shape_rows()[node.shape.kind], node.shape.params.data());
    }

    // Trees may be deeper than a stack of calls.
    void tree(const Object& object, const std::vector<JsonIndex>& places) {
        struct Open {
            uint32_t node;
            Members keys;
            size_t at = 0, child = 0;
            bool in_children = false;
        };
        const auto place = [&](uint32_t n) { return n < places.size() ? places[n] : kNowhere; };
        std::vector<Open> stack;
        const auto enter = [&](uint32_t n, std::string_view key) {
            out_.open(JsonType::Object, key);
            stack.push_back({n, node_members(object.nodes[n], nullptr, place(n))});
        };
        enter(0, object.name);
        while (!stack.empty()) {
            Open& top = stack.back();
            const Node& node = object.nodes[top.node];
            if (top.in_children) {
                if (top.child < node.children.size()) {
                    enter(node.children[top.child++], {});
                    continue;
                }
                out_.close();
                top.in_children = false;
                ++top.at;
            } else if (top.at == top.keys.size()) {
                out_.close();
                stack.pop_back();
            } else if (top.keys[top.at].first == "children" && node.kind == Node::Kind::Fold) {
                out_.open(JsonType::Array, "children");
                top.in_children = true;
            } else {
                node_key(top.keys[top.at].first, top.keys[top.at].second, node, nullptr);
                ++top.at;
            }
        }
    }

    void objects(JsonIndex at) {
        if (at == kNowhere && scene_.objects.empty()) return;
        static const std::vector<JsonIndex> kNone;
        out_.open(JsonType::Object, "objects");
        for (size_t i = 0; i < scene_.objects.size(); ++i)
            tree(scene_.objects[i], !plain_ && i < scene_.object_places.size() ? scene_.object_places[i] : kNone);
        out_.close();
    }

    void edits(JsonIndex at) {
        if (at == kNowhere && edits_.empty()) return;
        out_.open(JsonType::Array, "edits");
        for (const PlacedEdit& placed : edits_) edit({}, *placed.edit, placed.place);
        out_.close();
    }

    void edit(std::string_view as, const Edit& edit, JsonIndex was) {
        out_.open(JsonType::Object, as);
        for (const auto& [key, w] : node_members(edit.node, &edit, was)) node_key(key, w, edit.node, &edit);
        out_.close();
    }

    const SceneData& scene_;
    const SceneData::Stage& stage_;
    const JsonDocument& old_;
    std::span<const PlacedEdit> edits_;
    bool whole_ = false;  // sections are written even where they say nothing
    bool plain_ = false;  // as if there were no old one
    JsonDocument out_;
};

}  // namespace

std::string write_scene(const SceneData& scene, const SceneData::Stage& stage, std::span<const PlacedEdit> edits) {
    return SceneWriter(scene, stage, scene.source, edits).run().print();
}

std::string write_scene(const SceneData& scene, const SceneData::Stage& stage) {
    std::vector<PlacedEdit> edits;
    for (size_t i = 0; i < scene.edits.size(); ++i)
        edits.push_back({&scene.edits[i], i < scene.edit_places.size() ? scene.edit_places[i] : kNowhere});
    return write_scene(scene, stage, edits);
}

JsonDocument plain_document(const SceneData& scene, const SceneData::Stage& stage, std::span<const PlacedEdit> edits) {
    return SceneWriter(scene, stage, scene.source, edits).run(true);
}

std::string write_command(const SceneData& scene, const SceneData::Stage& stage, const CommandView& command) {
    static const JsonDocument kNothing;
    return SceneWriter(scene, stage, kNothing, {}).run(command);
}

}  // namespace kiln::scene
