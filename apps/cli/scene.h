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
/// Why no scene can be written there: its name does not end in .kiln.json, a file is there (unless `force`), or none can be made. Known
/// before any work is done. Results are written over unasked, as compilers do; scenes are what people make.
Result<void> writable_scene(const std::string& path, bool force);
/// Why a result cannot be written there: the scene is read from it.
Result<void> not_read(const World& world, const std::string& output);
/// "journal": {…} where there is one to tell of.
void add_journal(Json& json, const World& world);

}  // namespace kiln::cli
