// SPDX-License-Identifier: MIT
// The verbs of the command line, one file each. A verb registers its words and leaves behind what is to run.
#pragma once

#include <CLI/CLI.hpp>

#include <functional>

namespace kiln::cli {

/// Does the verb's work and answers the exit code.
using Run = std::function<int()>;

void add_demo(CLI::App& app, Run& run);
void add_render(CLI::App& app, Run& run);
void add_query(CLI::App& app, Run& run);
void add_import(CLI::App& app, Run& run);
void add_inspect(CLI::App& app, Run& run);
void add_validate(CLI::App& app, Run& run);
void add_schema(CLI::App& app, Run& run);
void add_doctor(CLI::App& app, Run& run);
void add_compare(CLI::App& app, Run& run);
void add_diff(CLI::App& app, Run& run);
void add_new(CLI::App& app, Run& run);
void add_export(CLI::App& app, Run& run);
void add_bench(CLI::App& app, Run& run);
void add_simulate(CLI::App& app, Run& run);
void add_view(CLI::App& app, Run& run);

}  // namespace kiln::cli
