// SPDX-License-Identifier: MIT
// What stands over the picture: a bar of hints, a passing message, the profiler.
#pragma once

#include "player/canvas.h"

#include <string>
#include <utility>
#include <vector>

namespace kiln::player {

struct Hud {
    std::string message;                ///< shown above the hints; empty: none
    std::vector<std::string> profiler;  ///< lines; empty: not shown
    std::vector<std::string> help;      ///< likewise, in the middle
    bool hints = true, walks = false;   ///< walks: the middle of the picture is marked, and hints are of walking

    /// Draws over the picture and answers where each part is, by id.
    std::vector<std::pair<std::string, Rect>> draw(Picture& picture) const;
};

}  // namespace kiln::player
