// SPDX-License-Identifier: MIT
// kiln view SCENE: a window on a world that runs; without a display, the same frames without showing them.

#include "cli/picture.h"
#include "cli/talk.h"
#include "cli/verbs.h"
#include "player/player.h"
#include "player/window.h"

#include <kiln/world.h>

#include <memory>

namespace kiln::cli {

namespace {

struct ViewOptions {
    PictureOptions picture;
    player::PlayerOptions player;
};

int view(ViewOptions o) {
    if (o.picture.quality == "auto") o.picture.quality.clear();
    auto settings = picture_settings(o.picture);  // what --size and --quality may say
    if (!settings) return fail(settings.error());
    o.player.width = settings->width;
    o.player.height = settings->height;
    o.player.choose_quality = o.picture.quality.empty();
    if (!o.player.choose_quality) o.player.quality = *quality_named(o.picture.quality);
    if (o.player.frames < 0) return fail(usage("--frames takes a number above 0"));
    for (const std::string& path : {o.player.screenshot, o.player.ui_json}) {
        if (path.empty()) continue;
        if (path == "-") return fail(usage("-: a file has to be named, stdout has no pictures"));
        if (auto ok = writable(path); !ok) return fail(ok.error());
    }
    if (!o.player.screenshot.empty() && !o.player.screenshot.ends_with(".png"))
        return fail(usage("--screenshot " + o.player.screenshot + ": end the name in .png"));
    o.player.scene = o.picture.scene;
    o.player.camera = o.picture.camera;
    o.player.device = o.picture.device;
    o.player.say = [](std::string_view line) { say(line); };
    o.player.window = player::Window::has_display();
    if (!o.player.window && o.player.frames == 0)
        return fail(
            Error{"view: no display to open a window on; --frames N draws so many frames without one, --screenshot "
                  "OUT.png keeps the last",
                  ErrorKind::Failed});
    auto done = player::run_player(o.player);
    if (!done && done.error().kind == ErrorKind::NoDevice && o.player.window && o.player.frames > 0) {
        say("kiln: " + done.error().message + "; drawing without a window");
        o.player.window = false;
        done = player::run_player(o.player);
    }
    return done ? kDone : fail(done.error());
}

}  // namespace

void add_view(CLI::App& app, Run& run) {
    auto o = std::make_shared<ViewOptions>();
    CLI::App* verb = app.add_subcommand(
        "view", "Opens a window on a scene that runs: fly, dig, throw.\n\n" + std::string(player::player_keys()) +
                    "\n\n"
                    "Examples:\n"
                    "  kiln view quarry\n"
                    "  kiln view my.kiln.json --size 1920x1080 --quality high\n"
                    "  kiln view quarry --frames 60 --keys dig.jsonl --screenshot out.png");
    verb->add_option("SCENE", o->picture.scene, "a scene file, or a bundled scene's name")->required();
    verb->add_option("--size", o->picture.size, "of the window: WIDTHxHEIGHT in pixels")->capture_default_str();
    verb->add_option("--camera", o->picture.camera, "where to begin; left out: the scene's first");
    verb->add_option("--device", o->picture.device, "auto, cpu-vulkan or part of a device's name")
        ->capture_default_str();
    verb->add_option(
        "--quality", o->picture.quality,
        "low, medium, high or ultra at the window's full size; auto: what the device can do many times a second");
    verb->add_option("--backend", o->player.backend, "physics engine, see `kiln doctor`; left out: the default");
    verb->add_option("--frames", o->player.frames, "end after so many; without a display it is needed");
    verb->add_option("--screenshot", o->player.screenshot, "the last frame: .png");
    verb->add_option(
        "--keys", o->player.keys,
        "replay input events, JSON lines such as {\"frame\": 3, \"key\": \"w\", \"down\": true}; a frame is then a "
        "sixtieth of a second");
    verb->add_option("--ui-json", o->player.ui_json, "what each frame showed, a JSON object a line");
    verb->add_flag("--validation", o->player.validation,
                   "with the driver's validation layer; its first message ends the run");
    verb->callback([o, &run] { run = [o] { return view(*o); }; });
}

}  // namespace kiln::cli
