// SPDX-License-Identifier: MIT
// kiln import MODEL -o SCENE: a scene with the model as a mesh shape. Says on stderr what was found in the model.

#include "cli/scene.h"
#include "cli/talk.h"
#include "cli/verbs.h"

#include <kiln/world.h>

#include <array>
#include <memory>

namespace kiln::cli {

namespace {

struct ImportOptions {
    std::string model, output, unit = "m", up = "y";
    int resolution = 128;
    bool force = false;
};

struct Unit {
    std::string_view name;
    float metres;
};
constexpr std::array<Unit, 4> kUnits{{{"mm", 0.001f}, {"cm", 0.01f}, {"m", 1}, {"in", 0.0254f}}};

int run_import(const ImportOptions& o) {
    ImportSettings settings;
    settings.unit = 0;
    for (const Unit& unit : kUnits)
        if (unit.name == o.unit) settings.unit = unit.metres;
    if (settings.unit == 0) return fail(usage("--unit " + o.unit + ": not a unit; write mm, cm, m or in"));
    if (o.up != "y" && o.up != "z") return fail(usage("--up " + o.up + ": not an axis; write y or z"));
    if (o.resolution < 8 || o.resolution > 512)
        return fail(usage("--resolution " + std::to_string(o.resolution) + ": must be between 8 and 512"));
    if (auto ok = writable_scene(o.output, o.force); !ok) return fail(ok.error());
    settings.z_up = o.up == "z";
    settings.resolution = o.resolution;
    Progress progress;
    progress.stage("reading " + o.model);
    const auto world = World::import(o.model, o.output, settings);
    if (!world) return fail(world.error());
    if (auto saved = world->save(o.output); !saved) return fail(saved.error());
    progress.stage("");
    for (const std::string& note : world->model_notes()) say(note);
    return finish_data();
}

}  // namespace

void add_import(CLI::App& app, Run& run) {
    auto o = std::make_shared<ImportOptions>();
    CLI::App* verb = app.add_subcommand("import",
                                        "Makes a scene of a model file. Needs no device.\n\n"
                                        "Examples:\n"
                                        "  kiln import bunny.obj -o bunny.kiln.json\n"
                                        "  kiln import part.stl -o part.kiln.json --unit mm --up z");
    verb->add_option("MODEL", o->model, "a .glb, .gltf, .obj, .off, .ply or .stl file")->required();
    verb->add_option("-o,--output", o->output, "the scene to write, NAME.kiln.json")->required();
    verb->add_option("--unit", o->unit, "of the file: mm, cm, m or in (glTF is in metres: leave it out)");
    verb->add_option("--up", o->up, "the file's axis that points up: y, or z for most CAD files");
    verb->add_option("--resolution", o->resolution, "cells along the longest side, 8 to 512");
    verb->add_flag("--force", o->force, "writes over a scene that is there");
    verb->callback([o, &run] { run = [o] { return run_import(*o); }; });
}

}  // namespace kiln::cli
