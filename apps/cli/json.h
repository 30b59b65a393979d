// SPDX-License-Identifier: MIT
// What `--json` prints is written as the player writes.
#pragma once

#include "player/json.h"

namespace kiln::cli {

using player::Json;

}  // namespace kiln::cli
