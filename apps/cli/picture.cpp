// SPDX-License-Identifier: MIT

#include "cli/picture.h"

#include "cli/json.h"
#include "cli/scene.h"
#include "cli/talk.h"

#include <kiln/world.h>

#include <cstdlib>

namespace kiln::cli {

namespace {

constexpr std::string_view kViews[] = {"shaded", "albedo", "normal", "depth", "steps", "bricks"};

Error usage(const std::string& message) { return {message, ErrorKind::Usage}; }

Result<RenderSettings> settings_of(const PictureOptions& o) {
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
    bool known = false;
    for (size_t i = 0; i < std::size(kViews); ++i) {
        if (o.view != kViews[i]) continue;
        s.view = View(i);
        known = true;
    }
    if (!known) {
        const std::string_view near = nearest_word(o.view, kViews);
        return usage("--view " + o.view + ": there is no such view; " +
                     (near.empty() ? "use shaded, albedo, normal, depth, steps or bricks"
                                   : "did you mean " + std::string(near) + "?"));
    }
    if (o.unpruned && !o.analytic) return usage("--unpruned works with --analytic; add it");
    if (o.reference < 0) return usage("--reference takes a number of samples above 0");
    s.analytic = o.analytic;
    s.unpruned = o.unpruned;
    s.accelerate = !o.no_accelerate;
    s.atlas_by_copy = o.atlas_by_copy;
    return s;
}

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

std::string brief(double value, const char* unit) {
    char buffer[64];
    std::snprintf(buffer, sizeof buffer, value < 10 ? "%.2f %s" : "%.0f %s", value, unit);
    return buffer;
}

void introduce(const RenderStats& stats) {
    std::string kind;
    for (const DeviceInfo& d : devices()) {
        if (d.name != stats.device) continue;
        kind = (d.kind == "cpu" ? std::string(", a CPU renderer") : "") + ", " + d.api_version;
        break;
    }
    const bool display = std::getenv("DISPLAY") || std::getenv("WAYLAND_DISPLAY");
    say("kiln " + std::string(version()) + " — device: " + stats.device + kind +
        (display ? "; windows come with a later version" : "; no display found") + " → rendering to a file");
}

std::string report(const PictureOptions& o, const RenderSettings& s, const RenderStats& stats, const Frame& frame,
                   const World& world, double load, double total) {
    std::string passes;
    for (const auto& [name, ms] : stats.passes)
        passes += (passes.empty() ? "" : ", ") + Json::quoted(name) + ": " + Json::digits(ms);
    Json json;
    json.text("device", stats.device)
        .raw("size", "[" + std::to_string(s.width) + ", " + std::to_string(s.height) + "]");
    json.text("view", o.view).text("output", o.output);
    json.number("edits", stats.edits)
        .number("bricks", stats.bricks)
        .number("frame_ms", stats.frame_ms)
        .raw("passes", "{" + passes + "}");
    json.number("evaluations", double(stats.evaluations)).number("atlas_bytes", double(stats.atlas_bytes));
    json.number("host_bytes", double(stats.host_bytes)).number("pipelines_created", double(stats.pipelines_created));
    json.number("coarsened", frame.coarsened).number("load_s", load).number("total_s", total);
    add_journal(json, world);
    return json.line();
}

}  // namespace

int render_picture(const PictureOptions& o) {
    const auto settings = settings_of(o);
    if (!settings) return fail(settings.error());
    if (auto ok = check_output(o.output); !ok) return fail(ok.error());

    const Stopwatch total;
    Progress progress;
    progress.stage("loading " + o.scene);
    auto world = World::load(o.scene);
    if (!world) return progress.stage(""), fail(world.error());
    progress.stage("finding the surface");
    auto frame = world->frame(o.camera);
    if (!frame) return progress.stage(""), fail(frame.error());
    const double load = total.seconds();

    Result<Picture> picture = Error{};
    RenderStats stats;
    if (o.reference > 0) {
        progress.stage("tracing paths");
        picture = render_reference(*frame, *settings, o.reference, &stats);
    } else {
        progress.stage("starting the device");
        auto renderer = Renderer::create({.device = o.device});
        if (!renderer) return progress.stage(""), fail(renderer.error());
        progress.stage("drawing");
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
    (void)put(report(o, *settings, stats, *frame, *world, load, total.seconds()));
    return finish_data();
}

}  // namespace kiln::cli
