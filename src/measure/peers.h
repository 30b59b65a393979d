// SPDX-License-Identifier: MIT
// Finds the plug-in of peers (peer_table.h): the file that KILN_PEERS names, or kiln_peers.so beside the program.
#pragma once

#include "measure/peer_table.h"

#include <kiln/edit.h>

#include <memory>
#include <span>
#include <vector>

namespace kiln::measure {

/// Null where there is none, or it is of another version. Stays loaded.
const KilnPeerTable* peers();

/// Edits of recipes.h (spheres and boxes that join or cut) as peers read them.
std::vector<KilnPeerEdit> peer_edits(std::span<const Edit> edits);

struct ReleasePeerGrid {
    void operator()(void* grid) const { peers()->release(grid); }
};
using PeerGrid = std::unique_ptr<void, ReleasePeerGrid>;

}  // namespace kiln::measure
