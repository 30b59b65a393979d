// SPDX-License-Identifier: MIT
// Reads a scene's sections in the order their references need, and checks references between them.

#include "scene/scene_file.h"

#include "scene/format.h"
#include "scene/read_bodies.h"
#include "scene/read_nodes.h"
#include "scene/read_values.h"

#include "base/format.h"
#include "field/level_cells.gpu.h"

#include <bit>
#include <cmath>
#include <unordered_map>
#include <unordered_set>

namespace kiln::scene {

namespace {

class SceneReader {
public:
    SceneReader(SceneData& scene, const JsonDocument& doc, JsonIndex root)
        : scene_(scene), doc_(doc), root_(root), in_(doc), nodes_(in_, scene.material_numbers, scene.object_numbers) {}

    std::optional<Error> run() {
        if (!sections()) return std::move(in_.error);
        return std::nullopt;
    }

    std::optional<Error> run_section(JsonIndex at) {
        const std::string_view key = doc_.key(at);
        const KeyRow* const row = find_row(kSceneTable, key);
        const bool good = row != nullptr && in_.value(at, *row, nullptr) &&
                          (key == "field"         ? field()
                           : key == "lights"      ? lights()
                           : key == "environment" ? environment()
                                                  : cameras());
        if (!good) return std::move(in_.error);
        return std::nullopt;
    }

private:
    std::optional<JsonIndex> section(std::string_view key) const { return doc_.find(root_, key); }

    void number(JsonIndex section, NameNumbers& names) const {
        uint32_t n = 0;
        for (JsonIndex c = doc_.first(section); c < doc_.next(section); c = doc_.next(c))
            names.emplace(doc_.key(c), n++);
    }

    bool sections() {
        if (!doc_.is(0, JsonType::Object)) return in_.wrong_type(0, "an object, at least {\"format\": 1}");
        // The version first: a file of a later one must not fail at its new keys.
        if (const auto f = section("format"); f && doc_.is(*f, JsonType::Number) && doc_.number(*f) > 1)
            return in_.fail(
                *f, formatted("format {} is newer than this version reads; it reads format 1", doc_.source(*f)));
        if (!in_.table(0, kSceneTable)) return false;
        if (const auto d = section("description")) scene_.description = doc_.text(*d);
        return field() && materials() && objects_and_edits() && lights() && environment() && cameras() &&
               later_sections();
    }

    bool field() {
        const auto at = section("field");
        if (!at) return true;
        FieldSettings& f = scene_.stage.field;
        if (!in_.table(*at, kFieldTable, &f.voxel_size)) return false;
        if (const auto v = doc_.find(*at, "levels")) f.levels = int(doc_.number(*v));
        if (const auto v = doc_.find(*at, "cells")) {
            f.cells = int(doc_.number(*v));
            if (!std::has_single_bit(uint32_t(f.cells)))
                return in_.fail(
                    *v, formatted("{} is not a power of two; use {}", f.cells, std::bit_floor(uint32_t(f.cells))));
            if (f.levels > 1 && (f.cells < field::kFewestLevelCells || f.cells > field::kMostLevelCells))
                return in_.fail(*v, formatted("{} cells a side; several levels have {} to {} each", f.cells,
                                              field::kFewestLevelCells, field::kMostLevelCells));
        }
        if (const auto v = doc_.find(*at, "distance_8bit")) f.distance_8bit = doc_.is(*v, JsonType::True);
        if (const auto v = doc_.find(*at, "bounds")) {
            Box3 box;
            const JsonIndex low = *doc_.find(*v, "min"), high = *doc_.find(*v, "max");
            (void)in_.numbers(low, kBoundsTable.rows[0].numbers, &box.min.x);
            (void)in_.numbers(high, kBoundsTable.rows[1].numbers, &box.max.x);
            f.bounds = box;
        }
        return true;
    }

    bool materials() {
        const auto at = section("materials");
        if (!at) return true;
        for (JsonIndex c = doc_.first(*at); c < doc_.next(*at); c = doc_.next(c)) {
            Material m;
            if (!in_.table(c, kMaterialTable, &m.base_color.x)) return false;
            scene_.materials.emplace_back(doc_.key(c), m);
            scene_.silent.push_back(
                {!doc_.find(c, "friction"), !doc_.find(c, "restitution"), !doc_.find(c, "rolling_friction")});
        }
        if (scene_.materials.size() > 60000)
            return in_.fail(*at, formatted("{} materials; at most 60000", scene_.materials.size()));
        number(*at, scene_.material_numbers);
        return true;
    }

    bool objects_and_edits() {
        if (const auto at = section("objects")) {
            number(*at, scene_.object_numbers);
            if (!nodes_.objects(*at, scene_)) return false;
        }
        if (const auto at = section("edits"); at && !nodes_.edits(*at, scene_)) return false;
        return true;
    }

    bool lights() {
        const auto at = section("lights");
        if (!at) return true;
        for (JsonIndex c = doc_.first(*at); c < doc_.next(*at); c = doc_.next(c)) {
            Light light;
            int kind = 0;
            if (!in_.choice(*doc_.find(c, "type"), kLightNames, &kind)) return false;
            light.kind = Light::Kind(kind);
            if (light.kind == Light::Kind::Spot) light.direction = {0, -1, 0};
            if (!in_.table(c, kLightTable, reinterpret_cast<float*>(&light), uint8_t(1u << kind),
                           kLightNames[size_t(kind)]))
                return false;
            if (const auto d = doc_.find(c, "direction"); d && !(length(light.direction) > 1e-6f))
                return in_.fail(*d, "a direction of length 0; write where the light goes, such as [0, -1, 0]");
            if (light.kind == Light::Kind::Spot && light.inner_deg > light.outer_deg)
                return in_.fail(c, formatted("inner_deg {} is above outer_deg {}; it must not be",
                                             shortest(light.inner_deg), shortest(light.outer_deg)));
            scene_.stage.lights.push_back(light);
        }
        return true;
    }

    bool environment() {
        const auto at = section("environment");
        if (!at) return true;
        Environment e;
        if (!in_.table(*at, kEnvironmentTable, &e.color.x)) return false;
        if (const auto file = doc_.find(*at, "file")) {
            e.file = doc_.text(*file);
            if (e.file.empty())
                return in_.fail(*file, "an empty file name; name an OpenEXR image, or leave the key out");
        }
        scene_.stage.environment = e;
        return true;
    }

    bool cameras() {
        const auto at = section("cameras");
        if (!at) return true;
        for (JsonIndex c = doc_.first(*at); c < doc_.next(*at); c = doc_.next(c)) {
            Camera camera;
            if (!in_.table(c, kCameraTable, &camera.position.x)) return false;
            if (const auto t = doc_.find(c, "tone_map")) {
                int map = 0;
                if (!in_.choice(*t, kToneMapNames, &map)) return false;
                camera.tone_map = ToneMap(map);
            }
            if (const auto k = doc_.find(c, "bloom_kind")) {
                int kind = 0;
                if (!in_.choice(*k, kBloomKindNames, &kind)) return false;
                camera.bloom_kind = BloomKind(kind);
            }
            if (const auto a = doc_.find(c, "auto_exposure"); a && !in_.boolean(*a, &camera.auto_exposure))
                return false;
            const vec3 forward = camera.target - camera.position;
            if (!(length(forward) > 0)) return in_.fail(c, "position and target are the same point; move one of them");
            if (const auto u = doc_.find(c, "up"); u && !(length(camera.up) > 1e-6f))
                return in_.fail(*u, "an up of length 0; write [0, 1, 0]");
            scene_.stage.cameras.emplace_back(doc_.key(c), camera);
        }
        return true;
    }

    bool ids(std::string_view list, Ids& out) {
        const auto at = section(list);
        if (!at) return true;
        // Bodies show their edits.
        const bool drawn = list == "meshes" || list == "bodies";
        if (!drawn && doc_.first(*at) != doc_.next(*at)) scene_.undrawn.emplace_back(list);
        return read_ids(in_, *at, out);
    }

    bool later_sections() {
        Ids edit_ids, triggers, cloths, fluids, object_names;
        for (uint32_t i = 0; i < scene_.edits.size(); ++i) edit_ids.emplace(scene_.edits[i].name, i);
        const auto known = [](const Ids& map) {
            std::vector<std::string_view> names;
            for (const auto& [name, n] : map) names.push_back(name);
            std::sort(names.begin(), names.end());
            return names;
        };
        BodyNames names{scene_.material_numbers,
                        [&](std::string_view name) { return edit_ids.contains(name); },
                        [&] { return known(edit_ids); },
                        {},
                        {},
                        {}};
        Ids characters;  // of which bodies are not asked: what is read later is at fault
        if (!ids("meshes", names.meshes) || !ids("bodies", names.bodies) || !ids("triggers", triggers) ||
            !ids("characters", characters) || !ids("cloths", cloths) || !ids("fluids", fluids))
            return false;
        if (const auto at = section("meshes"); at && !read_meshes(in_, *at, names, scene_.meshes)) return false;
        if (const auto at = section("physics"); at && !in_.table(*at, kPhysicsTable, &scene_.physics.gravity.x))
            return false;
        if (const auto at = section("bodies"); at && !read_bodies(in_, *at, names, scene_.bodies)) return false;
        if (const auto at = section("triggers")) {
            for (uint32_t i = 0; i < scene_.objects.size(); ++i) object_names.emplace(scene_.objects[i].name, i);
            for (JsonIndex c = doc_.first(*at); c < doc_.next(*at); c = doc_.next(c)) {
                const JsonIndex o = *doc_.find(c, "object");
                const auto object = object_names.find(doc_.text(o));
                if (object == object_names.end()) return in_.unknown_name(o, "object", known(object_names));
                SceneTrigger trigger{std::string(doc_.text(*doc_.find(c, "id"))), {object->second, 0}, {}, c};
                if (!in_.table(c, kTriggerTable, &trigger.transform.position.x)) return false;
                if (const auto r = doc_.find(c, "rotation"); r && !in_.rotation(*r, &trigger.transform.rotation))
                    return false;
                if (const auto s = doc_.find(c, "scale"); s && !in_.scale(*s, &trigger.transform.scale)) return false;
                scene_.triggers.push_back(std::move(trigger));
            }
        }
        const auto at = section("characters");
        return !at || read_characters(in_, *at, names, scene_.characters);
    }

    SceneData& scene_;
    const JsonDocument& doc_;
    JsonIndex root_;
    ValueReader in_;
    NodeReader nodes_;
};

}  // namespace

Result<SceneData> read_scene(std::string text, const std::string& name) {
    auto document = JsonDocument::parse(std::move(text), name);
    if (!document) return document.error();
    SceneData scene;
    scene.source = std::move(*document);
    if (const size_t slash = name.find_last_of('/'); slash != std::string::npos)
        scene.folder = name.substr(0, slash + 1);
    if (auto error = SceneReader(scene, scene.source, 0).run()) return std::move(*error);
    return scene;
}

std::optional<Error> read_section(SceneData& scene, const JsonDocument& doc, JsonIndex object, JsonIndex section) {
    return SceneReader(scene, doc, object).run_section(section);
}

}  // namespace kiln::scene
