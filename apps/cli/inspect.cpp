// SPDX-License-Identifier: MIT
// kiln inspect SCENE: what is in a scene. kiln validate SCENE: whether it is right. kiln schema: what a right one looks like.

#include "cli/json.h"
#include "cli/scene.h"
#include "cli/talk.h"
#include "cli/verbs.h"

#include <kiln/world.h>

#include <memory>

namespace kiln::cli {

namespace {

struct InspectOptions {
    std::string scene;
    bool json = false, history = false;
};

// The facts without JSON's brackets and quotes.
std::string for_people(const std::string& json) {
    std::string out, line;
    for (const char c : json) {
        if (c != '\n') {
            if (c != '"') line += c;
            continue;
        }
        while (!line.empty() && (line.back() == ',' || line.back() == '{' || line.back() == '[')) line.pop_back();
        const size_t first = line.find_first_not_of(" }]");
        if (first != std::string::npos) out += line.substr(std::min<size_t>(2, first)) + "\n";
        line.clear();
    }
    return out;
}

// A line a step: where the world is, what is undone, and after which step each was made where that is not the one above.
std::string history_for_people(World& world) {
    const History history = world.history();
    std::string out;
    if (const auto report = world.journal_report()) out = "journal " + report->sentence() + "\n";
    if (history.steps().empty()) return out + "no steps: the scene file holds all\n";
    for (const HistoryStep& step : history.steps()) {
        out += step.number == history.now() ? "> " : "  ";
        out += std::to_string(step.number) + "  " + step.title;
        if (step.changes > 1) out += " (" + std::to_string(step.changes) + " changes)";
        if (step.parent + 1 != step.number) out += "  after " + std::to_string(step.parent);
        out += step.done ? "\n" : "  undone\n";
    }
    return out;
}

int inspect(const InspectOptions& o) {
    auto world = o.history ? World::load(o.scene, 0, true) : load_scene(o.scene);
    if (!world) return fail(world.error());
    if (o.history) {
        (void)put(o.json ? world->history_json() : history_for_people(*world));
        return finish_data();
    }
    const std::string facts = world->inspect_json();
    (void)put(o.json ? facts : for_people(facts));
    return finish_data();
}

int validate(const InspectOptions& o) {
    auto world = load_scene(o.scene);
    if (world && !world->faults().empty()) {
        std::string all;
        for (const std::string& fault : world->faults()) all += (all.empty() ? "" : "\n") + fault;
        world = Error{all, ErrorKind::Input};
    }
    if (o.json) {
        Json json;
        json.text("scene", o.scene).flag("valid", bool(world));
        if (world) {
            json.number("edits", double(world->edits().size()));
            std::string notes;
            for (const std::string& note : world->model_notes())
                notes += (notes.empty() ? "" : ", ") + Json::quoted(note);
            if (!notes.empty()) json.raw("models", "[" + notes + "]");
            add_journal(json, *world);
        }
        if (!world) json.text("error", world.error().message);
        (void)put(json.line());
    }
    if (!world) return fail(world.error());
    if (!o.json) {
        (void)put(o.scene + ": valid, " + std::to_string(world->edits().size()) + " edits\n");
        for (const std::string& note : world->model_notes()) (void)put("  " + note + "\n");
    }
    return finish_data();
}

}  // namespace

void add_inspect(CLI::App& app, Run& run) {
    auto o = std::make_shared<InspectOptions>();
    CLI::App* verb = app.add_subcommand("inspect",
                                        "Tells what is in a scene. Needs no device.\n\n"
                                        "Examples:\n"
                                        "  kiln inspect quarry\n"
                                        "  kiln inspect my.kiln.json --json\n"
                                        "  kiln inspect my.kiln.json --history      the steps in its journal");
    verb->add_option("SCENE", o->scene, "a scene file, or a bundled scene's name")->required();
    verb->add_flag("--json", o->json, "one object, on stdout");
    verb->add_flag("--history", o->history, "the steps that the scene's journal holds, and which are undone");
    verb->callback([o, &run] { run = [o] { return inspect(*o); }; });
}

void add_validate(CLI::App& app, Run& run) {
    auto o = std::make_shared<InspectOptions>();
    CLI::App* verb =
        app.add_subcommand("validate",
                           "Checks a scene; the error tells file, line, column, key and mend. Needs no device.\n\n"
                           "Examples:\n"
                           "  kiln validate my.kiln.json");
    verb->add_option("SCENE", o->scene, "a scene file, or a bundled scene's name")->required();
    verb->add_flag("--json", o->json, "one object, on stdout");
    verb->callback([o, &run] { run = [o] { return validate(*o); }; });
}

void add_schema(CLI::App& app, Run& run) {
    CLI::App* verb = app.add_subcommand("schema",
                                        "Prints the JSON Schema (2020-12) of scenes.\n\n"
                                        "Examples:\n"
                                        "  kiln schema > kiln.schema.json");
    auto json = std::make_shared<bool>(false);
    verb->add_flag("--json", *json, "changes nothing: it is JSON");
    verb->callback([json, &run] {
        run = [] {
            (void)put(scene_schema_json());
            return finish_data();
        };
    });
}

}  // namespace kiln::cli
