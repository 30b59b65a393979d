// SPDX-License-Identifier: MIT
// The journal of a scene file: SCENE.journal, a record file (base/record_file.h) of JSON lines that continues the scene whose hash its
// header names. A record is a command (scene/command.h), or
//   {"begin": TITLE} … {"end": true} | {"cancel": true}    the commands between are one step, or none
//   {"step": TITLE, "commands": […]}                       a step at once
//   {"go": N}        to the state after the step that record N began; 0: the scene file
//   {"saved": HASH}  the state here is the scene of this hash
// Saving writes `saved`, then the scene file (a rename), then empties the journal. Whatever of that a kill leaves, the scene file is
// the header's or that of a `saved`: what is behind the last such place is applied to it, and nothing is lost or done twice.
#pragma once

#include "scene/scene_file.h"

#include "base/record_file.h"

#include <kiln/world.h>

#include <memory>
#include <string>

namespace kiln::scene {

struct Journal {
    std::string scene;  ///< the file
    RecordFile file;
};

/// Of a scene file; a link's journal is beside what it leads to.
std::string journal_path(const std::string& scene);
bool same_file(const std::string& a, const std::string& b);

/// How much of a journal a scene of this hash has behind it.
struct JournalStart {
    bool foreign = true;
    size_t first = 0;       ///< record to begin with
    uint32_t sequence = 0;  ///< by which the journal names the scene's own state
};
JournalStart find_start(const Records& records, const Hash128& scene);

// Records that are no commands.
std::string saved_record(const Hash128& scene);
std::string go_record(uint32_t sequence);
std::string begin_record(const std::string& title);
std::string step_record(const std::string& title, const std::vector<std::string>& commands);
inline constexpr std::string_view kEndRecord = "{\"end\":true}", kCancelRecord = "{\"cancel\":true}";

}  // namespace kiln::scene
