// SPDX-License-Identifier: MIT
// kiln VERB ...: finds the verb, and turns every way of ending into its exit code.
// 0 done, 1 failed, 2 wrong usage, 3 bad input, 4 no usable device, 5 out of memory or device lost, 130 interrupted.

#include "cli/talk.h"
#include "cli/verbs.h"

#include <kiln/world.h>

#include <csignal>
#include <memory>
#include <new>
#include <sstream>
#include <unistd.h>

namespace kiln::cli {
namespace {

constexpr std::string_view kVerbs[] = {"demo",    "render",   "query",  "import",   "export",
                                       "inspect", "validate", "schema", "doctor",   "compare",
                                       "diff",    "new",      "bench",  "simulate", "view"};
constexpr std::string_view kLaterVerbs[] = {"edit"};

// In the list of verbs only the first line of each description; its own help shows all of it.
class Help : public CLI::Formatter {
public:
    std::string make_subcommand(const CLI::App* verb) const override {
        std::stringstream out;
        const std::string description = verb->get_description();
        CLI::detail::format_help(out, verb->get_name(), description.substr(0, description.find('\n')), 14);
        return out.str();
    }
};

// Only calls that a signal handler may make.
extern "C" void interrupted(int signal) {
    discard_unfinished_files();
    _exit(128 + signal);
}

template <size_t N>
bool contains(const std::string_view (&list)[N], std::string_view word) {
    for (const std::string_view known : list)
        if (known == word) return true;
    return false;
}

int unknown_verb(const std::string& word) {
    if (contains(kLaterVerbs, word)) {
        say("kiln: `kiln " + word + "` comes with a later version; `kiln --help` lists what there is");
        return kUsage;
    }
    const std::string_view near = nearest_word(word, kVerbs);
    say("kiln: there is no verb \"" + word + "\"; " +
        (near.empty() ? "`kiln --help` lists them" : "did you mean `kiln " + std::string(near) + "`?"));
    return kUsage;
}

int run(int argc, char** argv) {
    if (argc > 1 && argv[1][0] != '-' && !contains(kVerbs, argv[1])) return unknown_verb(argv[1]);

    CLI::App app(
        "Kiln, a game engine whose worlds are signed distance fields.\n\n"
        "Examples:\n"
        "  kiln demo                                    a window on the quarry, or a first picture\n"
        "  kiln render potter -o potter.png             a bundled scene, or a NAME.kiln.json file\n"
        "  kiln query potter --points points.csv        distances, normals and materials\n"
        "  kiln validate my.kiln.json                   errors with line and column",
        "kiln");
    app.formatter(std::make_shared<Help>());
    app.set_version_flag("--version", std::string("kiln ") + std::string(version()));
    app.require_subcommand(0, 1);
    Run verb;
    add_demo(app, verb);
    add_render(app, verb);
    add_query(app, verb);
    add_import(app, verb);
    add_inspect(app, verb);
    add_validate(app, verb);
    add_schema(app, verb);
    add_doctor(app, verb);
    add_compare(app, verb);
    add_diff(app, verb);
    add_new(app, verb);
    add_export(app, verb);
    add_bench(app, verb);
    add_simulate(app, verb);
    add_view(app, verb);
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& e) {
        if (e.get_exit_code() == 0) {
            app.exit(e);  // help or version, on stdout
            return finish_data();
        }
        const auto chosen = app.get_subcommands();
        const std::string name = chosen.empty() ? "kiln" : "kiln " + chosen.front()->get_name();
        std::string message = e.what();
        for (char& c : message)
            if (c == '\n') c = ' ';
        if (constexpr std::string_view kConvert = "Could not convert: "; message.starts_with(kConvert))
            message = message.substr(kConvert.size()) + ": not a value that it takes";
        say(name + ": " + message + "; `" + name + " --help` shows how it is used");
        return kUsage;
    }
    if (!verb) {
        say(app.help());
        return kUsage;
    }
    return verb();
}

}  // namespace
}  // namespace kiln::cli

int main(int argc, char** argv) {
    std::signal(SIGINT, kiln::cli::interrupted);
    std::signal(SIGTERM, kiln::cli::interrupted);
    std::signal(SIGPIPE, SIG_IGN);  // a closed pipe is a failed write, which finish_data() tells
    try {
        return kiln::cli::run(argc, argv);
    } catch (const std::bad_alloc&) {
        kiln::cli::say("kiln: out of memory; use a smaller scene or a larger voxel_size");
        return kiln::cli::kOutOfMemory;
    }
}
