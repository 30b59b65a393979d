// SPDX-License-Identifier: MIT
// Starts threads.
// What a clipmap counts, against counting its cells before and after.
#include "clipmaps.h"

namespace kiln::field {
namespace {

struct Cells {
    uint32_t bricks = 0, missing = 0;
};
Cells cells_of(const Clipmap& map, int level) {
    Cells out;
    each_cell(map.window(level), [&](ivec3 c) {
        const uint32_t word = map.cell_word(level, c);
        out.missing += word == kCellMissing;
        out.bricks += (word & kCellOccupied) != 0 && word != kCellMissing;
    });
    return out;
}
const HalfCodes* brick_at(const Clipmap& map, int level, ivec3 c) {
    if (!contains(map.window(level), c)) return nullptr;
    const uint32_t word = map.cell_word(level, c);
    if ((word & kCellOccupied) == 0 || word == kCellMissing) return nullptr;
    return map.content(word & kCellSlotMask).half.get();
}
// Of the cells of `before`, those with a brick that `after` has not.
uint32_t lost(const Clipmap& before, const Clipmap& after, int level) {
    uint32_t out = 0;
    each_cell(before.window(level),
              [&](ivec3 c) { out += brick_at(before, level, c) != nullptr && brick_at(after, level, c) == nullptr; });
    return out;
}
// Of the cells of `after`, those with a brick that is another than `before` has.
uint32_t fresh(const Clipmap& before, const Clipmap& after, int level) {
    uint32_t out = 0;
    each_cell(after.window(level), [&](ivec3 c) {
        const HalfCodes* const brick = brick_at(after, level, c);
        out += brick != nullptr && brick != brick_at(before, level, c);
    });
    return out;
}
void expect_counted(const Clipmap& map, const std::string& when) {
    uint32_t all = 0;
    for (int level = 0; level < map.all_levels(); ++level) {
        if (level >= map.shown_levels()) {
            EXPECT_EQ(map.counts(level).bricks, 0u) << when;
            continue;
        }
        const Cells cells = cells_of(map, level);
        EXPECT_EQ(map.counts(level).bricks, cells.bricks) << when << ", level " << level;
        EXPECT_EQ(map.counts(level).missing_cells, cells.missing) << when << ", level " << level;
        all += cells.bricks;
    }
    EXPECT_EQ(map.bricks(), all) << when;
}

TEST(ClipmapCounts, QueuedBakedAndEvictedAreWhatCameWasMadeAndWent) {
    std::vector<Edit> edits = country(300);
    worlds::Live live(edits);
    Clipmap map = made(live.program(), {0, 0.5, 0}, kSmall);
    map.work();
    const dvec3 places[] = {{0.9, 0.5, 0}, {0.9, 0.8, -2.1}, {5, 0.5, 1}, {90, 0.5, 40}, {88, 0.5, 40}, {0, 0.5, 0}};
    for (const dvec3 place : places) {
        const std::string where = std::to_string(place.x);
        const Clipmap before = map;
        map.move(place);
        for (int level = 0; level < 4; ++level) {
            const CellBox old = before.window(level), now = map.window(level);
            uint32_t came = 0, missing = 0;
            each_cell(now, [&](ivec3 c) {
                came += !contains(old, c);
                missing += !contains(old, c) || before.cell_word(level, c) == kCellMissing;
            });
            EXPECT_EQ(map.counts(level).entered_cells, came) << where;
            EXPECT_EQ(map.counts(level).missing_cells, missing) << where;
            EXPECT_EQ(map.counts(level).evicted, lost(before, map, level)) << where;
        }
        expect_counted(map, "moved to " + where);
        for (const uint32_t budget : {170u, 400u, 1000000u}) {
            const Clipmap moved = map;
            map.work({.bricks = budget});
            for (int level = 0; level < map.shown_levels(); ++level)
                EXPECT_EQ(map.counts(level).baked, fresh(moved, map, level)) << where << " level " << level;
            expect_counted(map, "made at " + where);
        }
        // And what an edit reaches.
        edits.push_back(worlds::edit(Sphere{.radius = 0.4f}, {float(place.x), 0, float(place.z)}, Op::Subtract));
        const Clipmap whole = map;
        map.edit(live.program(), live.become(edits));
        map.work({.bricks = 0});
        for (int level = 0; level < 4; ++level)
            EXPECT_EQ(map.counts(level).edits_waiting, map.level_program(level) != map.program() ? 1u : 0u) << level;
        map.work();
        for (int level = 0; level < 4; ++level) {
            EXPECT_EQ(map.counts(level).baked, fresh(whole, map, level)) << where << " level " << level;
            EXPECT_EQ(map.counts(level).evicted, whole.counts(level).evicted) << "since the move";
        }
        expect_counted(map, "edited at " + where);
    }
}

// Of 4 levels, the pool holds all but half of the finest one's bricks.
TEST(ClipmapCounts, RefusedAndGivenBackAreTheCellsThatFoundNoRoom) {
    const auto program = worlds::compiled(country(400));
    Clipmap whole = made(program, {0, 0.5, 0}, kSmall);
    whole.work();
    ClipmapOptions options = kSmall;
    options.max_bricks = whole.bricks() - whole.counts(0).bricks / 2;
    Clipmap map = made(program, {0, 0.5, 0}, options);
    map.work();
    const auto check = [&](const std::string& when) {
        for (int level = 0; level < 4; ++level)
            EXPECT_EQ(map.counts(level).refused_cells, cells_of(map, level).missing) << when << ", level " << level;
        expect_counted(map, when);
    };
    check("at first");
    // Of all bricks that the world has there: those that are not in the pool.
    EXPECT_EQ(map.counts(0).refused_cells, whole.counts(0).bricks - map.counts(0).bricks);
    EXPECT_EQ(map.bricks(), options.max_bricks);
    uint32_t given = 0;
    for (const dvec3 place : {dvec3{0.8, 0.5, 0}, dvec3{1.7, 0.5, 1}, dvec3{-40, 0.5, 20}, dvec3{0, 0.5, 0}}) {
        map.move(place);
        const Clipmap moved = map;
        map.work();
        for (int level = 0; level < 4; ++level) {
            // Each brick that was made is there, was given back again or found no room; and so is each cell that is missing.
            const uint32_t gone = lost(moved, map, level), missing = map.counts(level).missing_cells;
            EXPECT_EQ(map.counts(level).baked, fresh(moved, map, level) + missing - gone) << level;
            EXPECT_GE(map.counts(level).evicted - moved.counts(level).evicted, gone) << level;
            given += lost(moved, map, level);
        }
        check("at " + std::to_string(place.x));
    }
    EXPECT_GT(given, 0u);
}

}  // namespace
}  // namespace kiln::field
