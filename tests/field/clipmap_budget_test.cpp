// SPDX-License-Identifier: MIT
// Starts threads.
// Clipmaps against their budgets: of bricks and of time, and of room in the pool.
#include "clipmaps.h"
#include "rounds.h"

#include <algorithm>
#include <cmath>
#include <optional>

namespace kiln::field {
namespace {

void expect_nested(const Clipmap& map, const std::string& when) { EXPECT_EQ(cells_alone(map), 0) << when; }

TEST(Clipmap, KeepsToItsBudgetAndIsWholeAtOnceAfterATeleport) {
    const auto program = worlds::compiled(country(600));
    Clipmap map = made(program, {0, 0.5, 0}, kSmall);
    const uint32_t budget = 300;
    worlds::Random r(2);
    dvec3 at{0, 0.5, 0};
    uint32_t skipped = 0, sharp = 0, nets = 0, rays = 0;
    for (int frame = 0; frame < 240; ++frame) {
        if (frame % 60 == 59) {
            at = {double(r.in(-60, 60)), 0.5, double(r.in(-60, 60))};
        } else if (frame >= 120) {
            at.x += at.x > 0 ? -5 : 5;  // 300 m/s
        }
        map.move(at);
        map.work({.bricks = budget});
        for (int level = 0; level < 4; ++level) {
            skipped += map.counts(level).skipped;
            if (map.counts(level).skipped) {
                EXPECT_EQ(map.counts(level).baked, 0u);
            }
        }
        ASSERT_LE(baked(map), budget) << "frame " << frame;
        const bool looks = !kSanitized || frame % 4 == 0;
        if (looks) {
            ASSERT_EQ(holes(map), 0) << "the picture has a hole in frame " << frame;
        }
        if (frame < 120 && frame % 60 == 58) sharp += map.counts(0).missing_cells == 0;
        if (map.shown_levels() > 4) {
            ++nets;
            // No ray down ends in nothing.
            for (int i = 0; i < rounds(100); ++i, ++rays) {
                const dvec3 from{at.x + double(r.in(-20, 20)), 15, at.z + double(r.in(-20, 20))};
                ASSERT_NE(map.cast(from, normalize(vec3{r.in(-0.3f, 0.3f), -1, r.in(-0.3f, 0.3f)}), 1e6).state,
                          kMarchMiss);
            }
        } else if (looks) {
            for (uint32_t slot = 0; slot < map.slot_count(); ++slot) ASSERT_LT(map.records()[slot].level, 4u);
        }
        if (frame % 20 == 3) {
            expect_nested(map, "frame " + std::to_string(frame));
            expect_true_words(map, frame / 20 % 4);
        }
    }
    EXPECT_GT(nets, 5u) << "the last level never had to wait";
    EXPECT_LT(nets, 200u) << "it never caught up";
    EXPECT_GT(skipped, 50u) << "nothing was too fast";
    EXPECT_EQ(sharp, 2u) << "it never sharpened";
    for (int frame = 0; frame < 60 && !map.work({.bricks = budget}); ++frame) {}
    for (int level = 0; level < 4; ++level) EXPECT_EQ(map.counts(level).missing_cells, 0u);
    expect_is_its_program(map, "caught up");
}

// Surfaces in every cell of every level: what is made at once is bounded by the count of cells, wherever the focus is among them.
TEST(Clipmap, ANetsCoarsestLevelNeedsNoMoreThanItsBricksInAnyWorld) {
    std::vector<Edit> edits;
    worlds::Random r(12);
    for (int i = 0; i < 3000; ++i) {
        Edit e = worlds::edit(Sphere{.radius = 1.2f}, r.point(120));
        e.node.transform.scale = vec3{1, 1, 1} * r.in(1, 6);
        edits.push_back(e);
    }
    const auto program = worlds::compiled(edits);
    for (const int cells : {32, 64}) {
        ClipmapOptions options = kSmall;
        options.cells = cells;
        uint32_t most = 0;
        Clipmap map = made(program, {0, 0, 0}, options);
        for (int i = 0; i < 12; ++i) {
            const vec3 at = r.point(40);
            map.move({double(at.x) + 500 * (i % 2), double(at.y), double(at.z)});
            map.move({double(at.x), double(at.y), double(at.z)});
            map.work({.bricks = 0});
            most = std::max(most, baked(map));
            EXPECT_EQ(holes(map), 0);
            EXPECT_EQ(baked(map), map.counts(map.all_levels() - 1).baked) << "nothing else is made at once";
        }
        EXPECT_LE(most, kNetBricks) << cells;
        EXPECT_GT(most, 30u) << cells;
    }
}

TEST(Clipmap, ChangesWhileTheNetIsOutAreShownByItToo) {
    std::vector<Edit> edits = country();
    worlds::Live live(edits);
    Clipmap map = made(live.program(), {0, 0.5, 0}, kSmall);
    map.work();
    map.move({500, 0.5, 0});
    map.work({.bricks = 150});
    map.move({3, 0.5, 0});
    worlds::Random r(4);
    int out = 0, waited = 0;
    for (int frame = 0; frame < 400 && (frame < 12 || map.shown_levels() > 4); ++frame) {
        if (frame < 12) {
            edits.push_back(worlds::edit(Sphere{.radius = r.in(1, 5)}, {r.in(-20, 20), r.in(-2, 2), r.in(-20, 20)},
                                         frame % 2 == 0 ? Op::Subtract : Op::Union));
            map.edit(live.program(), live.become(edits));
            map.move({3.0 + 0.4 * frame, 0.5, 0});
        }
        map.work({.bricks = 30});
        ASSERT_LE(baked(map), 30u + kNetBricks);
        ASSERT_EQ(holes(map), 0);
        if (map.shown_levels() == 4) continue;
        ++out;
        for (int level = 4; level < map.all_levels(); ++level) {
            waited += map.counts(level).edits_waiting > 0;
            if (frame % 4 == 1) expect_is_its_program(map, level, "frame " + std::to_string(frame));
        }
    }
    EXPECT_GT(out, 4);
    EXPECT_GT(waited, 0);
    EXPECT_TRUE(map.work());
    EXPECT_EQ(map.shown_levels(), 4);
    expect_is_its_program(map, "whole");
}

TEST(Clipmap, ATimeBudgetOfNothingStillMakesTheNet) {
    Clipmap map = made(worlds::compiled(country()), {0, 0.5, 0}, kSmall);
    EXPECT_FALSE(map.work({.seconds = 0}));
    EXPECT_EQ(holes(map), 0);
    // Its coarsest level, and nothing else: what is made without asking the clock is bounded by a count.
    const int coarsest = map.all_levels() - 1;
    for (int level = 0; level < coarsest; ++level) EXPECT_EQ(map.counts(level).cells_made, 0u) << level;
    EXPECT_GT(map.counts(coarsest).baked, 0u);
    EXPECT_LE(map.counts(coarsest).baked, kNetBricks);
    EXPECT_FALSE(map.work({.seconds = 0}));
    EXPECT_EQ(baked(map), 0u) << "it is there";
    EXPECT_EQ(holes(map), 0);
    int frames = 0;
    for (; !map.work({.seconds = 0.01}) && frames < 10000; ++frames) {
        if (frames % (frames < 64 ? 8 : 64) == 0) {
            ASSERT_EQ(holes(map), 0);
        }
    }
    EXPECT_GT(frames, 0);
    expect_is_its_program(map, "whole");
}

TEST(Clipmap, APoolTooSmallGivesTheLeastImportantBricksBack) {
    const auto program = worlds::compiled(country(400));
    Clipmap whole = made(program, {0, 0.5, 0}, kSmall);
    whole.work();
    ClipmapOptions options = kSmall;
    options.max_bricks = whole.bricks() - whole.counts(0).bricks / 2;
    Clipmap map = made(program, {0, 0.5, 0}, options);
    map.work();
    EXPECT_EQ(map.bricks(), options.max_bricks);
    EXPECT_GT(map.counts(0).refused_cells, 0u);
    for (int level = 1; level < 4; ++level) EXPECT_EQ(map.counts(level).missing_cells, 0u) << level;
    // What is left are the nearest.
    const auto check = [&](const std::string& when) {
        const auto away = [&](ivec3 c) {
            const double side = double(map.voxel_size(0)) * 7;
            return std::max({std::fabs(c.x + 0.5), std::fabs(c.y + 0.5 - 0.5 / side), std::fabs(c.z + 0.5)});
        };
        double kept = 0, gone = 1e9;
        each_cell(map.window(0), [&](ivec3 c) {
            const uint32_t word = map.cell_word(0, c);
            if (word == kCellMissing) gone = std::min(gone, away(c));
            if ((word & kCellOccupied) != 0 && word != kCellMissing) kept = std::max(kept, away(c));
        });
        EXPECT_LT(kept, gone + 17) << "in blocks of 16 cells, " << when;
        EXPECT_GT(gone, 4) << when;
    };
    check("at first");
    map.work();
    EXPECT_EQ(map.counts(0).baked, 0u) << "steady";
    expect_is_its_program(map, "full");
    // Elsewhere there is room for all.
    map.move({0, 200, 0});
    map.work();
    for (int level = 0; level < 4; ++level) EXPECT_EQ(map.counts(level).missing_cells, 0u);
    // And back: a level that needs room takes it from a finer one.
    map.move({0, 0.5, 0});
    map.work();
    for (int level = 1; level < 4; ++level) EXPECT_EQ(map.counts(level).missing_cells, 0u);
    expect_is_its_program(map, "full again");
    // A change that coarse levels need more bricks for.
    std::vector<Edit> more = country(400);
    for (int i = 0; i < 60; ++i)
        more.push_back(worlds::edit(Sphere{.radius = 1}, {-24 + 8.0f * float(i % 8), 4, -24 + 8.0f * float(i / 8)}));
    worlds::Live live(country(400));
    map = made(live.program(), {0, 0.5, 0}, options);
    map.work();
    map.edit(live.program(), live.become(more));
    const uint32_t before = map.counts(0).bricks;
    map.work();
    EXPECT_LT(map.counts(0).bricks, before);
    EXPECT_GT(map.counts(0).evicted, 0u);
    for (int level = 1; level < 4; ++level) EXPECT_EQ(map.counts(level).missing_cells, 0u) << level;
    check("after the change");
}

// What a view shows is made first also where it is far and the pool has room for the near alone: in the end the nearest are there.
TEST(Clipmap, APoolTooSmallKeepsTheNearestWhateverTheViewShows) {
    const auto program = worlds::compiled(country(400));
    Clipmap whole = made(program, {0, 0.5, 0}, kSmall);
    whole.work();
    ClipmapOptions options = kSmall;
    options.max_bricks = whole.bricks() - whole.counts(0).bricks / 2;
    const auto filled = [&](const std::optional<BakeView>& view) {
        Clipmap map = made(program, {300, 0.5, 0}, options);
        map.work();
        map.move({0, 0.5, 0});
        for (int frame = 0; frame < 100; ++frame) map.work({.bricks = 300}, view);
        return map;
    };
    const Clipmap with = filled(BakeView{{0, 0.5, 0}, {1, 0, 0}, {0, 0, 0.7f}, {0, 0.4f, 0}}), without = filled({});
    EXPECT_EQ(with.bricks(), options.max_bricks);
    for (int level = 0; level < 4; ++level) EXPECT_EQ(with.counts(level).bricks, without.counts(level).bricks) << level;
    EXPECT_EQ(with.counts(0).baked, 0u) << "what finds no room is made again and again";
    EXPECT_EQ(without.counts(0).baked, 0u) << "likewise, without a view";
    double kept = 0, gone = 1e9;
    each_cell(with.window(0), [&](ivec3 c) {
        const double away = std::max({std::fabs(c.x + 0.5), std::fabs(c.y + 0.5), std::fabs(c.z + 0.5)});
        const uint32_t word = with.cell_word(0, c);
        if (word == kCellMissing) gone = std::min(gone, away);
        if ((word & kCellOccupied) != 0 && word != kCellMissing) kept = std::max(kept, away);
    });
    EXPECT_LT(kept, gone + 17) << "in blocks of 16 cells";
    expect_nested(with, "full");
}

// A change of all levels at once, the last too, is made within the budget, and each level goes over to it when it is whole.
TEST(Clipmap, ChangesKeepToTheBudgetInTheLastLevelToo) {
    worlds::Live live(country(200));
    Clipmap map = made(live.program(), {0, 0.5, 0}, kSmall);
    map.work();
    std::vector<Edit> edits = country(200);
    edits.push_back(worlds::edit(Box{.half_extents = {40, 1, 40}}));
    map.edit(live.program(), live.become(edits));
    int frames = 0;
    for (bool done = false; !done && frames < 200; ++frames) {
        done = map.work({.bricks = 150});
        ASSERT_LE(baked(map), 150u);
        ASSERT_EQ(holes(map), 0);
    }
    EXPECT_GT(frames, 3);
    EXPECT_LT(frames, 200);
    for (int level = 0; level < 4; ++level) EXPECT_EQ(map.level_program(level), map.program());
}

// What a full pool gives back lies farther off than all that it keeps of that level.
TEST(Clipmap, VictimsAreTheFarthestOfTheFinestLevel) {
    worlds::Live live(country(400));
    Clipmap whole = made(live.program(), {0, 0.5, 0}, kSmall);
    whole.work();
    ClipmapOptions options = kSmall;
    options.max_bricks = whole.bricks();
    Clipmap map = made(live.program(), {0, 0.5, 0}, options);
    map.work();
    ASSERT_EQ(map.counts(0).missing_cells, 0u);
    const Clipmap before = map;
    // Balls that only coarse levels see.
    std::vector<Edit> edits = country(400);
    for (int i = 0; i < 12; ++i)
        edits.push_back(worlds::edit(Sphere{.radius = 2}, {-18 + 3.2f * float(i), 6, i % 2 == 0 ? 18.0f : -18.0f}));
    map.edit(live.program(), live.become(edits));
    map.work();
    const double side = double(map.voxel_size(0)) * 7;
    double kept = 0, gone = 1e9;
    uint32_t given = 0;
    each_cell(map.window(0), [&](ivec3 c) {
        const uint32_t was = before.cell_word(0, c), word = map.cell_word(0, c);
        if ((was & kCellOccupied) == 0) return;
        const double away = std::max({std::fabs(c.x + 0.5), std::fabs(c.y + 0.5 - 0.5 / side), std::fabs(c.z + 0.5)});
        if (word == kCellMissing) {
            gone = std::min(gone, away);
            ++given;
        } else {
            kept = std::max(kept, away);
        }
    });
    EXPECT_GT(given, 20u);
    EXPECT_EQ(map.counts(0).evicted, given);
    EXPECT_EQ(map.counts(0).refused_cells, given);
    EXPECT_LE(kept, gone) << "something nearer was given back";
    for (int level = 1; level < 4; ++level) EXPECT_EQ(map.counts(level).evicted, 0u) << level;
}

}  // namespace
}  // namespace kiln::field
