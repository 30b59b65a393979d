// SPDX-License-Identifier: MIT

#include "cli/picture.h"

#include "cli/json.h"
#include "cli/scene.h"
#include "cli/talk.h"
#include "player/player.h"

#include <kiln/world.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <span>
#include <vector>

namespace kiln::cli {

namespace {

constexpr std::string_view kTiers[] = {"auto", "compute", "rt", "mesh"};
constexpr std::string_view kQualities[] = {"low", "medium", "high", "ultra", "auto"};
constexpr std::string_view kShadows[] = {"rays", "cascades"};
constexpr std::string_view kLightings[] = {"clusters", "volumes"};
constexpr std::string_view kAos[] = {"off", "half", "full"};
constexpr std::string_view kOutlines[] = {"seen", "hidden", "hulls"};

// Where what was asked for stands among the words that an option knows; else `none` and what to write instead.
Result<size_t> place_of(const std::string& option, const std::string& asked, std::span<const std::string_view> words,
                        const char* none) {
    const auto found = std::find(words.begin(), words.end(), asked);
    if (found != words.end()) return size_t(found - words.begin());
    std::string mend;
    if (const std::string_view near = nearest_word(asked, words); !near.empty()) {
        mend = "did you mean " + std::string(near) + "?";
    } else {
        for (size_t i = 0; i < words.size(); ++i)
            mend += (i == 0 ? "use " : i + 1 < words.size() ? ", " : " or ") + std::string(words[i]);
    }
    return usage(option + " " + asked + ": " + none + "; " + mend);
}

}  // namespace

std::optional<Quality> quality_named(std::string_view name) {
    const auto found = std::find(std::begin(kQualities), std::end(kQualities), name) - std::begin(kQualities);
    if (found > ptrdiff_t(Quality::Ultra)) return std::nullopt;
    return Quality(found);
}

Result<RenderSettings> picture_settings(const PictureOptions& o) {
    RenderSettings s;
    const size_t x = o.size.find('x');
    const auto side = [](std::string_view digits) {
        int v = 0;
        const auto [end, code] = std::from_chars(digits.data(), digits.data() + digits.size(), v);
        return code == std::errc() && end == digits.data() + digits.size() ? v : 0;
    };
    s.width = x == std::string::npos ? 0 : side(std::string_view(o.size).substr(0, x));
    s.height = x == std::string::npos ? 0 : side(std::string_view(o.size).substr(x + 1));
    if (s.width < 1 || s.width > 16384 || s.height < 1 || s.height > 16384)
        return usage("--size " + o.size + ": not a size; write WIDTHxHEIGHT, each from 1 to 16384, such as 1280x720");
    const auto view = place_of("--view", o.view, player::view_names(), "there is no such view");
    if (!view) return view.error();
    s.view = View(*view);
    const auto tier = place_of("--tier", o.tier, kTiers, "there is no such tier");
    if (!tier) return tier.error();
    s.tier = Tier(*tier);
    if (!o.shadows.empty()) {
        const auto shadows = place_of("--shadows", o.shadows, kShadows, "there are no such shadows");
        if (!shadows) return shadows.error();
        s.mesh_shadows = MeshShadows(*shadows);
    }
    const auto lighting = place_of("--lighting", o.lighting, kLightings, "there is no such lighting");
    if (!lighting) return lighting.error();
    s.lighting = LightTechnique(*lighting);
    if (!o.ao.empty()) {
        const auto ao = place_of("--ao", o.ao, kAos, "there is no such ambient occlusion");
        if (!ao) return ao.error();
        s.ao = AmbientOcclusion(*ao);
    }
    const auto outlines = place_of("--outlines", o.outlines, kOutlines, "there are no such outlines");
    if (!outlines) return outlines.error();
    s.outline_hidden = kOutlines[*outlines] == "hidden";
    s.outline_hulls = kOutlines[*outlines] == "hulls";
    if (!(o.scale >= 0.25f && o.scale <= 1)) return usage("--scale wants a number from 0.25 to 1");
    if (o.scale < 1 && !o.taa && o.quality != "ultra")
        return usage("--scale works with --taa, or with --quality ultra; add one of them");
    s.scale = o.scale;
    if (!o.quality.empty()) {
        const auto quality = place_of("--quality", o.quality, kQualities, "there is no such quality");
        if (!quality) return quality.error();
        if (o.no_refine || o.taa)
            return usage("--quality decides what --no-refine and --taa do; leave one of them out");
        if (o.reference) return usage("--quality is for the renderer, not for --reference; leave one of them out");
    }
    if (o.unpruned && !o.analytic) return usage("--unpruned works with --analytic; add it");
    if (o.reference && *o.reference < 1) return usage("--reference takes a number of samples above 0");
    if (!(o.time >= 0 && o.time <= 1e9)) return usage("--time wants seconds, 0 or more");
    if (!o.path.empty() && o.frames < 2) return usage("--path wants --frames, 2 or more");
    if (o.path.empty() && (o.frames != 0 || o.budget != 0))
        return usage("--frames and --budget work with --path; add it");
    if (!o.path.empty() && (!o.camera.empty() || o.reference))
        return usage("--path has its own cameras and no --reference; leave --camera and --reference out");
    if (o.taa && (o.reference || s.view != View::Shaded))
        return usage("--taa works on shaded pictures, without --reference; leave it out");
    if (o.transparent_layers && (*o.transparent_layers < 0 || *o.transparent_layers > 16))
        return usage("--transparent-layers " + std::to_string(*o.transparent_layers) + ": it is 0 to 16");
    if (o.transparent_layers) s.transparent_layers = *o.transparent_layers;
    s.cull_meshes = !o.no_cull;
    s.taa = o.taa;
    s.analytic = o.analytic;
    s.unpruned = o.unpruned;
    s.accelerate = !o.no_accelerate;
    s.refine = !o.no_refine;
    s.cull_lights = !o.all_lights;
    s.atlas_by_copy = o.atlas_by_copy;
    return s;
}

// With --taa, a round of the places in its pixels that the renderer looks through.
int pictures_of_one_view(const RenderSettings& s) { return int(std::ceil(16 / (s.scale * s.scale) - 1e-3f)); }

std::string_view choose_quality(const PictureOptions& o, const Renderer& renderer, RenderSettings& s) {
    if (o.quality.empty()) return kQualities[size_t(Quality::High)];
    const Quality quality = quality_named(o.quality).value_or(renderer.best_quality());
    const RenderSettings asked = s;
    set_quality(s, quality);
    if (!o.shadows.empty()) s.mesh_shadows = asked.mesh_shadows;
    if (!o.ao.empty()) s.ao = asked.ao;
    if (o.transparent_layers) s.transparent_layers = asked.transparent_layers;
    if (o.no_refine) s.refine = false;
    if (o.taa) s.taa = true;
    return kQualities[size_t(quality)];
}

namespace {

Result<void> check_output(const std::string& path) {
    if (path == "-") return usage("-o -: pictures are not written to stdout; name a file");
    if (!path.ends_with(".png") && !path.ends_with(".exr"))
        return usage("-o " + path + ": unknown kind of picture; end the name in .png or .exr");
    return writable(path);
}

std::string with_commas(uint64_t n) {
    std::string s = std::to_string(n);
    for (int at = int(s.size()) - 3; at > 0; at -= 3) s.insert(size_t(at), ",");
    return s;
}

void introduce(const RenderStats& stats) {
    std::string kind;
    for (const DeviceInfo& d : devices()) {
        if (d.name != stats.device) continue;
        kind = (d.kind == "cpu" ? std::string(", a CPU renderer") : "") + ", " + d.api_version;
        break;
    }
    say("kiln " + std::string(version()) + " — device: " + stats.device + kind + "; no window → rendering to a file");
}

// One object a level, finest first.
std::string levels_json(const RenderStats& stats) {
    std::string out;
    for (const RenderStats::Level& l : stats.levels) {
        Json json;
        json.number("voxel_size", l.voxel_size).number("bricks", l.bricks).number("queued", l.queued);
        json.number("baked", l.baked).number("evicted", l.evicted).number("refused", l.refused);
        json.number("entered", l.entered).flag("skipped", l.skipped);
        out += (out.empty() ? "" : ", ") + json.object();
    }
    return "[" + out + "]";
}

// {"name": number, …}
template <typename Number>
std::string named_numbers(const std::vector<std::pair<std::string, Number>>& list) {
    std::string out;
    for (const auto& [name, value] : list)
        out += (out.empty() ? "" : ", ") + Json::quoted(name) + ": " + Json::digits(double(value));
    return "{" + out + "}";
}

// Of parts in the picture: how many, how many drawn in each phase, and the percentage left out because something hides it.
std::string clusters_json(const RenderStats& stats) {
    Json json;
    const uint64_t drawn = stats.clusters_early + stats.clusters_late;
    json.number("in_sight", double(stats.clusters))
        .number("early", double(stats.clusters_early))
        .number("late", double(stats.clusters_late));
    json.number("culled_percent", stats.clusters > 0 ? 100 - 100 * double(drawn) / double(stats.clusters) : 0.0);
    return json.object();
}

std::string report(const PictureOptions& o, std::string_view quality, const RenderSettings& s, const RenderStats& stats,
                   const Frame& frame, const World& world, double load, double total) {
    Json json;
    json.text("device", stats.device)
        .raw("size", "[" + std::to_string(s.width) + ", " + std::to_string(s.height) + "]");
    json.text("view", o.view).text("quality", quality).text("output", o.output);
    json.number("edits", stats.edits)
        .number("bricks", stats.bricks)
        .number("frame_ms", stats.frame_ms)
        .raw("passes", named_numbers(stats.passes))
        .raw("pass_bytes", named_numbers(stats.pass_bytes))
        .raw("pass_evaluations", named_numbers(stats.pass_evaluations))
        .number("transient_peak_bytes", double(stats.transient_peak_bytes))
        .number("transient_sum_bytes", double(stats.transient_sum_bytes))
        .number("transient_pass_bytes", double(stats.transient_pass_bytes))
        .number("side_by_side_ms", stats.side_by_side_ms);
    json.number("evaluations", double(stats.evaluations)).number("atlas_bytes", double(stats.atlas_bytes));
    json.number("host_bytes", double(stats.host_bytes)).number("pipelines_created", double(stats.pipelines_created));
    json.number("exposure", double(stats.exposure))
        .number("coarsened", frame.coarsened)
        .number("load_s", load)
        .number("total_s", total);
    if (!stats.levels.empty())
        json.raw("levels", levels_json(stats))
            .number("net_bricks", stats.net_bricks)
            .number("net_baked", stats.net_baked);
    if (stats.instances > 0) {
        Json own;
        own.number("count", stats.instances).number("bricks", stats.instance_bricks);
        own.number("bricks_new", stats.instance_bricks_new).number("ms", stats.instances_ms);
        own.number("tiles_by_tree", double(stats.instance_tiles_by_tree));
        json.raw("instances", own.object());
    }
    if (stats.triangles > 0)
        json.number("triangles", double(stats.triangles))
            .number("triangles_drawn", double(stats.triangles_drawn))
            .number("triangles_culled", double(stats.triangles - std::min(stats.triangles, stats.triangles_drawn)))
            .raw("mesh_clusters", clusters_json(stats));
    json.text("march_tier", stats.march_tier).text("lighting", stats.lighting);
    if (s.scale < 1)
        json.raw("rays", "[" + std::to_string(stats.rays_across) + ", " + std::to_string(stats.rays_down) + "]");
    if (stats.triangles > 0) {
        json.text("mesh_tier", stats.mesh_tier).text("mesh_shadows", stats.mesh_shadows);
        json.number("cascades", stats.cascades);
    }
    if (stats.boxes > 0)
        json.number("boxes", stats.boxes)
            .number("box_tree_builds", double(stats.box_tree_builds))
            .number("box_tree_bytes", double(stats.box_tree_bytes));
    std::string faults;
    for (const std::string& fault : world.faults()) faults += (faults.empty() ? "" : ", ") + Json::quoted(fault);
    if (!faults.empty()) json.raw("faults", "[" + faults + "]");
    add_journal(json, world);
    return json.line();
}

// Cameras of --path, in order.
Result<std::vector<Camera>> stops_of(const World& world, const std::string& path) {
    std::vector<Camera> out;
    if (path == "all") {
        for (const auto& [name, camera] : world.cameras) out.push_back(camera);
    } else {
        for (size_t at = 0; at <= path.size();) {
            const size_t end = std::min(path.find(',', at), path.size());
            auto camera = world.camera(path.substr(at, end - at));
            if (!camera) return usage("--path " + path + ": " + camera.error().message);
            out.push_back(*camera);
            at = end + 1;
        }
    }
    if (out.size() < 2) return usage("--path " + path + ": a path has two cameras or more");
    return out;
}

// Position, target and angle of view run along Catmull-Rom splines, an equal time from stop to stop.
Camera along(const std::vector<Camera>& stops, double time) {
    const double at = std::clamp(time, 0.0, 1.0) * double(stops.size() - 1);
    const size_t i = std::min(size_t(at), stops.size() - 2);
    const float t = float(at - double(i));
    const Camera& b = stops[i];
    const Camera& c = stops[i + 1];
    const Camera& a = i > 0 ? stops[i - 1] : b;
    const Camera& d = i + 2 < stops.size() ? stops[i + 2] : c;
    const auto spline = [&](vec3 p, vec3 q, vec3 r, vec3 s) {
        const vec3 linear = r - p, square = p * 2.0f - q * 5.0f + r * 4.0f - s, cube = q * 3.0f - p - r * 3.0f + s;
        return q + (linear + (square + cube * t) * t) * (0.5f * t);
    };
    Camera out = b;
    out.position = spline(a.position, b.position, c.position, d.position);
    out.target = spline(a.target, b.target, c.target, d.target);
    out.fov_y_deg = b.fov_y_deg + (c.fov_y_deg - b.fov_y_deg) * t;
    out.exposure = b.exposure + (c.exposure - b.exposure) * t;
    return out;
}

std::string numbered(const std::string& output, int frame) {
    char number[16];
    std::snprintf(number, sizeof number, "_%04d", frame);
    return output.substr(0, output.size() - 4) + number + output.substr(output.size() - 4);
}

// A picture a frame, the levels of the world following the camera.
int render_sequence(const PictureOptions& o, RenderSettings settings, const World& world, Progress& progress) {
    const auto stops = stops_of(world, o.path);
    if (!stops) return progress.stage(""), fail(stops.error());
    auto renderer = Renderer::create({.device = o.device});
    if (!renderer) return progress.stage(""), fail(renderer.error());
    (void)choose_quality(o, *renderer, settings);
    const FrameBudget budget = o.budget != 0 ? FrameBudget{.bricks = o.budget} : FrameBudget{};
    std::string rows;
    double worst_ms = 0;
    for (int i = 0; i < o.frames; ++i) {
        progress.stage("frame " + std::to_string(i + 1) + " of " + std::to_string(o.frames));
        const Stopwatch baking;
        auto frame = world.frame(along(*stops, double(i) / (o.frames - 1)), budget);
        if (!frame) return progress.stage(""), fail(frame.error());
        frame->time = frame->time_before = o.time;
        const double bake_ms = 1000 * baking.seconds();
        auto picture = renderer->render(*frame, settings);
        if (!picture) return progress.stage(""), fail(picture.error());
        if (auto ok = picture->save(numbered(o.output, i)); !ok) return progress.stage(""), fail(ok.error());
        const RenderStats& stats = renderer->stats();
        worst_ms = std::max(worst_ms, bake_ms);
        Json row;
        row.number("frame", i)
            .number("bake_ms", bake_ms)
            .number("frame_ms", stats.frame_ms)
            .number("bricks", stats.bricks)
            .number("evaluations", double(stats.evaluations));
        if (stats.clusters > 0) row.raw("mesh_clusters", clusters_json(stats));
        if (!stats.levels.empty())
            row.raw("levels", levels_json(stats))
                .number("net_bricks", stats.net_bricks)
                .number("net_baked", stats.net_baked);
        rows += (rows.empty() ? "" : ", ") + row.object();
    }
    progress.stage("");
    if (!o.quiet)
        say("wrote    " + numbered(o.output, 0) + " to " + numbered(o.output, o.frames - 1) + "   worst bake " +
            brief(worst_ms, "ms"));
    if (!o.json) return kDone;
    Json json;
    json.text("device", renderer->stats().device)
        .raw("size", "[" + std::to_string(settings.width) + ", " + std::to_string(settings.height) + "]");
    json.text("output", o.output).raw("frames", "[" + rows + "]");
    (void)put(json.line());
    return finish_data();
}

}  // namespace

int render_picture(const PictureOptions& o) {
    auto settings = picture_settings(o);
    if (!settings) return fail(settings.error());
    if (auto ok = check_output(o.output); !ok) return fail(ok.error());

    const Stopwatch total;
    Progress progress;
    progress.stage("loading " + o.scene);
    auto world = World::load(o.scene);
    if (!world) return progress.stage(""), fail(world.error());
    if (auto ok = not_read(*world, o.output); !ok) return progress.stage(""), fail(ok.error());
    if (!o.path.empty()) return render_sequence(o, *settings, *world, progress);
    progress.stage("finding the surface");
    auto frame = world->frame(o.camera);
    if (!frame) return progress.stage(""), fail(frame.error());
    frame->time = frame->time_before = o.time;
    const double load = total.seconds();

    Result<Picture> picture = Error{};
    RenderStats stats;
    std::string_view quality = "reference";
    if (o.reference) {
        progress.stage("tracing paths");
        picture = render_reference(*frame, *settings, *o.reference, &stats);
    } else {
        progress.stage("starting the device");
        auto renderer = Renderer::create({.device = o.device});
        if (!renderer) return progress.stage(""), fail(renderer.error());
        quality = choose_quality(o, *renderer, *settings);
        progress.stage("drawing");
        picture = renderer->render(*frame, *settings);
        for (int i = 1; picture && settings->taa && i < pictures_of_one_view(*settings); ++i)
            picture = renderer->render(*frame, *settings);
        stats = renderer->stats();
    }
    if (!picture) return progress.stage(""), fail(picture.error());
    progress.stage("writing " + o.output);
    if (auto ok = picture->save(o.output); !ok) return progress.stage(""), fail(ok.error());
    progress.stage("");

    if (!o.quiet) {
        tell_journal(*world);
        if (o.transcript) introduce(stats);
        std::string later;
        for (const std::string& section : world->not_drawn_yet()) later += (later.empty() ? "" : ", ") + section;
        for (const std::string& note : world->model_notes()) say("note     " + note);
        for (const std::string& fault : world->faults()) say("fault    " + fault + "; left out");
        if (!later.empty()) say("note     this version does not draw: " + later);
        if (frame->coarsened > 0)
            say("note     too large for the brick pool: drawn with voxels " +
                std::to_string(1 << std::min(frame->coarsened, 30)) + " times as large");
        say(o.scene + "   " + with_commas(uint64_t(stats.edits)) + " edits → " + with_commas(uint64_t(stats.bricks)) +
            " bricks   loaded in " + brief(load, "s") + "   frame " + std::to_string(settings->width) + "×" +
            std::to_string(settings->height) + " in " + brief(stats.frame_ms, "ms"));
        say("wrote    " + o.output);
        if (o.transcript)
            say("next     kiln render " + o.scene + " -o " + o.scene + ".exr   ·   kiln demo --list   ·   kiln doctor");
    }
    if (!o.json) return kDone;
    (void)put(report(o, quality, *settings, stats, *frame, *world, load, total.seconds()));
    return finish_data();
}

}  // namespace kiln::cli
