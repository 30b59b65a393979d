// SPDX-License-Identifier: MIT

#include "cli/scene.h"

#include "cli/talk.h"

#include <filesystem>

namespace kiln::cli {

void tell_journal(const World& world) {
    if (const auto report = world.journal_report()) say(report->sentence());
}

Result<World> load_scene(const std::string& path_or_name) {
    auto world = World::load(path_or_name);
    if (world) tell_journal(*world);
    return world;
}

void add_journal(Json& json, const World& world) {
    const auto report = world.journal_report();
    if (!report) return;
    Json one;
    one.text("file", report->file).number("commands", double(report->commands));
    one.number("dropped_bytes", double(report->dropped_bytes)).flag("foreign", report->foreign);
    json.raw("journal", one.object());
}

Result<void> writable_scene(const std::string& path, bool force) {
    if (!path.ends_with(".kiln.json")) return usage(path + ": a scene's name ends in .kiln.json");
    std::error_code ignored;
    for (const std::string& file : {path, path + ".journal"})
        if (!force && std::filesystem::exists(file, ignored))
            return Error{file + ": is there already; choose another name, or add --force to write over it",
                         ErrorKind::Failed};
    return writable(path);
}

Result<void> not_read(const World& world, const std::string& output) {
    if (!world.is_read_from(output)) return {};
    return usage(output + ": the scene is read from it; choose another name");
}

}  // namespace kiln::cli
