// SPDX-License-Identifier: MIT
// Starts threads.
// Clipmaps against fields built from nothing, and what moving and changing them costs.
#include "clipmaps.h"
#include "rounds.h"

#include <cmath>

namespace kiln::field {
namespace {

int64_t shell_cells(ivec3 old, ivec3 now, int n) {
    const auto kept = [&](int a, int b) { return int64_t(std::max(n - std::abs(a - b), 0)); };
    return int64_t(n) * n * n - kept(old.x, now.x) * kept(old.y, now.y) * kept(old.z, now.z);
}

TEST(Clipmap, EveryLevelIsBakedFromTheEditsAtItsOwnResolution) {
    Clipmap map = made(worlds::compiled(country()), {1.3, 0.4, -2.2}, kSmall);
    EXPECT_TRUE(map.work());
    expect_is_its_program(map, "whole");
    for (int level = 0; level < map.level_count(); ++level) {
        EXPECT_EQ(map.counts(level).missing_cells, 0u);
        EXPECT_GT(map.counts(level).bricks, 300u);
        expect_true_words(map, level);
    }
}

TEST(Clipmap, MovingMakesTheCellsOfTheShellsAndNothingElse) {
    Clipmap map = made(worlds::compiled(country()), {0, 0.5, 0}, kSmall);
    map.work();
    EXPECT_TRUE(map.work());
    for (int level = 0; level < map.level_count(); ++level) EXPECT_EQ(map.counts(level).cells_made, 0u) << "steady";
    worlds::Random r(5);
    dvec3 at{0, 0.5, 0};
    for (int frame = 0; frame < 120; ++frame) {
        const dvec3 to{at.x + double(r.in(-0.4f, 0.6f)), at.y + double(r.in(-0.2f, 0.2f)),
                       at.z + double(r.in(-0.3f, 0.5f))};
        ivec3 old[4];
        for (int level = 0; level < 4; ++level) old[level] = map.first_cell(level);
        map.move(at = to);
        EXPECT_TRUE(map.work());
        for (int level = 0; level < 4; ++level) {
            const int64_t shell = shell_cells(old[level], map.first_cell(level), 32);
            EXPECT_EQ(map.counts(level).entered_cells, shell);
            EXPECT_EQ(int64_t(map.counts(level).cells_made), shell) << "frame " << frame << " level " << level;
            EXPECT_LE(map.counts(level).baked, shell);
            EXPECT_EQ(map.first_cell(level).x % 2, 0);
            const double side = double(map.voxel_size(level)) * 7;
            EXPECT_LE(std::fabs(at.x / side - (map.first_cell(level).x + 16)), kSlackCells);
        }
        map.work();
        for (int level = 0; level < 4; ++level) EXPECT_EQ(map.counts(level).cells_made, 0u) << "steady";
        EXPECT_EQ(baked(map), 0u) << "steady";
    }
    expect_is_its_program(map, "after the walk");
    for (int level = 0; level < 4; ++level) expect_true_words(map, level);
}

TEST(Clipmap, AWalkOf100MetresAndBackReproducesTheSameBytes) {
    const auto program = worlds::compiled(country(400));
    Clipmap map = made(program, {0, 0.5, 0}, kSmall);
    map.work();
    const Clipmap before = map;
    const double far = rounds(100);
    for (double x = 0; x <= far; x += 2.5) {
        map.move({x, 0.5, 0.3 * x});
        map.work({.bricks = 700});
    }
    for (double x = far; x >= 0; x -= 2.5) {
        map.move({x, 0.5, 0.3 * x});
        map.work({.bricks = 700});
    }
    map.work();
    int bricks = 0, other = 0;
    for (int level = 0; level < 4; ++level) {
        each_cell(map.window(level), [&](ivec3 c) {
            if (!contains(before.window(level), c)) return;  // windows stay behind within their slack
            const uint32_t now = map.cell_word(level, c), was = before.cell_word(level, c);
            ASSERT_EQ(now & (kCellOccupied | kCellInside), was & (kCellOccupied | kCellInside));
            if ((now & kCellOccupied) == 0) return;
            ++bricks;
            other += (now & kCellSlotMask) != (was & kCellSlotMask);
            ASSERT_EQ(hash_of(map.content(now & kCellSlotMask)), hash_of(before.content(was & kCellSlotMask)));
        });
    }
    EXPECT_GT(bricks, 2000);
    EXPECT_GT(other, bricks / 2) << "it was never away";
    map.move({-200, 0.5, -200});  // past the slack, so that windows come to the same places
    map.move({0, 0.5, 0});
    Clipmap fresh = made(program, {0, 0.5, 0}, kSmall);
    map.work();
    fresh.work();
    EXPECT_EQ(hash_of_bricks(map), hash_of_bricks(fresh));
    expect_is_its_program(map, "back");
    EXPECT_LT(map.slot_count(), 2 * map.bricks()) << "slots are used again";
    EXPECT_LT(map.code().size(), 8 * 4096 + 40u * map.bricks());
}

TEST(Clipmap, SameBytesForAnyNumberOfWorkers) {
    const auto program = worlds::compiled(country());
    uint64_t hash[2];
    LevelCounts counts[2];
    for (const int i : {0, 1}) {
        ClipmapOptions options = kSmall;
        options.workers = i == 0 ? 1 : 5;
        Clipmap map = made(program, {0, 0, 0}, options);
        for (int frame = 0; frame < 12; ++frame) {
            map.move({0.4 * frame, 0, 0.1 * frame});
            map.work({.bricks = 300});
        }
        hash[i] = hash_of_bricks(map);
        counts[i] = map.counts(0);
    }
    EXPECT_EQ(hash[0], hash[1]);
    EXPECT_EQ(counts[0].missing_cells, counts[1].missing_cells);
}

TEST(Clipmap, ChangesDirtyOnlyWhatTheyReachAndLevelsShowWholeStates) {
    std::vector<Edit> edits = country();
    worlds::Live live(edits);
    Clipmap map = made(live.program(), {0, 0.5, 0}, kSmall);
    map.work();
    worlds::Random r(9);
    int waited = 0;
    const int steps = rounds(40);
    for (int step = 0; step < steps; ++step) {
        if (r.below(2) == 0 && edits.size() > 100) {
            edits.erase(edits.begin() + 1 + r.below(int(edits.size()) - 1));
        } else {
            Edit e = r.edit(7.0f);
            if (e.op == Op::Subtract) e.node.material = Edit{}.node.material;
            e.node.transform.scale = {3, 3, 3};
            e.node.transform.position = e.node.transform.position + vec3{float(map.focus().x), 0, float(map.focus().z)};
            edits.insert(edits.begin() + 1 + r.below(int(edits.size())), e);
        }
        map.edit(live.program(), {});  // no change is no work
        const std::vector<RowChange> changes = live.become(edits);
        map.edit(live.program(), changes);
        map.work({.bricks = step % 8 == 0 ? 100000u : 60u});
        map.move({0.4 * step, 0.5, -0.3 * step});
        map.work({.bricks = 60});
        for (int level = 0; level < map.level_count(); ++level) waited += map.counts(level).edits_waiting > 0;
        if (step % 5 == 0) expect_is_its_program(map, "step " + std::to_string(step));
    }
    EXPECT_GT(waited, steps / 4) << "nothing was ever queued";
    EXPECT_TRUE(map.work());
    for (int level = 0; level < map.level_count(); ++level) {
        EXPECT_EQ(map.level_program(level), map.program());
        expect_true_words(map, level);
    }
    expect_is_its_program(map, "whole");
}

TEST(Clipmap, CellsThatComeInWhileAChangeIsMadeAreChangedToo) {
    std::vector<Edit> edits = country();
    worlds::Live live(edits);
    Clipmap map = made(live.program(), {0, 0.5, 0}, kSmall);
    map.work();
    edits.push_back(worlds::edit(Sphere{.radius = 4}, {7, 0.5f, 0}, Op::Subtract));
    map.edit(live.program(), live.become(edits));
    int frames = 0;
    bool halfway = false;
    do {
        if (frames < 4) map.move({0.8 * frames, 0.5, 0});
        halfway = halfway || (map.counts(0).edits_waiting > 0 && map.counts(0).missing_cells == 0);
    } while (!map.work({.bricks = 120}) && ++frames < 100);
    EXPECT_TRUE(halfway) << "the shells were not made before the change";
    expect_is_its_program(map, "whole");
}

TEST(Clipmap, ASmallChangeCostsWhatItReaches) {
    std::vector<Edit> edits = country(160, 3, 0);
    worlds::Live live(edits);
    Clipmap map = made(live.program(), {0, 0.5, 0}, kSmall);
    map.work();
    edits.push_back(worlds::edit(Sphere{.radius = 0.3f}, {1, 0.2f, 1}, Op::Subtract));
    map.edit(live.program(), live.become(edits));
    EXPECT_TRUE(map.work());
    for (int level = 0; level < map.level_count(); ++level) {
        const double side = double(map.voxel_size(level)) * 7, reach = 0.6 + 2 * 4.1 * double(map.voxel_size(level));
        const double most = std::pow(reach / side + 2, 3);
        EXPECT_GT(map.counts(level).baked, 0u);
        EXPECT_LE(double(map.counts(level).cells_made), most) << "level " << level;
    }
    expect_is_its_program(map, "after the change");
    edits.push_back(worlds::edit(Sphere{.radius = 0.3f}, {500, 0.2f, 1}));
    map.edit(live.program(), live.become(edits));
    EXPECT_TRUE(map.work());
    for (int level = 0; level < map.level_count(); ++level)
        EXPECT_EQ(map.counts(level).cells_made, 0u) << "out of sight";
}

TEST(Clipmap, CopiesAreSnapshots) {
    std::vector<Edit> edits = country();
    worlds::Live live(edits);
    Clipmap map = made(live.program(), {0, 0.5, 0}, kSmall);
    map.work();
    const Clipmap snapshot = map;
    const uint64_t hash = hash_of_bricks(snapshot);
    edits.push_back(worlds::edit(Sphere{.radius = 1}, {1, 0.2f, 1}));
    map.edit(live.program(), live.become(edits));
    map.move({5, 1, 3});
    map.work();
    EXPECT_NE(hash_of_bricks(map), hash);
    EXPECT_EQ(hash_of_bricks(snapshot), hash);
}

TEST(Clipmap, RefusesSettingsThatMakeNoSense) {
    const auto program = worlds::compiled(country(1));
    for (const ClipmapOptions& bad :
         {ClipmapOptions{.voxel_size = 0}, ClipmapOptions{.levels = 0}, ClipmapOptions{.levels = 17},
          ClipmapOptions{.cells = 48}, ClipmapOptions{.cells = 16}, ClipmapOptions{.cells = 256}}) {
        auto map = Clipmap::make(program, bad, {});
        ASSERT_FALSE(map);
        EXPECT_EQ(map.error().kind, ErrorKind::Usage);
        EXPECT_NE(map.error().message.find("clipmap: "), std::string::npos);
    }
}

}  // namespace
}  // namespace kiln::field
