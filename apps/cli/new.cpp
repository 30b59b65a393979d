// SPDX-License-Identifier: MIT
// kiln new SCENE: a scene to begin with, or a copy of another.

#include "cli/json.h"
#include "cli/scene.h"
#include "cli/talk.h"
#include "cli/verbs.h"

#include <memory>

namespace kiln::cli {

namespace {

struct NewOptions {
    std::string scene, from;
    bool force = false, json = false;
};

// A ball on the ground, and somewhere to look from.
constexpr std::string_view kFirst = R"({
  "format": 1,
  "materials": {
    "ground": { "base_color": [0.35, 0.33, 0.3], "roughness": 0.9 },
    "clay": { "base_color": [0.72, 0.33, 0.22] }
  },
  "edits": [
    { "id": "ground", "shape": "plane", "material": "ground" },
    { "id": "ball", "shape": "sphere", "radius": 0.5, "position": [0, 0.45, 0], "blend_radius": 0.1, "material": "clay" }
  ],
  "cameras": { "main": { "position": [2, 1.4, 2.6], "target": [0, 0.4, 0] } }
}
)";

int make(const NewOptions& o) {
    if (auto ok = writable_scene(o.scene, o.force); !ok) return fail(ok.error());
    auto world = o.from.empty() ? World::parse(kFirst, o.scene) : load_scene(o.from);
    if (!world) return fail(world.error());
    if (auto saved = world->save(o.scene); !saved) return fail(saved.error());
    if (!o.json) return kDone;
    Json json;
    json.text("scene", o.scene).number("edits", double(world->edits().size()));
    (void)put(json.line());
    return finish_data();
}

}  // namespace

void add_new(CLI::App& app, Run& run) {
    auto o = std::make_shared<NewOptions>();
    CLI::App* verb = app.add_subcommand("new",
                                        "Makes a scene: a ball on the ground, or a copy of another.\n\n"
                                        "Examples:\n"
                                        "  kiln new my.kiln.json\n"
                                        "  kiln new mine.kiln.json --from potter");
    verb->add_option("SCENE", o->scene, "the file to make, NAME.kiln.json")->required();
    verb->add_option("--from", o->from, "a scene file, or a bundled scene's name, to begin with");
    verb->add_flag("--force", o->force, "write over a file that is there");
    verb->add_flag("--json", o->json, "one object, on stdout");
    verb->callback([o, &run] { run = [o] { return make(*o); }; });
}

}  // namespace kiln::cli
