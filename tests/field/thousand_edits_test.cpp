// SPDX-License-Identifier: MIT
// Starts threads.
// A thousand changes of a world and the undo of all of them: what is updated is, bit for bit, what is built from nothing.
#include "field/field.h"
#include "field/host_bricks.h"

#include "worlds.h"

#include <gtest/gtest.h>

#include <vector>

namespace kiln::field {
namespace {

void expect_rebuilt(const HostBricks& host, const worlds::World& world, const char* when, int step) {
    ASSERT_EQ(host.hash(), HostBricks::bake(world.field()).hash()) << when << ' ' << step;  // in order of cells
}

TEST(ThousandEditsSlow, AndTheUndoOfAllOfThemAreARebuildBitForBit) {
    constexpr int kEdits = 1000, kLook = 8;
    for (const uint32_t seed : {1u, 2u}) {
        worlds::World world = worlds::jumble(seed, 40);
        world.options.format = seed == 2 ? DistanceFormat::Snorm8 : DistanceFormat::Half;
        worlds::Random random(seed + 300);
        worlds::Live live(world.edits);
        HostBricks host = *HostBricks::build(live.program(), world.options);
        const uint64_t start = host.hash();
        std::vector<std::vector<Edit>> before;
        int made[4] = {};
        for (int step = 0; step < kEdits; ++step) {
            before.push_back(world.edits);
            std::vector<Edit>& edits = world.edits;
            const auto any = [&] { return ptrdiff_t(random.below(int(edits.size()))); };
            const int what = edits.size() < 20 ? 0 : edits.size() > 60 ? 1 : random.below(4);
            ++made[what];
            if (what == 0) {
                edits.insert(edits.begin() + any(), random.edit(1));
            } else if (what == 1) {
                edits.erase(edits.begin() + any());
            } else if (what == 2) {
                edits[size_t(any())].node.transform.position = random.point(1);
            } else {
                const ptrdiff_t from = any();
                const Edit moved = edits[size_t(from)];
                edits.erase(edits.begin() + from);
                edits.insert(edits.begin() + any(), moved);
            }
            const std::vector<RowChange> changes = live.become(edits);
            ASSERT_TRUE(host.update(live.program(), changes));
            if (step % kLook == 0) expect_rebuilt(host, world, "step", step);
            if (HasFatalFailure()) return;
        }
        for (const int count : made) EXPECT_GT(count, 100);
        for (int step = kEdits; step-- > 0;) {
            world.edits = before[size_t(step)];
            const std::vector<RowChange> changes = live.become(world.edits);
            ASSERT_TRUE(host.update(live.program(), changes));
            if (step % (4 * kLook) == 0) expect_rebuilt(host, world, "undo", step);
            if (HasFatalFailure()) return;
        }
        EXPECT_EQ(host.hash(), start);
    }
}

// Ten thousand digs in one place are no dearer than one: where a later edit wins by more than a brick can change, all before it goes.
TEST(ThousandEdits, AHistoryUnderALaterEditCostsItsBricksNothing) {
    worlds::Random random(6);
    worlds::World world{"history", {}, {.voxel_size = 0.03f, .bounds = {{-1, -1, -1}, {1, 1, 1}}}};
    for (int i = 0; i < 3000; ++i)
        world.edits.push_back(
            worlds::edit(Sphere{.radius = 0.1f}, random.point(0.15f), i % 3 == 2 ? Op::Subtract : Op::Union));
    const auto longest = [](const Field& field) {
        size_t out = 0;
        for (const uint32_t slot : field.slots()) out = std::max<size_t>(out, field.code_of(slot).size());
        return out;
    };
    EXPECT_GT(longest(*world.field()), 100u);
    world.edits.push_back(worlds::edit(Sphere{.radius = 0.8f}));
    const auto covered = world.field();
    EXPECT_LE(longest(*covered), 4u);
    EXPECT_EQ(HostBricks::bake(covered).hash(),
              HostBricks::bake(worlds::World{"ball", {world.edits.back()}, world.options}.field()).hash());
    // Dug away again, and something put there: a cut starts the list as an end of everything.
    world.edits.push_back(worlds::edit(Box{.half_extents = {0.95f, 0.95f, 0.95f}}, {}, Op::Subtract));
    world.edits.push_back(worlds::edit(Sphere{.radius = 0.2f}));
    const auto dug = world.field();
    EXPECT_GT(dug->stats().bricks, 8u);
    EXPECT_LE(longest(*dug), 4u);
}

}  // namespace
}  // namespace kiln::field
