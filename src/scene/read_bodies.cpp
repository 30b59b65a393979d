// SPDX-License-Identifier: MIT

#include "scene/read_bodies.h"

#include "base/format.h"
#include "model/triangles.h"
#include "physics/physics.h"

#include <algorithm>
#include <utility>

namespace kiln::scene {

namespace {

template <typename Map>
std::vector<std::string_view> known(const Map& map) {
    std::vector<std::string_view> names;
    for (const auto& [name, n] : map) names.push_back(name);
    std::sort(names.begin(), names.end());
    return names;
}

// The ground is a body too.
bool room_for(ValueReader& in, JsonIndex at, size_t count) {
    if (count < physics::World::kMostBodies) return true;
    return in.fail(at, formatted("{} bodies and characters; there is room for {}, leave some out", count,
                                 physics::World::kMostBodies - 1));
}

bool read_mesh(ValueReader& in, JsonIndex at, const BodyNames& names, SceneMesh& out) {
    const JsonDocument& doc = in.doc;
    out.place = at;
    out.id = doc.text(*doc.find(at, "id"));
    const JsonIndex file = *doc.find(at, "file");
    out.file = doc.text(file);
    if (out.file.empty())
        return in.fail(file, formatted("an empty file name; name a model, ending in {}", model::kModelEndings));
    if (const auto m = doc.find(at, "material")) {
        if (!names.materials.contains(doc.text(*m))) return in.unknown_name(*m, "material", known(names.materials));
        out.material = doc.text(*m);
    }
    Transform& t = out.transform;
    if (const auto v = doc.find(at, "position"))
        if (!in.numbers(*v, find_row(kMeshTable, "position")->numbers, &t.position.x)) return false;
    if (const auto v = doc.find(at, "rotation"); v && !in.rotation(*v, &t.rotation)) return false;
    if (const auto v = doc.find(at, "scale"); v && !in.scale(*v, &t.scale)) return false;
    if (const auto v = doc.find(at, "hidden")) out.hidden = doc.is(*v, JsonType::True);
    if (const auto v = doc.find(at, "group")) out.group = doc.text(*v);
    if (const auto v = doc.find(at, "outline")) return in.table(*v, kOutlineTable, &out.outline.emplace().color.x);
    return true;
}

using Owners = std::unordered_map<std::string_view, std::string_view>;  // bodies by edit

bool read_body(ValueReader& in, JsonIndex at, const BodyNames& names, Owners& owners, SceneBody& out) {
    const JsonDocument& doc = in.doc;
    const auto edits = doc.find(at, "edits"), mesh = doc.find(at, "mesh");
    if (bool(edits) == bool(mesh)) return in.fail(at, "a body has either \"edits\" or a \"mesh\"; give it one of them");
    if (mesh && !names.meshes.contains(doc.text(*mesh))) return in.unknown_name(*mesh, "mesh", known(names.meshes));
    const JsonIndex id = *doc.find(at, "id");
    out.id = doc.text(id);
    out.place = at;
    // Events tell of both.
    if (names.characters.contains(out.id)) return in.fail(id, "a character has this id too; choose another");
    if (!in.table(at, kBodyTable, &out.numbers.density)) return false;
    if (const auto m = doc.find(at, "motion")) {
        int motion = 0;
        if (!in.choice(*m, kMotionNames, &motion)) return false;
        out.motion = SceneBody::Motion(motion);
    }
    if (mesh) out.mesh = doc.text(*mesh);
    if (const auto v = doc.find(at, "collision")) {
        out.collision = doc.text(*v);
        if (mesh && out.collision == "triangles" && out.motion != SceneBody::Motion::Static)
            return in.fail(*v, "\"triangles\" stand still; make the motion \"static\", or say \"convex\"");
    }
    if (const auto v = doc.find(at, "continuous")) out.continuous = doc.is(*v, JsonType::True);
    if (const auto v = doc.find(at, "surface")) out.of_materials = doc.text(*v) == "materials";
    if (const auto v = doc.find(at, "settles")) {
        out.settles = doc.is(*v, JsonType::True);
        if (out.settles && mesh)
            return in.fail(*v, "a mesh does not become ground; leave it out, or make the body of a mesh edit");
    }
    if (edits && doc.first(*edits) == doc.next(*edits)) return in.fail(*edits, "no edits; name at least one");
    for (JsonIndex e = edits ? doc.first(*edits) : 0; edits && e < doc.next(*edits); e = doc.next(e)) {
        if (!names.edit(doc.text(e))) {
            if (names.all_edits) return in.unknown_name(e, "edit", names.all_edits());
            return in.fail(e, formatted("there is no edit {}; name one that is there by now", doc.source(e)));
        }
        if (const auto [owner, fresh] = owners.emplace(doc.text(e), doc.text(id)); !fresh)
            return in.fail(e, formatted("the edit \"{}\" is body \"{}\" already; an edit belongs to one body, once",
                                        doc.text(e), owner->second));
        out.edits.emplace_back(doc.text(e));
    }
    return true;
}

bool read_character(ValueReader& in, JsonIndex at, const BodyNames& names, SceneCharacter& out) {
    const JsonDocument& doc = in.doc;
    const JsonIndex id = *doc.find(at, "id");
    out.id = doc.text(id);
    out.place = at;
    if (names.bodies.contains(out.id)) return in.fail(id, "a body has this id too; choose another");
    if (!in.table(at, kCharacterTable, &out.numbers.position.x)) return false;
    if (const auto h = doc.find(at, "height"); !(out.numbers.height > 2 * out.numbers.radius))
        return in.fail(h ? *h : at, formatted("a height of {} is not above twice the radius, {}; make one larger or "
                                              "the other smaller",
                                              shortest(out.numbers.height), shortest(2 * out.numbers.radius)));
    if (const auto path = doc.find(at, "path")) {
        for (JsonIndex c = doc.first(*path); c < doc.next(*path); c = doc.next(c)) {
            SceneCharacter::Wish wish;
            if (!in.table(c, kWishTable, &wish.time)) return false;
            if (!out.path.empty() && wish.time < out.path.back().time)
                return in.fail(*doc.find(c, "time"),
                               formatted("{} is before the wish above, {}; list wishes by ascending time",
                                         shortest(wish.time), shortest(out.path.back().time)));
            out.path.push_back(wish);
        }
    }
    return true;
}

}  // namespace

bool read_ids(ValueReader& in, JsonIndex at, Ids& out) {
    const JsonDocument& doc = in.doc;
    uint32_t n = 0;
    for (JsonIndex c = doc.first(at); c < doc.next(at); c = doc.next(c), ++n) {
        const JsonIndex id = *doc.find(c, "id");
        if (doc.text(id).empty()) return in.fail(id, "an empty id; give it a name");
        if (const auto [old, fresh] = out.emplace(doc.text(id), n); !fresh)
            return in.fail(
                id, formatted("{}[{}] has this id too; ids are unique, choose another", doc.key(at), old->second));
    }
    return true;
}

bool read_meshes(ValueReader& in, JsonIndex at, const BodyNames& names, std::vector<SceneMesh>& out) {
    const JsonDocument& doc = in.doc;
    for (JsonIndex c = doc.first(at); c < doc.next(at); c = doc.next(c))
        if (!read_mesh(in, c, names, out.emplace_back())) return false;
    return true;
}

bool read_bodies(ValueReader& in, JsonIndex at, const BodyNames& names, std::vector<SceneBody>& out) {
    const JsonDocument& doc = in.doc;
    if (!room_for(in, at, doc.count(at) + names.characters.size())) return false;
    Owners owners;
    for (JsonIndex c = doc.first(at); c < doc.next(at); c = doc.next(c))
        if (!read_body(in, c, names, owners, out.emplace_back())) return false;
    return true;
}

bool read_characters(ValueReader& in, JsonIndex at, const BodyNames& names, std::vector<SceneCharacter>& out) {
    const JsonDocument& doc = in.doc;
    if (!room_for(in, at, doc.count(at) + names.bodies.size())) return false;
    for (JsonIndex c = doc.first(at); c < doc.next(at); c = doc.next(c))
        if (!read_character(in, c, names, out.emplace_back())) return false;
    return true;
}

}  // namespace kiln::scene
