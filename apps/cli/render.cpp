// SPDX-License-Identifier: MIT
// kiln render SCENE -o OUT: one picture, or a sequence along a path.

#include "cli/picture.h"
#include "cli/talk.h"
#include "cli/verbs.h"

#include <memory>

namespace kiln::cli {

void add_render(CLI::App& app, Run& run) {
    auto o = std::make_shared<PictureOptions>();
    CLI::App* verb = app.add_subcommand("render",
                                        "Draws one picture of a scene.\n\n"
                                        "Examples:\n"
                                        "  kiln render archipelago -o fly.png --size 640x480 --path all --frames 240");
    verb->add_option("SCENE", o->scene, "a scene file, or a bundled scene's name")->required();
    verb->add_option("-o,--output", o->output, "picture to write (over what is there): .png or .exr")->required();
    verb->add_option("--size", o->size, "WIDTHxHEIGHT in pixels")->capture_default_str();
    verb->add_option("--camera", o->camera, "a camera's name; left out: the scene's first");
    verb->add_option("--view", o->view, "shaded, albedo, normal, depth, steps, bricks, levels or ao")
        ->capture_default_str();
    verb->add_option("--device", o->device, "auto, cpu-vulkan or part of a device's name")->capture_default_str();
    verb->add_option("--tier", o->tier,
                     "auto, compute, rt (bricks by a ray-tracing pipeline) or mesh (meshes by a mesh shader): the same "
                     "picture; refused where the device has none")
        ->capture_default_str();
    verb->add_option("--path", o->path,
                     "names of the scene's cameras in order, by commas, or all: draws --frames pictures along a smooth "
                     "path through them, OUT_0000.png and so on");
    verb->add_option("--frames", o->frames, "how many pictures --path draws");
    verb->add_option("--time", o->time, "seconds: what the meshes' animations show");
    verb->add_option("--budget", o->budget, "with --path: bricks that a frame may bake; 0 is no limit");
    verb->add_flag("--analytic", o->analytic, "march the edits themselves instead of the bricks");
    verb->add_option("--reference", o->reference,
                     "path-trace on the CPU with this many samples a pixel (no device needed)");
    verb->add_flag("--unpruned", o->unpruned, "with --analytic: every edit at every step");
    verb->add_flag("--no-accelerate", o->no_accelerate, "visit every cell: the slow twin of the jumps");
    verb->add_flag("--no-cull", o->no_cull,
                   "draw meshes that something hides, and march on behind meshes: the same picture");
    verb->add_option(
            "--outlines", o->outlines,
            "round what is seen; hidden (also where something hides it); or hulls (of meshes: their back faces "
            "made larger, for comparison)")
        ->capture_default_str();
    verb->add_option("--transparent-layers", o->transparent_layers,
                     "things of glass that one ray may go through, 0 to 16 (default 4, or as the quality says)");
    verb->add_flag("--no-refine", o->no_refine, "leave hits where the bricks have them, not where the edits do");
    verb->add_flag("--all-lights", o->all_lights, "every light at every pixel: the slow twin of the lists by tile");
    verb->add_flag("--atlas-by-copy", o->atlas_by_copy, "bake to a buffer and copy")->group("");  // for who works on it
    verb->add_flag("--taa", o->taa,
                   "anti-alias over time: by the pictures before with --path, else by sixteen of one view");
    verb->add_option("--quality", o->quality,
                     "low, medium (hard shadows), high (default), ultra (with --taa), or auto: what suits the device");
    verb->add_option("--scale", o->scale,
                     "with --taa: rays a pixel along each side, 0.25 to 1; the picture is made whole over time")
        ->capture_default_str();
    verb->add_option("--ao", o->ao, "ambient occlusion: off, half or full");
    verb->add_option("--lighting", o->lighting,
                     "of lamps and spots: clusters (lists by tile), or volumes (rasterised and added up): the same "
                     "picture")
        ->capture_default_str();
    verb->add_option(
        "--shadows", o->shadows,
        "of meshes: rays (exact), or cascades (shadow maps, cheaper where pixels are many); left out: what "
        "--quality says, else rays");
    verb->add_flag("--json", o->json, "one object with what it took, on stdout");
    verb->add_flag("-q,--quiet", o->quiet, "say nothing but errors");
    verb->callback([o, &run] { run = [o] { return render_picture(*o); }; });
}

}  // namespace kiln::cli
