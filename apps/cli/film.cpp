// SPDX-License-Identifier: MIT

#include "cli/film.h"

#include "cli/talk.h"

#include <cstdio>
#include <vector>

namespace kiln::cli {

namespace {

// Views that are lines over the shaded picture.
struct LinesView {
    std::string_view name;
    PlayLines lines;
};
constexpr LinesView kLinesViews[] = {
    {"contacts", {.contacts = true}}, {"shapes", {.shapes = true}}, {"sleeping", {.sleeping = true}}};

std::string name_of(const std::string& folder, int picture) {
    char name[32];
    std::snprintf(name, sizeof name, "/frame_%05d.png", picture);
    return folder + name;
}

}  // namespace

Result<Film> Film::open(const World& world, PictureOptions options, const std::string& folder) {
    PlayLines lines;
    for (const LinesView& view : kLinesViews) {
        if (options.view != view.name) continue;
        lines = view.lines;
        options.view = "shaded";
    }
    std::vector<std::string_view> views{"shaded"};
    for (const LinesView& view : kLinesViews) views.push_back(view.name);
    if (const std::string_view near = nearest_word(options.view, views); !near.empty() && near != options.view)
        return usage("--view " + options.view + ": there is no such view; did you mean " + std::string(near) + "?");
    auto settings = picture_settings(options);
    if (!settings) return settings.error();
    if (auto ok = writable(name_of(folder, 0)); !ok) return ok.error();
    auto camera = world.camera(options.camera);
    if (!camera) return camera.error();
    auto renderer = Renderer::create({.device = options.device});
    if (!renderer) return renderer.error();
    Film out(std::move(*renderer), folder);
    out.settings_ = *settings;
    out.camera_ = *camera;
    out.lines_ = lines;
    (void)choose_quality(options, out.renderer_, out.settings_);
    return out;
}

Result<void> Film::shoot(Play& play) {
    auto frame = play.frame(camera_, lines_);
    if (!frame) return frame.error();
    auto picture = renderer_.render(*frame, settings_);
    if (!picture) return picture.error();
    if (auto ok = picture->save(name_of(folder_, count_)); !ok) return ok;
    ++count_;
    return {};
}

}  // namespace kiln::cli
