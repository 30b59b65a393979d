// SPDX-License-Identifier: MIT
// A thousand small things over hills, twice: as edits of the world, and as instances beside it. Both show the same surfaces, stored as finely, so what
// differs between their pictures' costs is how rays find them.
#pragma once

#include <kiln/renderer.h>

namespace kiln {

struct Thousand {
    Frame still, moving;
};
/// From above the hills, where each is seen, or from among them.
Result<Thousand> thousand(bool from_above);

}  // namespace kiln
