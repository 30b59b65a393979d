// SPDX-License-Identifier: MIT
// kiln diff A B: how two scenes differ, by the ids of their edits. As diff(1): 0 when they are the same, 1 when they are not.

#include "cli/scene.h"
#include "cli/talk.h"
#include "cli/verbs.h"

#include <memory>

namespace kiln::cli {

namespace {

struct DiffOptions {
    std::string a, b;
    bool json = false;
};

int diff(const DiffOptions& o) {
    const auto a = load_scene(o.a);
    if (!a) return fail(a.error());
    const auto b = load_scene(o.b);
    if (!b) return fail(b.error());
    const SceneDifference difference = compare_scenes(*a, *b);
    (void)put(o.json ? difference.json : difference.lines);
    const int written = finish_data();
    if (written != kDone) return kBadInput;  // 1 would say that they differ
    return difference.equal ? 0 : 1;
}

}  // namespace

void add_diff(CLI::App& app, Run& run) {
    auto o = std::make_shared<DiffOptions>();
    CLI::App* verb = app.add_subcommand(
        "diff",
        "Tells how two scenes differ, by the ids of their edits.\n\n"
        "Lines begin with + (only in B), - (only in A), ~ (changed) or < (moved). The exit code is 0\n"
        "when the scenes are the same, 1 when they differ, 3 when one cannot be read.\n\n"
        "Examples:\n"
        "  kiln diff before.kiln.json after.kiln.json\n"
        "  kiln diff potter my-potter.kiln.json --json");
    verb->add_option("A", o->a, "a scene file, or a bundled scene's name")->required();
    verb->add_option("B", o->b, "another")->required();
    verb->add_flag("--json", o->json, "one object, on stdout");
    verb->callback([o, &run] { run = [o] { return diff(*o); }; });
}

}  // namespace kiln::cli
