// SPDX-License-Identifier: MIT
// kiln simulate SCENE --seconds S: the scene's bodies, run without a window; their ways as JSON, and as pictures.

#include "cli/film.h"
#include "cli/json.h"
#include "cli/scene.h"
#include "cli/talk.h"
#include "cli/verbs.h"

#include <kiln/world.h>

#include <functional>
#include <memory>
#include <optional>
#include <utility>

namespace kiln::cli {

namespace {

struct SimulateOptions {
    std::string scene, edits, ground = "field";
    SimulateSettings settings;
    std::string out, keep;
    PictureOptions pictures;
    bool png = false;
    bool json = false, force = false;
};

int simulate(const SimulateOptions& o) {
    auto world = World::load(o.scene);
    if (!world) return fail(world.error());
    for (const std::string& section : world->not_drawn_yet())
        if (section != "meshes" && section != "triggers" && section != "characters")
            say("kiln simulate: " + o.scene + ": this version does not simulate \"" + section + "\"");
    if (!o.keep.empty()) {
        if (auto ok = writable_scene(o.keep, o.force); !ok) return fail(ok.error());
        if (auto ok = not_read(*world, o.keep); !ok) return fail(ok.error());
    }
    SimulateSettings settings = o.settings;
    if (!o.edits.empty()) {
        auto commands = read_timed_commands(o.edits);
        if (!commands) return fail(commands.error());
        settings.edits = std::move(*commands);
    }
    settings.mesh_ground = o.ground == "mesh";
    std::optional<Film> film;
    if (o.png) {
        if (o.out.empty()) return fail(usage("--png wants a folder for its pictures; add --out FOLDER"));
        auto opened = Film::open(*world, o.pictures, o.out);
        if (!opened) return fail(opened.error());
        film = std::move(*opened);
    } else if (!o.out.empty()) {
        return fail(usage("--out is for pictures; add --png"));
    }
    Progress progress;
    std::optional<World> kept;
    double before = 0;
    const auto each = [&](Play& play) -> Result<void> {
        if (film) {
            progress.stage("picture " + std::to_string(film->pictures()));
            if (auto shot = film->shoot(play); !shot) return shot;
        }
        // The last frame is within half a step of the end, and frames are a step apart at least; an earlier one that is as near is taken back.
        const double apart = play.time() - std::exchange(before, play.time());
        if (o.keep.empty() || play.time() < settings.seconds - 0.6 * apart) return {};
        auto fresh = World::load(o.scene);
        if (!fresh) return fresh.error();
        kept = std::move(*fresh);
        return play.keep(*kept);
    };
    const Stopwatch watch;
    const auto ways = world->simulate_json(settings, each);
    progress.stage("");
    if (!ways) return fail(ways.error());
    if (film)
        say("wrote    " + std::to_string(film->pictures()) + " pictures, " + o.out + "/frame_00000.png and so on");
    if (kept) {
        if (auto saved = kept->save(o.keep); !saved) return fail(saved.error());
        say("wrote    " + o.keep + ", the scene as it was then");
    }
    if (o.json) {
        (void)put(*ways);
    } else {
        (void)put("simulated " + Json::digits(o.settings.seconds) + " s of " + o.scene + " in " +
                  brief(watch.seconds(), "s") + "; --json tells where the bodies went\n");
    }
    return finish_data();
}

}  // namespace

void add_simulate(CLI::App& app, Run& run) {
    auto o = std::make_shared<SimulateOptions>();
    CLI::App* verb = app.add_subcommand(
        "simulate",
        "Runs a scene's bodies without a window.\n\n"
        "The answer is the same for any number of threads.\n\n"
        "Examples:\n"
        "  kiln simulate tumble --seconds 2 --every 0.5 --json\n"
        "  kiln simulate scene.kiln.json --seconds 10 --backend bullet --field-bodies --json\n"
        "  kiln simulate quarry --seconds 10 --edits digs.jsonl --keep dug.kiln.json\n"
        "  kiln simulate tumble --seconds 4 --every 0.1 --out pictures --png --size 640x360 --view contacts");
    verb->add_option("SCENE", o->scene, "a scene file, or a bundled scene's name")->required();
    verb->add_option("--seconds", o->settings.seconds, "how long")->required();
    verb->add_option("--every", o->settings.every, "seconds between frames; left out: each step");
    verb->add_option("--backend", o->settings.backend, "physics engine, see `kiln doctor`; left out: the default");
    verb->add_flag("--field-bodies", o->settings.field_bodies,
                   "boxes, balls, capsules and cylinders collide as fields too");
    verb->add_option("--ground", o->ground,
                     "what convex bodies touch: the ground's field, or triangles where it has settled")
        ->check(CLI::IsMember({"field", "mesh"}));
    verb->add_option(
        "--edits", o->edits,
        "changes on the way: JSON lines {\"time\": seconds, \"command\": {\"add\": EDIT}} and the like; with "
        "\"target\" they act on bodies too");
    verb->add_option(
        "--keep", o->keep,
        "scene file to write, NAME.kiln.json: what the scene is at the end, bodies and parts where they are");
    verb->add_flag("--force", o->force, "writes over a scene that is there");
    verb->add_option("--threads", o->settings.threads, "left out: all cores");
    verb->add_option("--out", o->out, "folder, which must be there, for --png");
    CLI::Option* png = verb->add_flag("--png", o->png, "a picture of each frame: frame_00000.png and so on");
    verb->add_option("--size", o->pictures.size, "of the pictures: WIDTHxHEIGHT in pixels")
        ->capture_default_str()
        ->needs(png);
    verb->add_option("--camera", o->pictures.camera, "of the pictures; left out: the scene's first")->needs(png);
    verb->add_option("--view", o->pictures.view,
                     "of the pictures: as of render, or contacts, shapes, sleeping: lines over the shaded picture")
        ->capture_default_str()
        ->needs(png);
    verb->add_option("--device", o->pictures.device, "of the pictures: auto, cpu-vulkan or part of a device's name")
        ->capture_default_str()
        ->needs(png);
    verb->add_option("--quality", o->pictures.quality, "of the pictures: low, medium, high, ultra or auto")->needs(png);
    verb->add_flag("--json", o->json, "the ways of all bodies, one object, on stdout");
    verb->callback([o, &run] { run = [o] { return simulate(*o); }; });
}

}  // namespace kiln::cli
