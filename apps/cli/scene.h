// SPDX-License-Identifier: MIT
// Loading a scene for a verb, with its journal, which is told on stderr and in reports; and where one may be written.
#pragma once

#include "cli/json.h"

#include <kiln/world.h>

#include <string>

namespace kiln::cli {

/// A line on stderr where a journal added something to the scene, or could not be read to its end.
void tell_journal(const World& world);
/// World::load(), told.
Result<World> load_scene(const std::string& path_or_name);
/// Why no scene can be written there: its name does not end in .kiln.json, or the file cannot be made. Known before any work is done.
Result<void> writable_scene(const std::string& path);
/// "journal": {…} where there is one to tell of.
void add_journal(Json& json, const World& world);

}  // namespace kiln::cli
