// SPDX-License-Identifier: MIT
// Reading commands. Writing them is in scene_writer.cpp, beside the scenes that they are parts of.

#include "scene/command.h"

#include "scene/read_bodies.h"
#include "scene/read_nodes.h"
#include "scene/read_values.h"

#include "base/format.h"

namespace kiln::scene {

namespace {

constexpr std::string_view kKeys[] = {"add",    "change",      "remove",  "reorder", "materials", "objects",   "field",
                                      "lights", "environment", "cameras", "meshes",  "bodies",    "characters"};

class CommandReader {
public:
    CommandReader(const JsonDocument& doc, const CommandNames& names)
        : doc_(doc), in_(doc), nodes_(in_, names.materials, names.objects), names_(names) {}

    Result<Command> run(JsonIndex at) {
        if (!command(at)) return std::move(*in_.error);
        return std::move(out_);
    }
    std::optional<Error> fault(JsonIndex at) {
        if (!kind_of(at, true)) return std::move(in_.error);
        return std::nullopt;
    }

private:
    // Which command, and its other keys. Where bodies run an edit may have a target (simulation_bodies.cpp), which no world sees.
    bool kind_of(JsonIndex at, bool of_play = false) {
        if (!doc_.is(at, JsonType::Object)) return in_.wrong_type(at, "a command such as {\"remove\": \"lump\"}");
        const JsonIndex what = doc_.first(at);
        if (what == doc_.next(at)) return in_.fail(at, "an empty command; write for example {\"remove\": \"lump\"}");
        // The first key says which, whatever else there is.
        size_t kind = 0;
        while (kind < std::size(kKeys) && doc_.key(what) != kKeys[kind]) ++kind;
        if (kind == std::size(kKeys)) return in_.unknown_key(what, kKeys);
        out_.kind = CommandKind(kind);
        const bool ordered = out_.kind == CommandKind::Add || out_.kind == CommandKind::Reorder;
        for (JsonIndex c = doc_.next(what); c < doc_.next(at); c = doc_.next(c)) {
            const bool names_edit =
                (ordered && doc_.key(c) == "before") || (out_.kind == CommandKind::Change && doc_.key(c) == "was");
            const bool target = doc_.key(c) == "target" && out_.kind == CommandKind::Add;
            if (target && !of_play)
                return in_.fail_at_key(c, "only edits that are added while bodies run have a target");
            if (!names_edit && !target) {
                return in_.fail_at_key(c, ordered ? formatted("unknown key; {} may have \"before\"", kKeys[kind])
                                          : out_.kind == CommandKind::Change ? "unknown key; change may have \"was\""
                                                                             : "unknown key; a command has one");
            }
        }
        return true;
    }

    bool command(JsonIndex at) {
        if (!kind_of(at)) return false;
        const JsonIndex what = doc_.first(at);
        if (const auto before = doc_.find(at, "before"); before && !known_edit(*before, out_.before)) return false;
        if (const auto was = doc_.find(at, "was"); was && !known_edit(*was, out_.id)) return false;
        switch (out_.kind) {
        case CommandKind::Add:
            out_.edit = std::make_unique<Edit>();
            return nodes_.edit(what, *out_.edit);
        case CommandKind::Change:
            return change(what);
        case CommandKind::Remove:
        case CommandKind::Reorder:
            return known_edit(what, out_.id);
        case CommandKind::Material:
        case CommandKind::Object:
            return named(what);
        case CommandKind::Field:
        case CommandKind::Lights:
        case CommandKind::Environment:
        case CommandKind::Cameras:
            break;
        case CommandKind::Meshes:
        case CommandKind::Bodies:
        case CommandKind::Characters:
            return bodies(what);
        }
        return doc_.is(what, JsonType::Null) && out_.kind == CommandKind::Environment ? true : section(at, what);
    }

    bool known_edit(JsonIndex at, std::string& out) {
        if (!in_.text(at, "lump", &out)) return false;
        if (names_.edit(out) != nullptr) return true;
        return in_.fail(at, formatted("there is no edit {}; name one that is there by now", doc_.source(at)));
    }

    // A whole edit, or some keys of one where neither shape nor object is said.
    bool change(JsonIndex at) {
        if (!doc_.is(at, JsonType::Object))
            return in_.wrong_type(at, "an edit such as {\"id\": \"lump\", \"position\": [0, 1, 0]}");
        if (out_.id.empty()) {
            const auto id = doc_.find(at, "id");
            if (!id) return in_.fail(at, "the key \"id\" is missing; say which edit changes");
            if (!known_edit(*id, out_.id)) return false;
        }
        const bool partly = !doc_.find(at, "shape") && !doc_.find(at, "object");
        out_.edit = partly ? std::make_unique<Edit>(*names_.edit(out_.id)) : std::make_unique<Edit>();
        return nodes_.edit(at, *out_.edit, partly);
    }

    // {NAME: one}, null: taken away.
    bool named(JsonIndex at) {
        const bool material = out_.kind == CommandKind::Material;
        if (!doc_.is(at, JsonType::Object) || doc_.count(at) != 1)
            return in_.fail(at, material ? "one material by its name, such as {\"clay\": {\"roughness\": 0.7}}"
                                         : "one object by its name, such as {\"washer\": {\"shape\": \"torus\"}}");
        const JsonIndex one = doc_.first(at);
        out_.id = doc_.key(one);
        if (out_.id.empty()) return in_.fail_at_key(one, "an empty name; give it a name");
        if (doc_.is(one, JsonType::Null)) return true;
        if (material) return in_.table(one, kMaterialTable, &out_.material.emplace().base_color.x);
        out_.object.emplace().name = out_.id;
        std::vector<JsonIndex> places;
        return nodes_.object_tree(one, *out_.object, places);
    }

    bool section(JsonIndex command, JsonIndex at) {
        SceneData part;
        if (auto fault = read_section(part, doc_, command, at)) {
            in_.error = std::move(*fault);
            return false;
        }
        out_.stage = std::move(part.stage);
        return true;
    }

    // What the world has beside its edits, as one of these sections is to have it now.
    bool bodies(JsonIndex at) {
        if (!in_.value(at, *find_row(kSceneTable, doc_.key(at)), nullptr)) return false;
        Ids own;
        if (!read_ids(in_, at, own)) return false;
        const auto ids_of = [](const auto& list) {
            Ids out;
            for (uint32_t i = 0; i < list.size(); ++i) out.emplace(list[i].id, i);
            return out;
        };
        const SceneData& scene = *names_.scene;
        const BodyNames names{names_.materials,
                              [&](std::string_view name) { return names_.edit(name) != nullptr; },
                              {},
                              ids_of(scene.meshes),
                              ids_of(scene.bodies),
                              ids_of(scene.characters)};
        if (out_.kind == CommandKind::Characters) return read_characters(in_, at, names, out_.characters);
        if (out_.kind == CommandKind::Bodies) return read_bodies(in_, at, names, out_.bodies);
        for (const SceneBody& body : scene.bodies)
            if (!body.mesh.empty() && !own.contains(body.mesh))
                return in_.fail(at,
                                formatted("the mesh \"{}\" is body \"{}\"; take that away first", body.mesh, body.id));
        return read_meshes(in_, at, names, out_.meshes);
    }

    const JsonDocument& doc_;
    ValueReader in_;
    NodeReader nodes_;
    const CommandNames& names_;
    Command out_;
};

}  // namespace

std::string_view command_key(CommandKind kind) { return kKeys[size_t(kind)]; }

Result<Command> read_command(const JsonDocument& doc, JsonIndex at, const CommandNames& names) {
    return CommandReader(doc, names).run(at);
}

std::optional<Error> command_fault(const JsonDocument& doc, JsonIndex at) {
    static const NameNumbers kNone;
    const CommandNames names{kNone, kNone, {}};
    return CommandReader(doc, names).fault(at);
}

Result<Command> read_command(std::string text, const std::string& name, const CommandNames& names) {
    const auto doc = JsonDocument::parse(std::move(text), name);
    if (!doc) return doc.error();
    return read_command(*doc, 0, names);
}

}  // namespace kiln::scene
