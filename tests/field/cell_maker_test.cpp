// SPDX-License-Identifier: MIT
// How far an edit that leaves the list is felt: as far as the edits after it lead its values, and no farther.
#include "field/cell_maker.h"

#include "field/host_bricks.h"
#include "worlds.h"

#include <gtest/gtest.h>

namespace kiln::field {
namespace {

// A small ball, one that stands far from it, and one that blends with all before it, as widely as the gap between them.
std::vector<Edit> bridge() {
    return {worlds::edit(Sphere{.radius = 0.05f}, {0, 0.4f, 0}), worlds::edit(Sphere{.radius = 0.3f}, {-0.5f, 0, 0}),
            worlds::edit(Sphere{.radius = 0.3f}, {0.5f, 0, 0}, Op::Union, 0.9f)};
}
worlds::World world() {
    return {"bridge", bridge(), {.voxel_size = 0.03f, .bounds = {{-0.9f, -0.5f, -0.5f}, {0.9f, 0.5f, 0.5f}}}};
}
int64_t cells_in(const CellBox& b) {
    const ivec3 size = b.max - b.min;
    return int64_t(size.x) * size.y * size.z;
}

TEST(CellMaker, WhatLeavesIsFeltAsFarAsLaterEditsLeadIt) {
    std::vector<Edit> edits = bridge();
    edits.push_back(worlds::edit(Sphere{.radius = 0.05f}, {0, 0.4f, 0}));
    const auto compiled = sdf::compile({edits, {}, {}});
    ASSERT_TRUE(compiled);
    sdf::Program list = *compiled;
    const CellLattice lattice{{0, 0, 0}, 0.03f, 1, 1, {}};
    const CellBox first = cells_reached(list, 0, lattice, false).stored;
    const CellBox last = cells_reached(list, 3, lattice, false).stored;
    EXPECT_LT(cells_in(last), cells_in(first)) << "nothing after the last blends";
    list.remove(0);
    list.remove(3);
    EXPECT_EQ(cells_in(cells_reached(list, 0, lattice, false).stored), cells_in(first));
    EXPECT_EQ(cells_in(cells_reached(list, 3, lattice, false).stored), cells_in(last));
    EXPECT_EQ(cells_in(cells_reached(list, 3, lattice, true).stored), cells_in(first)) << "its place is not known";
}

// The ball that led to the bridge leaves; the bridge is far from it.
TEST(CellMaker, ABridgeGoesWithTheBallItLedFrom) {
    for (const bool renumbered : {false, true}) {
        const worlds::World w = world();
        sdf::Program list = *worlds::compiled(w.edits);
        HostBricks host = *HostBricks::build(worlds::compiled(w.edits), w.options);
        list.remove(0);
        list.remove(1);
        // The list has new numbers, by which what is left comes before what left.
        if (renumbered) list.number_anew(std::vector<uint32_t>{2});
        list.settle();
        const RowChange changes[] = {{0, kNoRow}, {1, kNoRow}};
        const auto after = std::make_shared<const sdf::Program>(list);
        ASSERT_TRUE(host.update(after, changes));
        EXPECT_EQ(host.hash(), HostBricks::build(after, w.options)->hash()) << (renumbered ? "renumbered" : "");
    }
}

}  // namespace
}  // namespace kiln::field
