// SPDX-License-Identifier: MIT
// Starts threads.
// In which order a clipmap makes what is asked of it, what its seams do to normals, and long runs of what shorter tests prove.
#include "clipmaps.h"
#include "rounds.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

namespace kiln::field {
namespace {

TEST(Clipmap, WhatIsNearIsMadeFirst) {
    // Windows of four blocks a side: near and far are blocks apart. From so far away that no cell stays.
    Clipmap map = made(worlds::compiled(country(400)), {300, 0.5, 0}, {.voxel_size = 0.05f, .levels = 3, .cells = 64});
    map.work();
    const dvec3 focus{31, 0.5, -17};
    map.move(focus);
    int looked = 0;
    for (int frame = 0; frame < 200 && !map.work({.bricks = 500}); ++frame) {
        for (int level = 0; level < 3; ++level) {
            if (map.counts(level).missing_cells == 0 || (kSanitized && frame % 4 != 1)) continue;
            const double side = double(map.voxel_size(level)) * kBrickVoxels;
            double made_away = 0, missing_away = 0;
            int made_cells = 0, missing_cells = 0;
            each_cell(map.window(level), [&](ivec3 c) {
                const bool missing = map.cell_word(level, c) == kCellMissing;
                (missing ? missing_cells : made_cells) += 1;
                (missing ? missing_away : made_away) +=
                    std::max({std::fabs(c.x + 0.5 - focus.x / side), std::fabs(c.y + 0.5 - focus.y / side),
                              std::fabs(c.z + 0.5 - focus.z / side)});
            });
            if (made_cells < 4096 || missing_cells < 4096) continue;
            EXPECT_LT(made_away / made_cells, missing_away / missing_cells) << "level " << level << " frame " << frame;
            ++looked;
        }
    }
    EXPECT_GT(looked, rounds(5));
}

// Where rays of a picture end.
std::vector<double> ends(const Clipmap& map, const BakeView& view) {
    std::vector<double> out;
    for (float y = -0.97f; y < 1; y += 0.06f) {
        for (float x = -0.98f; x < 1; x += 0.04f) {
            const auto hit = map.cast(view.eye, normalize(view.forward + view.right * x + view.up * y), 1e6);
            out.push_back(hit.state == kMarchHit ? hit.t : -1);
        }
    }
    return out;
}

// Counted without a clock: bricks until the picture is what it will be. The eye looks along no axis, so that pyramids cut blocks.
TEST(Clipmap, WhatIsSeenIsMadeFirstAndInTheEndNothingDiffers) {
    const auto program = worlds::compiled(country(600));
    const ClipmapOptions options{.voxel_size = 0.05f, .levels = 4, .cells = kSanitized ? 32 : 64};
    const dvec3 eye{11, 2.5, -7};
    const vec3 forward = normalize(vec3{-0.8f, -0.1f, 0.6f});
    const vec3 right = normalize(cross(forward, {0, 1, 0}));
    const BakeView view{eye, forward, right * 0.7f, cross(right, forward) * 0.4f};
    Clipmap whole = made(program, eye, options);
    whole.work();
    const std::vector<double> expected = ends(whole, view);
    const auto bricks_until_seen = [&](const std::optional<BakeView>& looks) {
        Clipmap map = made(program, {600, 0.5, 0}, options);
        map.work();
        map.move(eye);
        uint32_t bricks = 0;
        bool seen = false, done = false;
        int nested = 0;
        for (int frame = 0; frame < 400 && !done; ++frame) {
            done = map.work({.bricks = 400}, looks);
            if (frame % 8 == 5) nested += cells_alone(map);
            for (int level = 0; level < map.all_levels() && !seen; ++level) bricks += map.counts(level).baked;
            seen = seen || ends(map, view) == expected;
        }
        EXPECT_TRUE(done && seen);
        EXPECT_EQ(nested, 0) << "a cell was made before the coarser level around it";
        EXPECT_EQ(map.bricks(), whole.bricks());
        for (int level = 0; level < 4; ++level) {
            each_cell(map.window(level), [&](ivec3 c) {
                const uint32_t is = map.cell_word(level, c), was = whole.cell_word(level, c);
                const bool brick = (is & kCellOccupied) != 0;
                ASSERT_EQ(brick, (was & kCellOccupied) != 0);
                if (brick) {
                    ASSERT_EQ(hash_of(map.content(is & kCellSlotMask)), hash_of(whole.content(was & kCellSlotMask)));
                }
            });
        }
        return bricks;
    };
    const uint32_t first = bricks_until_seen(view), without = bricks_until_seen({});
    // Of smaller windows a view shows more.
    EXPECT_LT((kSanitized ? 1 : 2) * first, without)
        << first << " bricks, " << without << " in an order that knows no view";
}

TEST(Clipmap, OlderChangesShowFirstAndEachOnlyWhole) {
    std::vector<Edit> edits = country(200);
    worlds::Live live(edits);
    Clipmap map = made(live.program(), {0, 0.5, 0}, kSmall);
    map.work();
    const auto before = map.program();
    const auto change = [&](vec3 at) {
        edits.push_back(worlds::edit(Sphere{.radius = 3}, at));
        map.edit(live.program(), live.become(edits));
        return map.program();
    };
    const auto older = change({2, 0, 1});
    EXPECT_FALSE(map.work({.bricks = 40}));
    const auto newer = change({-2, 0, -2});
    int older_alone = 0, frames = 0;
    for (bool done = false; !done && frames < 500; ++frames) {
        done = map.work({.bricks = 40});
        bool any_newer = false, all_older = true;
        for (int level = 0; level < 4; ++level) {
            const auto& shown = map.level_program(level);
            ASSERT_TRUE(shown == before || shown == older || shown == newer) << "nothing in between";
            any_newer = any_newer || shown == newer;
            all_older = all_older && shown != before;
        }
        EXPECT_TRUE(!any_newer || all_older) << "the newer one was shown before the older one, frame " << frames;
        older_alone += all_older && !any_newer;
        if (frames % 8 == 2) expect_is_its_program(map, frames % 4, "frame " + std::to_string(frames));
    }
    EXPECT_LT(frames, 500);
    EXPECT_GT(older_alone, 0);
    for (int level = 0; level < 4; ++level) EXPECT_EQ(map.level_program(level), newer);
}

// A ball so large that its normal hardly turns between two rays: what turns is the seam.
TEST(Clipmap, NormalsTurnByLessThanADegreeAcrossBricksAndZones) {
    const float radius = 60;
    const auto program = worlds::compiled({worlds::edit(Sphere{.radius = radius}, {0, -radius, 0})});
    for (const bool whole : {true, false}) {
        Clipmap map = made(program, {0.3, 0.5, 0.2}, kSmall);
        map.work({.bricks = 400});
        if (whole) map.work();
        const auto degrees = [](vec3 a, vec3 b) {
            return std::atan2(double(length(cross(a, b))), double(dot(a, b))) * 180 / std::numbers::pi;
        };
        int seams = 0, rays = 0;
        double worst = 0;
        for (const double z : {0.2, 1.9, -6.3}) {
            Clipmap::Hit last;
            vec3 exact_last;
            for (double x = -30; x < 30; x += 0.0125) {
                const Clipmap::Hit hit = map.cast({x, 5, z}, {0, -1, 0}, 1e6);
                ASSERT_EQ(hit.state, kMarchHit) << x;
                const vec3 exact = normalize(vec3{float(x), float(5 - hit.t) + radius, float(z)});
                if (rays++ % 4800 != 0) {
                    worst = std::max(worst, degrees(hit.normal, last.normal) - degrees(exact, exact_last));
                    seams += hit.level != last.level;
                }
                last = hit;
                exact_last = exact;
            }
        }
        EXPECT_LE(worst, 1) << (whole ? "whole" : "while cells are missing");
        EXPECT_GE(seams, 6);
    }
}

TEST(ClipmapSlow, AMillionSamplesSayNoMoreThanTheTrueDistance) {
    const auto program = worlds::compiled(country());
    Clipmap map = made(program, {0.3, 0.5, 0.2}, kSmall);
    map.work();
    worlds::Random r(14);
    for (int level = 0; level < 4; ++level) {
        const float h = map.voxel_size(level);
        std::vector<std::pair<ivec3, uint32_t>> bricks;
        each_cell(map.window(level), [&](ivec3 c) {
            const uint32_t word = map.cell_word(level, c);
            if ((word & kCellOccupied) != 0) bricks.emplace_back(c, word & kCellSlotMask);
        });
        int wrong = 0;
        const auto size_at = [&](ivec3 c, vec3 t) {
            return std::fabs(exact(*program, {double(h) * (c.x * 7 + double(t.x)), double(h) * (c.y * 7 + double(t.y)),
                                              double(h) * (c.z * 7 + double(t.z))})) /
                   double(h);
        };
        for (int i = 0; i < 250000; ++i) {
            const auto& [cell, slot] = bricks[size_t(r.below(int(bricks.size())))];
            const BrickContent& brick = map.content(slot);
            const auto texel = [&](ivec3 t) { return double(brick.distance(size_t((t.z * 8 + t.y) * 8 + t.x))); };
            const ivec3 t{r.below(8), r.below(8), r.below(8)};
            const double size = size_at(cell, {float(t.x), float(t.y), float(t.z)});
            wrong += !(std::fabs(texel(t)) <= size + std::max(0.002 * std::min(size, 4.0), 1e-3));
            // Between texels, of this level alone.
            const ivec3 v{r.below(7), r.below(7), r.below(7)};
            const vec3 f{r.in(0, 1), r.in(0, 1), r.in(0, 1)};
            double mean = 0;
            for (int corner = 0; corner < 8; ++corner) {
                const ivec3 at{v.x + (corner & 1), v.y + (corner >> 1 & 1), v.z + (corner >> 2)};
                const double w = double((corner & 1) != 0 ? f.x : 1 - f.x) * double((corner & 2) != 0 ? f.y : 1 - f.y) *
                                 double((corner & 4) != 0 ? f.z : 1 - f.z);
                mean += w * texel(at);
            }
            const double between = size_at(cell, {float(v.x) + f.x, float(v.y) + f.y, float(v.z) + f.z});
            wrong += !(std::fabs(mean) - 0.8661 <= between + 0.005);
        }
        EXPECT_EQ(wrong, 0) << "level " << level;
    }
}

// The figures of the clipmap: 60 Hz, 10 m/s, 2 cm, six levels.
TEST(ClipmapSlow, AFlightMakesNoMoreThanItsShellsInAnyFrame) {
    constexpr uint32_t kBudget = 1024;
    Clipmap map = made(worlds::compiled(country(2000)), {0, 1, 0}, {.voxel_size = 0.02f, .levels = 6, .cells = 64});
    map.work();
    int64_t entered = 0, cells = 0;
    for (int frame = 0; frame < 240; ++frame) {
        ivec3 old[6];
        for (int level = 0; level < 6; ++level) old[level] = map.first_cell(level);
        map.move({frame * 10.0 / 60, 1, 0.1});
        int64_t left[6];
        for (int level = 0; level < 6; ++level) {
            const ivec3 by = map.first_cell(level) - old[level];
            const auto stays = [](int d) { return int64_t(64 - std::min(std::abs(d), 64)); };
            ASSERT_EQ(map.counts(level).entered_cells, 64 * 64 * 64 - stays(by.x) * stays(by.y) * stays(by.z));
            entered += map.counts(level).entered_cells;
            left[level] = map.counts(level).missing_cells;
        }
        map.work({.bricks = kBudget});
        uint32_t bricks = 0;
        for (int level = 0; level < map.all_levels(); ++level) {
            bricks += map.counts(level).baked;
            if (level >= 6) continue;
            ASSERT_LE(int64_t(map.counts(level).cells_made), left[level]) << "frame " << frame << " level " << level;
            ASSERT_LE(map.counts(level).baked, map.counts(level).cells_made);
            cells += int64_t(map.counts(level).cells_made);
        }
        ASSERT_LE(bricks, kBudget);
        ASSERT_EQ(map.shown_levels(), 6) << "the last level keeps up";
    }
    EXPECT_LE(cells, entered);
    EXPECT_GT(cells, entered / 2) << "it keeps up";
    map.work();
    map.work();
    for (int level = 0; level < 6; ++level) EXPECT_EQ(map.counts(level).cells_made, 0u) << "a steady camera";
    EXPECT_EQ(baked(map), 0u) << "a steady camera";
}

// 3 km of a hundred thousand things: what a frame bakes and what stays in memory depend on the levels, not on how far one has come.
TEST(ClipmapSlow, AHundredThousandEditsOverKilometresFlyInBoundedFramesAndMemory) {
    constexpr uint32_t kBudget = 512;
    worlds::Random r(8);
    std::vector<Edit> edits{worlds::edit(Plane{})};
    while (edits.size() < 100000) {
        const vec3 at{r.in(-1500, 1500), r.in(-1, 1), r.in(-1500, 1500)};
        edits.push_back(worlds::edit(Sphere{.radius = r.in(0.5f, 4)}, at, r.below(3) == 0 ? Op::Subtract : Op::Union));
    }
    Clipmap map = made(worlds::compiled(edits), {-400, 1.5, 0.1}, {.voxel_size = 0.05f, .levels = 8, .cells = 32});
    map.work();
    const uint32_t bricks = map.bricks(), slots = map.slot_count();
    const size_t code = map.code().size();
    uint32_t most_bricks = 0, most_slots = 0;
    size_t most_code = 0;
    double x = -400;
    for (int frame = 0; frame < 1200; ++frame) {
        x += (frame < 240 ? 10.0 : frame < 640 || frame >= 1040 ? 300.0 : -300.0) / 60;
        map.move({x, 1.5, 0.1});
        map.work({.bricks = kBudget});
        ASSERT_LE(baked(map), kBudget) << "frame " << frame;
        if (frame % 20 == 0) {
            ASSERT_EQ(holes(map), 0) << "frame " << frame;
        }
        most_bricks = std::max(most_bricks, map.bricks());
        most_slots = std::max(most_slots, map.slot_count());
        most_code = std::max(most_code, map.code().size());
    }
    EXPECT_LE(most_bricks, bricks * 5 / 4);
    EXPECT_LE(most_slots, slots * 5 / 4);
    EXPECT_LE(most_code, code * 5 / 2);
}

}  // namespace
}  // namespace kiln::field
