// SPDX-License-Identifier: MIT
// kiln export SCENE -o OUT: the surface as a mesh.

#include "cli/json.h"
#include "cli/scene.h"
#include "cli/talk.h"
#include "cli/verbs.h"

#include <kiln/world.h>

#include <memory>
#include <unistd.h>

namespace kiln::cli {

namespace {

struct ExportOptions {
    std::string scene, output, format, cell, simplify;
    bool sharp = false, json = false, quiet = false;
};

// A number, and the unit behind it.
struct Quantity {
    double value = 0;
    std::string_view unit;
};
std::optional<Quantity> quantity(std::string_view text) {
    Quantity out;
    const auto [end, code] = std::from_chars(text.data(), text.data() + text.size(), out.value);
    if (code != std::errc() || !std::isfinite(out.value)) return std::nullopt;
    out.unit = text.substr(size_t(end - text.data()));
    return out;
}

// Metres of "0.01", "0.01m", "1cm" or "10mm"; above 0.
std::optional<float> metres(std::string_view text, bool plain) {
    const std::optional<Quantity> q = quantity(text);
    if (!q || !(q->value > 0)) return std::nullopt;
    const double unit = q->unit == "m" || (plain && q->unit.empty()) ? 1
                        : q->unit == "cm"                            ? 0.01
                        : q->unit == "mm"                            ? 0.001
                                                                     : 0;
    if (unit == 0) return std::nullopt;
    return float(q->value * unit);
}

Result<MeshSettings> settings_of(const ExportOptions& o) {
    MeshSettings s;
    s.sharp = o.sharp;
    if (!o.cell.empty()) {
        const std::optional<float> cell = metres(o.cell, true);
        if (!cell) return usage("--cell " + o.cell + ": not a length above 0; write metres, such as 0.01, or 10mm");
        s.cell = *cell;
    }
    if (!o.simplify.empty()) {
        const std::optional<float> error = metres(o.simplify, false);
        const std::optional<Quantity> share = quantity(o.simplify);
        if (error) {
            s.simplify_error = *error;
        } else if (share && share->unit.empty() && share->value > 0 && share->value <= 1) {
            s.simplify_share = float(share->value);
        } else {
            return usage(
                "--simplify " + o.simplify +
                ": write the share of triangles to keep, such as 0.25, or how far the surface may move, such as 2mm");
        }
    }
    return s;
}

Result<MeshFormat> format_of(const ExportOptions& o) {
    if (!o.format.empty()) {
        if (const auto format = mesh_format("." + o.format)) return *format;
        return usage("--format " + o.format + ": there is no such format; use glb, obj, stl or ply");
    }
    if (o.output == "-") return usage("-o -: say which format with --format glb, obj, stl or ply");
    if (const auto format = mesh_format(o.output)) return *format;
    return usage("-o " + o.output + ": unknown kind of mesh; end the name in .glb, .obj, .stl or .ply");
}

int export_mesh(const ExportOptions& o) {
    const bool piped = o.output == "-";
    const auto settings = settings_of(o);
    if (!settings) return fail(settings.error());
    const auto format = format_of(o);
    if (!format) return fail(format.error());
    if (!piped && mesh_format(o.output) != *format)
        return fail(usage("-o " + o.output + " --format " + o.format +
                          ": the name's ending says otherwise; leave --format out"));
    if (piped && ::isatty(STDOUT_FILENO) == 1)
        return fail(usage("-o -: a mesh is not text for a terminal; pipe it on, or name a file"));
    if (piped && o.json) return fail(usage("-o - --json: both want stdout; name a file"));
    if (!piped)
        if (auto ok = writable(o.output); !ok) return fail(ok.error());

    const Stopwatch total;
    Progress progress;
    progress.stage("loading " + o.scene);
    const auto world = World::load(o.scene);
    if (!world) return progress.stage(""), fail(world.error());
    if (!piped)
        if (auto ok = not_read(*world, o.output); !ok) return progress.stage(""), fail(ok.error());
    progress.stage("meshing");
    const Stopwatch meshing;
    const auto mesh = world->mesh(*settings);
    const double mesh_ms = meshing.seconds() * 1000;
    if (!mesh) return progress.stage(""), fail({o.scene + ": " + mesh.error().message, mesh.error().kind});
    progress.stage("writing " + o.output);
    if (piped) {
        const auto bytes = mesh->encode(*format);
        if (!bytes) return progress.stage(""), fail(bytes.error());
        (void)put(*bytes);
    } else if (auto ok = mesh->save(o.output); !ok) {
        return progress.stage(""), fail(ok.error());
    }
    progress.stage("measuring");
    const MeshReport r = measure(*mesh);
    progress.stage("");
    if (!o.quiet) {
        tell_journal(*world);
        char line[200];
        std::snprintf(line, sizeof line, "%llu triangles, %llu vertices, %zu parts, %.6g m^3, %.6g m^2, %s",
                      static_cast<unsigned long long>(r.triangles), static_cast<unsigned long long>(r.vertices),
                      mesh->parts.size(), r.volume, r.area,
                      r.open_edges + r.non_manifold_edges == 0 ? "closed" : "NOT closed");
        say(o.scene + "   " + line);
        if (!piped) say("wrote    " + o.output);
    }
    if (!o.json) return piped ? finish_data() : kDone;
    const auto corner = [](vec3 v) {
        return "[" + Json::digits(double(v.x)) + ", " + Json::digits(double(v.y)) + ", " + Json::digits(double(v.z)) +
               "]";
    };
    std::string parts;
    for (const MeshPart& part : mesh->parts) {
        Json json;
        json.text("material", part.name).flag("blended", part.blended).number("triangles", part.count);
        parts += (parts.empty() ? "" : ", ") + json.object();
    }
    Json bounds;
    bounds.raw("min", corner(r.bounds.min)).raw("max", corner(r.bounds.max));
    Json json;
    json.text("scene", o.scene).text("output", o.output).flag("sharp", o.sharp);
    json.number("vertices", double(r.vertices)).number("triangles", double(r.triangles));
    json.number("open_edges", double(r.open_edges)).number("non_manifold_edges", double(r.non_manifold_edges));
    json.number("volume", r.volume)
        .number("area", r.area)
        .raw("bounds", bounds.object())
        .raw("parts", "[" + parts + "]");
    json.number("mesh_ms", mesh_ms).number("total_ms", total.seconds() * 1000);
    add_journal(json, *world);
    (void)put(json.line());
    return finish_data();
}

}  // namespace

void add_export(CLI::App& app, Run& run) {
    auto o = std::make_shared<ExportOptions>();
    CLI::App* verb =
        app.add_subcommand("export",
                           "Writes the surface as a closed mesh, cut at the field's bounds. Needs no device.\n\n"
                           "Examples:\n"
                           "  kiln export potter -o potter.glb\n"
                           "  kiln export my.kiln.json -o part.stl --sharp --cell 2mm\n"
                           "  kiln export quarry -o - --format ply --simplify 0.1 > quarry.ply");
    verb->add_option("SCENE", o->scene, "a scene file, or a bundled scene's name")->required();
    verb->add_option("-o,--output", o->output,
                     "mesh to write (over what is there): .glb, .obj, .stl or .ply; - for a pipe")
        ->required();
    verb->add_option("--format", o->format, "glb, obj, stl or ply, where -o is -");
    verb->add_option("--cell", o->cell, "metres between samples (or 5mm, 1cm); left out: the scene's voxel size");
    verb->add_flag("--sharp", o->sharp, "keep edges and corners of shapes");
    verb->add_option("--simplify", o->simplify,
                     "share of triangles to keep (0.25), or how far the surface may move (2mm)");
    verb->add_flag("--json", o->json, "one object with counts and measures, on stdout");
    verb->add_flag("-q,--quiet", o->quiet, "say nothing but errors");
    verb->callback([o, &run] { run = [o] { return export_mesh(*o); }; });
}

}  // namespace kiln::cli
