// SPDX-License-Identifier: MIT
// kiln simulate SCENE --seconds S: the scene's bodies, run without a window; their ways as JSON.

#include "cli/json.h"
#include "cli/talk.h"
#include "cli/verbs.h"

#include <kiln/world.h>

#include <memory>

namespace kiln::cli {

namespace {

struct Options {
    std::string scene, edits, ground = "field";
    SimulateSettings settings;
    bool json = false;
};

int simulate(const Options& o) {
    auto world = World::load(o.scene);
    if (!world) return fail(world.error());
    for (const std::string& section : world->not_drawn_yet())
        if (section != "meshes" && section != "triggers")
            say("kiln simulate: " + o.scene + ": this version does not simulate \"" + section + "\"");
    SimulateSettings settings = o.settings;
    if (!o.edits.empty()) {
        auto commands = read_timed_commands(o.edits);
        if (!commands) return fail(commands.error());
        settings.edits = std::move(*commands);
    }
    settings.mesh_ground = o.ground == "mesh";
    const Stopwatch watch;
    const auto ways = world->simulate_json(settings);
    if (!ways) return fail(ways.error());
    if (o.json) {
        (void)put(*ways);
    } else {
        (void)put("simulated " + Json::digits(o.settings.seconds) + " s of " + o.scene + " in " +
                  Json::digits(watch.seconds()) + " s; --json tells where the bodies went\n");
    }
    return finish_data();
}

}  // namespace

void add_simulate(CLI::App& app, Run& run) {
    auto o = std::make_shared<Options>();
    CLI::App* verb =
        app.add_subcommand("simulate",
                           "Runs a scene's bodies without a window.\n\n"
                           "The answer is the same for any number of threads.\n\n"
                           "Examples:\n"
                           "  kiln simulate tumble --seconds 2 --every 0.5 --json\n"
                           "  kiln simulate scene.kiln.json --seconds 10 --backend bullet --field-bodies --json");
    verb->add_option("scene", o->scene, "scene file, or the name of a bundled scene")->required();
    verb->add_option("--seconds", o->settings.seconds, "how long")->required();
    verb->add_option("--every", o->settings.every, "seconds between frames; left out: each step");
    verb->add_option("--backend", o->settings.backend, "physics engine, see `kiln doctor`; left out: the default");
    verb->add_flag("--field-bodies", o->settings.field_bodies,
                   "boxes, balls, capsules and cylinders collide as fields too");
    verb->add_option("--ground", o->ground,
                     "what convex bodies touch: the ground's field, or triangles where it has settled")
        ->check(CLI::IsMember({"field", "mesh"}));
    verb->add_option("--edits", o->edits,
                     "changes on the way: JSON lines {\"time\": seconds, \"command\": {\"add\": EDIT}} and the like");
    verb->add_option("--threads", o->settings.threads, "left out: all cores");
    verb->add_flag("--json", o->json, "the ways of all bodies, one object, on stdout");
    verb->callback([o, &run] { run = [o] { return simulate(*o); }; });
}

}  // namespace kiln::cli
