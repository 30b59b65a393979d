// SPDX-License-Identifier: MIT
// kiln demo [NAME]: a bundled scene in a window where there is a display, as NAME.png in the current folder where there is none.

#include "cli/picture.h"
#include "cli/talk.h"
#include "cli/verbs.h"
#include "player/player.h"
#include "player/window.h"

#include <kiln/world.h>

#include <algorithm>
#include <memory>

namespace kiln::cli {

namespace {

struct DemoOptions {
    PictureOptions picture;
    bool list = false, png = false;
};

int demo(DemoOptions o) {
    const auto scenes = bundled_scenes();
    if (o.list) {
        size_t widest = 0;
        for (const auto& scene : scenes) widest = std::max(widest, scene.first.size());
        for (const auto& [name, description] : scenes)
            (void)put(name + std::string(widest + 2 - name.size(), ' ') + description + "\n");
        return finish_data();
    }
    std::vector<std::string_view> names;
    bool known = false;
    for (const auto& [name, description] : scenes) {
        names.push_back(name);
        known = known || name == o.picture.scene;
    }
    if (!known) {
        const std::string_view near = nearest_word(o.picture.scene, names);
        say("kiln demo: there is no demo \"" + o.picture.scene + "\"; " +
            (near.empty() ? "`kiln demo --list` lists them" : "did you mean " + std::string(near) + "?"));
        return kUsage;
    }
    auto settings = picture_settings(o.picture);
    if (!settings) return fail(settings.error());
    if (!o.png && player::Window::has_display()) {
        const auto done = player::run_player({.scene = o.picture.scene,
                                              .device = o.picture.device,
                                              .width = settings->width,
                                              .height = settings->height,
                                              .say = [](std::string_view line) { say(line); }});
        if (done) return kDone;
        if (done.error().kind != ErrorKind::NoDevice) return fail(done.error());
        say("kiln: " + done.error().message + "; drawing a file instead");
    }
    o.picture.output = o.picture.scene + ".png";
    o.picture.transcript = true;
    return render_picture(o.picture);
}

}  // namespace

void add_demo(CLI::App& app, Run& run) {
    auto o = std::make_shared<DemoOptions>();
    o->picture.scene = "quarry";
    CLI::App* verb = app.add_subcommand(
        "demo",
        "Opens a bundled scene in a window; without a display, draws it to NAME.png in this folder.\n\n"
        "Examples:\n"
        "  kiln demo\n"
        "  kiln demo orbit\n"
        "  kiln demo --list");
    verb->add_option("NAME", o->picture.scene, "a bundled scene")->capture_default_str();
    verb->add_flag("--list", o->list, "the bundled scenes, on stdout");
    verb->add_flag("--png", o->png, "draw NAME.png also where there is a display");
    verb->add_option("--size", o->picture.size, "WIDTHxHEIGHT in pixels")->capture_default_str();
    verb->add_option("--device", o->picture.device, "auto, cpu-vulkan or part of a device's name")
        ->capture_default_str();
    verb->callback([o, &run] { run = [o] { return demo(*o); }; });
}

}  // namespace kiln::cli
