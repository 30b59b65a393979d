// SPDX-License-Identifier: MIT
// The net under a clipmap: levels coarser than the last one, for no more than the last one draws. After a jump the last level may have more
// bricks to make than a frame has; until it has them, the picture is drawn from the net wherever it has none.
//
// Each of the net's levels has the last one's extent in half as many cells a side as the level before it, so the coarsest needs no more than
// kNetBricks bricks, whatever the world is. The finest one that needs no more than a frame has, in the worst of worlds, is made at once: so no
// frame exceeds its budget where that is kNetBricks or more, and none shows a hole. Where a frame has so much time, how many bricks that is
// is not known: then the net is its coarsest level alone. The levels between are left out: each would cost about
// what the last level costs, since what coarse bricks lack in number their code has in length. Where the last level ends, the picture has a
// step until it is whole. A net that is not needed has no bricks, and no change costs it anything.

#include "field/clipmap.h"

#include <algorithm>
#include <bit>

namespace kiln::field {

// What is drawn of the last level is at most cells - 4 cells long, which are in (cells - 6) / 2^n + 2 cells of the net's n-th level: 5, where
// 2^n is a quarter of a level's cells.
int Clipmap::net_levels(const ClipmapOptions& options) {
    return std::min(int(std::bit_width(uint32_t(options.cells))) - 3, kMostLevels - options.levels);
}

// In cells of a level of the net: what covers all that is drawn of the last level.
CellBox Clipmap::net_part(int level) const {
    const int last = options_.levels - 1, by = level - last;
    const CellBox box = drawn(last);
    const auto first = [&](int a) { return a >> by; };
    const auto end = [&](int a) { return ((a - 1) >> by) + 1; };
    return {{first(box.min.x), first(box.min.y), first(box.min.z)}, {end(box.max.x), end(box.max.y), end(box.max.z)}};
}

bool Clipmap::has_missing(int level, const CellBox& box) const {
    const CellMap& cells = levels_[size_t(level)].cells;
    for (int z = box.min.z; z < box.max.z; ++z) {
        for (int y = box.min.y; y < box.max.y; ++y) {
            for (int x = box.min.x; x < box.max.x; ++x) {
                if (cells.at(x, y, z) == kCellMissing) return true;
            }
        }
    }
    return false;
}

// Something that is drawn of the last level is missing. All its missing cells are in blocks that are queued or were refused.
bool Clipmap::needs_net() const {
    const int last = options_.levels - 1;
    const Level& l = levels_[size_t(last)];
    const CellBox box = drawn(last);
    const auto holds_missing = [&](ivec3 block) {
        return has_missing(last,
                           {{std::max(block.x, box.min.x), std::max(block.y, box.min.y), std::max(block.z, box.min.z)},
                            {std::min(block.x + kBlockCells, box.max.x), std::min(block.y + kBlockCells, box.max.y),
                             std::min(block.z + kBlockCells, box.max.z)}});
    };
    return std::any_of(l.blocks.begin(), l.blocks.end(), holds_missing) ||
           std::any_of(l.refused.begin(), l.refused.end(), holds_missing);
}

// Makes what the picture needs of a level of the net. True when it has all of that.
bool Clipmap::fill_net(int level, Run& run) {
    Level& l = levels_[size_t(level)];
    const CellBox part = net_part(level);
    l.blocks.clear();
    l.refused.clear();
    if (has_missing(level, part)) queue_blocks(l, part);
    const bool done = fill(level, run, part);
    l.blocks.clear();
    return done;
}

// What is to be drawn of the last level is there: the net goes.
void Clipmap::drop_net() {
    net_ = false;
    for (uint32_t slot = 0; slot < pool_.slot_count(); ++slot) {
        const uint32_t level = records_[slot].level;
        if (!pool_.used(slot) || level < uint32_t(options_.levels)) continue;
        release(slot);
        room_ = true;
    }
    for (int level = options_.levels; level < all_levels(); ++level) {
        Level& l = levels_[size_t(level)];
        l.cells = nothing_;
        l.counts.missing_cells = all_cells();
        l.counts.bricks = 0;
        l.rough = RoughCells(options_.cells);
        l.refused.clear();
        forget_changes(l);
    }
}

}  // namespace kiln::field
