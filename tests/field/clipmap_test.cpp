// SPDX-License-Identifier: MIT
// Clipmaps against fields built from nothing, against the exact program, and against their own budgets.

#include "field/clipmap.h"

#include "base/hash.h"
#include "sdf/eval.h"
#include "worlds.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>

namespace kiln::field {
namespace {

// A ground with lumps, pits and thin things on it, over 160 m.
std::vector<Edit> country(int count = 160, uint32_t seed = 3, float blend = 0.5f) {
    worlds::Random r(seed);
    std::vector<Edit> edits{worlds::edit(Plane{}, {0, -0.13f, 0})};
    for (int i = 0; i < count; ++i) {
        const float spread = i % 3 == 0 ? 6.0f : 60.0f;
        const vec3 at{r.in(-spread, spread), r.in(-1, 1), r.in(-spread, spread)};
        Edit e;
        switch (r.below(4)) {
        case 0:
            e = worlds::edit(Sphere{.radius = r.in(0.4f, 4)}, at, Op::Union, r.in(0, blend));
            break;
        case 1:
            e = worlds::edit(Box{.half_extents = {r.in(0.1f, 2), r.in(0.3f, 3), r.in(0.1f, 2)}}, at);
            break;
        case 2:
            e = worlds::edit(Sphere{.radius = r.in(0.4f, 3)}, at, Op::Subtract, r.in(0, 0.6f * blend));
            break;
        default:
            e = worlds::edit(Capsule{.half_height = r.in(0.5f, 3), .radius = r.in(0.05f, 0.3f)}, at);
            break;
        }
        e.node.transform.rotation = axis_angle(r.direction(), r.in(-3, 3));
        // A cut with a material, inside a later one, shows where blocks of cells begin: fields begin them elsewhere.
        if (e.op == Op::Union) e.node.material = MaterialId{uint32_t(r.below(5)), 0};
        edits.push_back(e);
    }
    return edits;
}

Clipmap made(std::shared_ptr<const sdf::Program> program, dvec3 focus, ClipmapOptions options) {
    auto out = Clipmap::make(std::move(program), options, focus);
    EXPECT_TRUE(out) << (out ? "" : out.error().message);
    return std::move(*out);
}
constexpr ClipmapOptions kSmall{.voxel_size = 0.05f, .levels = 4, .cells = 32};

uint64_t hash_of(const BrickContent& brick) {
    uint64_t sum = brick.half ? hash64_of(std::span<const uint16_t>(brick.half->codes))
                              : hash64_of(std::span<const uint8_t>(brick.bytes->codes));
    sum = hash_combine(sum, brick.material);
    if (!brick.materials) return sum;
    sum = hash_combine(sum, hash64_of(std::span<const uint16_t>(brick.materials->words)));
    return hash_combine(sum, hash64_of(std::span<const uint32_t>(brick.materials->palette)));
}

void each_cell(const CellBox& box, const std::function<void(ivec3)>& fn) {
    for (int z = box.min.z; z < box.max.z; ++z) {
        for (int y = box.min.y; y < box.max.y; ++y) {
            for (int x = box.min.x; x < box.max.x; ++x) fn({x, y, z});
        }
    }
}

// Every cell that is there has, to the byte, the distances of a field of the level's program. (Materials deep under a cut may differ: they
// depend on where blocks of cells begin, which is elsewhere in a field. Clipmaps are compared with each other to the last byte.)
void expect_is_its_program(const Clipmap& map, int level, const std::string& when) {
    const CellBox window = map.window(level);
    const float h = map.voxel_size(level), side = h * kBrickVoxels;
    const auto middle = [&](ivec3 c) {
        return vec3{(float(c.x) + 0.5f) * side, (float(c.y) + 0.5f) * side, (float(c.z) + 0.5f) * side};
    };
    auto built =
        HostBricks::build(map.level_program(level), {.voxel_size = h,
                                                     .bounds = {middle(window.min), middle(window.max - all_of(1))},
                                                     .own_voxels = kLevelOwnVoxels});
    ASSERT_TRUE(built);
    ASSERT_EQ(built->field().grid().cell_x, window.min.x);
    ASSERT_EQ(built->field().grid().size_z, window.max.z - window.min.z);
    uint32_t missing = 0, bricks = 0;
    int wrong = 0;
    each_cell(window, [&](ivec3 c) {
        const uint32_t word = map.cell_word(level, c), want = built->field().cell_word(c.x, c.y, c.z);
        if (word == kCellMissing) {
            ++missing;
            return;
        }
        const bool brick = (word & kCellOccupied) != 0;
        bricks += brick;
        bool same = brick == ((want & kCellOccupied) != 0);
        if (same && !brick) same = (word & kCellInside) == (want & kCellInside);
        if (same && brick) {
            const BrickRecord& record = map.records()[word & kCellSlotMask];
            same = map.content(word & kCellSlotMask).half->codes == built->content(want & kCellSlotMask).half->codes &&
                   record.texel_x == c.x * 7 && record.texel_y == c.y * 7 && record.texel_z == c.z * 7 &&
                   record.level == uint32_t(level) && record.code_count > 0;
        }
        if (!same && ++wrong < 4)
            ADD_FAILURE() << when << ": level " << level << " cell " << c.x << " " << c.y << " " << c.z << ": word "
                          << word << ", a field has " << want;
    });
    EXPECT_EQ(wrong, 0);
    EXPECT_EQ(missing, map.counts(level).missing_cells) << when << " level " << level;
    EXPECT_EQ(bricks, map.counts(level).bricks) << when << " level " << level;
}
void expect_is_its_program(const Clipmap& map, const std::string& when) {
    for (int level = 0; level < map.level_count(); ++level) expect_is_its_program(map, level, when);
}

// Marks beside missing cells, and that a jump never leads over anything but air of one sign.
void expect_true_words(const Clipmap& map, int level) {
    const CellBox window = map.window(level);
    int wrong = 0;
    each_cell(window, [&](ivec3 c) {
        const uint32_t word = map.cell_word(level, c);
        if (word == kCellMissing || wrong > 3) return;
        const bool brick = (word & kCellOccupied) != 0;
        const int reach = brick ? 1 : int(word & 7u) - 1;
        ASSERT_GE(reach, 0);
        bool beside = false;
        for (int z = -reach; z <= reach; ++z) {
            for (int y = -reach; y <= reach; ++y) {
                for (int x = -reach; x <= reach; ++x) {
                    const ivec3 n = c + ivec3{x, y, z};
                    if (!contains(window, n)) continue;
                    const uint32_t other = map.cell_word(level, n);
                    beside = beside || other == kCellMissing;
                    if (!brick && (other & (kCellOccupied | kCellInside)) != (word & kCellInside)) {
                        ADD_FAILURE() << "level " << level << ": a jump leads over a cell of another kind";
                        ++wrong;
                        return;
                    }
                }
            }
        }
        if (brick && beside != ((word & kCellFades) != 0)) {
            ADD_FAILURE() << "level " << level << ": mark " << !beside << " beside " << beside;
            ++wrong;
        }
    });
}

uint64_t hash_of_bricks(const Clipmap& map) {
    uint64_t sum = 0;
    for (int level = 0; level < map.level_count(); ++level) {
        each_cell(map.window(level), [&](ivec3 c) {
            const uint32_t word = map.cell_word(level, c);
            const bool brick = (word & kCellOccupied) != 0 && word != kCellMissing;
            sum = hash_combine(
                sum, brick ? hash_of(map.content(word & kCellSlotMask)) : word & (kCellMissing | kCellInside));
        });
    }
    return sum;
}

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
    }
    expect_is_its_program(map, "after the walk");
    for (int level = 0; level < 4; ++level) expect_true_words(map, level);
}

TEST(Clipmap, AWalkOf100MetresAndBackReproducesTheSameBytes) {
    const auto program = worlds::compiled(country(400));
    Clipmap map = made(program, {0, 0.5, 0}, kSmall);
    map.work();
    const Clipmap before = map;
    for (double x = 0; x <= 100; x += 2.5) {
        map.move({x, 0.5, 0.3 * x});
        map.work({.bricks = 700});
    }
    for (double x = 100; x >= 0; x -= 2.5) {
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
    for (int step = 0; step < 40; ++step) {
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
    EXPECT_GT(waited, 10) << "nothing was ever queued";
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

// A cell that is there has, around it, the coarser level there too.
void expect_nested(const Clipmap& map, const std::string& when) {
    int wrong = 0;
    for (int level = 0; level + 1 < map.level_count(); ++level) {
        if (map.counts(level + 1).missing_cells == 0) continue;
        const CellBox coarse = map.window(level + 1);
        each_cell(map.window(level), [&](ivec3 c) {
            if (wrong > 3 || map.cell_word(level, c) == kCellMissing) return;
            each_cell(
                {{(c.x >> 1) - 1, (c.y >> 1) - 1, (c.z >> 1) - 1}, {(c.x >> 1) + 2, (c.y >> 1) + 2, (c.z >> 1) + 2}},
                [&](ivec3 n) {
                    if (!contains(coarse, n) || map.cell_word(level + 1, n) == kCellMissing) ++wrong;
                });
        });
    }
    EXPECT_EQ(wrong, 0) << when;
}

// Missing cells of the last level that are drawn.
int holes(const Clipmap& map) {
    const int last = map.level_count() - 1;
    int out = 0;
    each_cell(map.drawn(last), [&](ivec3 c) { out += map.cell_word(last, c) == kCellMissing; });
    return out;
}

TEST(Clipmap, KeepsToItsBudgetAndIsWholeAtOnceAfterATeleport) {
    const auto program = worlds::compiled(country(600));
    Clipmap map = made(program, {0, 0.5, 0}, kSmall);
    const uint32_t budget = 250;
    worlds::Random r(2);
    dvec3 at{0, 0.5, 0};
    uint32_t skipped = 0, sharp = 0, most_at_once = 0;
    for (int frame = 0; frame < 240; ++frame) {
        const bool jumps = frame == 0 || frame % 60 == 59;
        if (frame % 60 == 59) {
            at = {double(r.in(-60, 60)), 0.5, double(r.in(-60, 60))};
        } else if (frame >= 120) {
            at.x += at.x > 0 ? -5 : 5;  // 300 m/s
        }
        map.move(at);
        map.work({.bricks = budget});
        uint32_t baked = 0;
        for (int level = 0; level < 4; ++level) {
            baked += map.counts(level).baked;
            skipped += map.counts(level).skipped;
            if (map.counts(level).skipped) {
                EXPECT_EQ(map.counts(level).baked, 0u);
            }
        }
        // Only a jump costs more: what is drawn of the last level, no more.
        if (jumps) {
            most_at_once = std::max(most_at_once, baked);
        } else {
            ASSERT_LE(baked, budget) << "frame " << frame;
        }
        if (baked > budget) {
            EXPECT_EQ(map.counts(0).baked + map.counts(1).baked + map.counts(2).baked, 0u);
        }
        ASSERT_EQ(holes(map), 0) << "the picture has a hole in frame " << frame;
        if (frame < 120 && frame % 60 == 58) sharp += map.counts(0).missing_cells == 0;
        if (frame % 20 == 3) {
            expect_nested(map, "frame " + std::to_string(frame));
            expect_true_words(map, frame / 20 % 4);
        }
    }
    EXPECT_GT(most_at_once, budget) << "no jump cost more than a frame has";
    EXPECT_GT(skipped, 50u) << "nothing was too fast";
    EXPECT_EQ(sharp, 2u) << "it never sharpened";
    for (int frame = 0; frame < 60 && !map.work({.bricks = budget}); ++frame) {}
    for (int level = 0; level < 4; ++level) EXPECT_EQ(map.counts(level).missing_cells, 0u);
    expect_is_its_program(map, "caught up");
}

TEST(Clipmap, ATimeBudgetOfNothingStillMakesTheLastLevel) {
    Clipmap map = made(worlds::compiled(country()), {0, 0.5, 0}, kSmall);
    EXPECT_FALSE(map.work({.seconds = 0}));
    EXPECT_EQ(holes(map), 0);
    EXPECT_GT(map.counts(3).missing_cells, 0u) << "what is not drawn may wait";
    EXPECT_EQ(map.counts(2).baked + map.counts(1).baked + map.counts(0).baked, 0u);
    int frames = 0;
    while (!map.work({.seconds = 0.002}) && frames < 10000) ++frames;
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
        uint32_t baked = 0;
        for (int level = 0; level < 4; ++level) baked += map.counts(level).baked;
        ASSERT_LE(baked, 150u);
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

// levels.gpu.h says so of kLevelOwnVoxels: all texels of an empty fine cell are at least that, in size; coarse texels that the cell has
// too are; others are lower by their distance to the nearest of the cell's at most; so the trilinear mean of eight of them stays above 0.
TEST(Clipmap, AnEmptyCellKeepsTheCoarserLevelsSurfaceAway) {
    double worst = 1e9;
    for (int parity = 0; parity < 8; ++parity) {
        const int first[3] = {7 * (parity & 1), 7 * (parity >> 1 & 1), 7 * (parity >> 2)};
        for (int i = 0; i < 512; ++i) {
            const int texel[3] = {first[0] + (i & 7), first[1] + (i >> 3 & 7), first[2] + (i >> 6)};
            double mean = 0;
            for (int corner = 0; corner < 8; ++corner) {
                double away = 0;
                for (int axis = 0; axis < 3; ++axis) {
                    // Of an odd texel the coarse ones beside it, of an even one itself.
                    const int at = texel[axis] + (texel[axis] % 2 == 0 ? 0 : (corner >> axis & 1) != 0 ? 1 : -1);
                    const int beyond = std::max({first[axis] - at, at - (first[axis] + 7), 0});
                    away += double(beyond * beyond);
                }
                mean += (double(kLevelOwnVoxels) - std::sqrt(away)) / 8;
            }
            worst = std::min(worst, mean);
        }
    }
    EXPECT_GT(worst, 0.1);  // and stored values are rounded
}

double exact(const sdf::Program& program, dvec3 p) { return sdf::evaluate(sdf::view(program), p); }

TEST(Clipmap, NoLevelSaysMoreThanTheTrueDistance) {
    const auto program = worlds::compiled(country());
    Clipmap map = made(program, {0.3, 0.5, 0.2}, kSmall);
    map.work();
    worlds::Random r(4);
    for (int level = 0; level < 4; ++level) {
        const float h = map.voxel_size(level);
        int texels = 0, points = 0;
        each_cell(map.window(level), [&](ivec3 c) {
            const uint32_t word = map.cell_word(level, c);
            if ((word & kCellOccupied) == 0 || (c.x + c.y + c.z) % 3 != 0) return;
            const BrickContent& brick = map.content(word & kCellSlotMask);
            const ivec3 t{r.below(8), r.below(8), r.below(8)};
            const dvec3 p{double(h) * (c.x * 7 + t.x), double(h) * (c.y * 7 + t.y), double(h) * (c.z * 7 + t.z)};
            const double stored = double(std::fabs(brick.distance(size_t((t.z * 8 + t.y) * 8 + t.x)) * h));
            const double size = std::fabs(exact(*program, p));
            EXPECT_LE(stored, size + double(h) * std::max(0.002 * std::min(size / double(h), 4.0), 1e-3));
            ++texels;
        });
        EXPECT_GT(texels, 100);
        for (int i = 0; i < 4000; ++i) {
            const float reach = level_reach(32) * h;
            const vec3 q = r.point(reach);
            const dvec3 p{double(q.x) + 0.3, 0.1 * double(q.y), double(q.z) + 0.2};
            const Clipmap::Sample s = map.sample(p);
            if (!s.from_brick) continue;
            ++points;
            // Mixed with the next level, its voxels count.
            const double slack = 0.8661 * 2 * double(map.voxel_size(s.level));
            ASSERT_LE(double(std::fabs(s.distance)) - slack, std::fabs(exact(*program, p)) + 1e-4);
        }
        EXPECT_GT(points, 50);
    }
}

// What level_field.gpu.h and the march rely on where they leave empty fine cells alone.
TEST(Clipmap, AnEmptyCellIsEmptyInTheCoarserLevelToo) {
    worlds::Random r(21);
    std::vector<Edit> edits;
    for (int i = 0; i < 300; ++i) {
        Edit e = worlds::edit(Box{.half_extents = {r.in(0.01f, 0.4f), r.in(0.01f, 0.4f), r.in(0.01f, 0.1f)}},
                              r.point(2.0f), i % 3 == 2 ? Op::Subtract : Op::Union);
        e.node.transform.rotation = axis_angle(r.direction(), r.in(-3, 3));
        edits.push_back(e);
    }
    const auto program = worlds::compiled(edits);
    Clipmap fine = made(program, {0, 0, 0}, {.voxel_size = 0.025f, .levels = 1, .cells = 32});
    Clipmap coarse = made(program, {0, 0, 0}, {.voxel_size = 0.05f, .levels = 1, .cells = 32});
    fine.work();
    coarse.work();
    int looked = 0, wrong = 0;
    each_cell(fine.window(0), [&](ivec3 c) {
        const uint32_t word = fine.cell_word(0, c);
        if ((word & kCellOccupied) != 0 || (word & 7u) > 1) return;
        for (int i = 0; i < 512; ++i) {
            const ivec3 t{c.x * 7 + (i & 7), c.y * 7 + (i >> 3 & 7), c.z * 7 + (i >> 6)};
            const auto s = coarse.sample({0.025 * t.x, 0.025 * t.y, 0.025 * t.z});
            if (!s.from_brick) continue;
            ++looked;
            wrong += (s.distance <= 0) != ((word & kCellInside) != 0);
        }
    });
    EXPECT_GT(looked, 10000);
    EXPECT_EQ(wrong, 0);
}

// Steps of a twentieth of a voxel change what is drawn by no more than a tenth of one, across every seam; half a voxel is asked for.
TEST(Clipmap, DistanceIsContinuousAcrossTheZones) {
    const auto program = worlds::compiled(country());
    for (const uint32_t budget : {std::numeric_limits<uint32_t>::max(), 900u}) {
        Clipmap map = made(program, {0.3, 0.5, 0.2}, kSmall);
        map.work({.bricks = 0});
        map.work({.bricks = budget});  // not all of level 0
        worlds::Random r(6);
        int across = 0;
        double worst = 0;
        for (int i = 0; i < 1500; ++i) {
            // On the surface, in a zone of some level or where it ends.
            const int level = r.below(3);
            const double h = double(map.voxel_size(level)), reach = double(level_reach(32)) * h;
            const int axis = r.below(2) == 0 ? 0 : 2;
            double p[3] = {0.3 + double(r.in(-1, 1)) * reach, 5, 0.2 + double(r.in(-1, 1)) * reach};
            p[axis] = (axis == 0 ? 0.3 : 0.2) + (r.below(2) == 0 ? -1 : 1) * (reach + double(r.in(-20, 1)) * h);
            for (int k = 0; k < 60; ++k) p[1] -= exact(*program, {p[0], p[1], p[2]});
            p[1] += double(r.in(-0.5f, 0.5f)) * h;
            Clipmap::Sample last;
            for (int k = 0; k < 200; ++k) {
                const Clipmap::Sample s = map.sample({p[0], p[1], p[2]});
                if (s.from_brick && last.from_brick) {
                    const double voxel = double(map.voxel_size(std::min(s.level, last.level)));
                    const double change = std::fabs(double(s.distance) - double(last.distance)) / voxel;
                    // Both clamped to their own bands, they need not agree far from the surface.
                    if (std::fabs(double(s.distance)) < 3 * voxel) {
                        worst = std::max(worst, change);
                        across += s.level != last.level;
                    }
                }
                last = s;
                p[axis] += 0.05 * h;
            }
        }
        EXPECT_LE(worst, 0.1) << "budget " << budget;
        EXPECT_GT(across, 30);
        // On the faces of missing cells the mix is the coarser level's, whatever the bricks beside hold.
        int faces = 0;
        for (int level = 0; level < 3; ++level) {
            const double h = double(map.voxel_size(level));
            each_cell(map.window(level), [&](ivec3 c) {
                if ((map.cell_word(level, c) & kCellFades) == 0 || map.cell_word(level, c) == kCellMissing) return;
                for (int face = 0; face < 6; ++face) {
                    const int axis = face / 2, side = face % 2;
                    ivec3 next = c;
                    (axis == 0 ? next.x : axis == 1 ? next.y : next.z) += side == 0 ? -1 : 1;
                    if (!contains(map.window(level), next) || map.cell_word(level, next) != kCellMissing) continue;
                    for (int i = 0; i < 8; ++i) {
                        double p[2][3];
                        for (int k = 0; k < 3; ++k)
                            p[0][k] = p[1][k] = h * (7 * (k == 0 ? c.x : k == 1 ? c.y : c.z) + double(r.in(0, 7)));
                        const double at = 7 * (axis == 0 ? c.x : axis == 1 ? c.y : c.z) + 7 * side;
                        p[0][axis] = h * (at - 1e-3), p[1][axis] = h * (at + 1e-3);
                        const Clipmap::Sample a = map.sample({p[0][0], p[0][1], p[0][2]}),
                                              b = map.sample({p[1][0], p[1][1], p[1][2]});
                        if (!a.from_brick || !b.from_brick || a.level == b.level ||
                            std::fabs(double(a.distance)) > 3 * h)
                            continue;
                        ++faces;
                        EXPECT_LE(std::fabs(double(a.distance) - double(b.distance)), 0.01 * h);
                    }
                }
            });
        }
        if (budget != std::numeric_limits<uint32_t>::max()) {
            EXPECT_GT(faces, 100);
        }
    }
}

// From a place in the air down to ground that has no hole: every ray hits, near where the exact surface is.
TEST(Clipmap, NoRaySlipsThroughWhereLevelsHandOver) {
    std::vector<Edit> edits = country(60);
    for (Edit& e : edits) {
        if (e.op == Op::Subtract) e.op = Op::Union;
        if (&e != edits.data()) e.node.transform.position = e.node.transform.position * 2.0f + vec3{0, -2, 0};
    }
    const auto program = worlds::compiled(edits);
    for (const uint32_t budget : {std::numeric_limits<uint32_t>::max(), 5000u, 1500u, 0u}) {
        Clipmap map = made(program, {0, 2, 0}, kSmall);
        map.work({.bricks = 0});
        map.work({.bricks = budget});
        if (budget != 0) map.move({1.7, 2, 0.4});  // shells are missing
        worlds::Random r(8);
        int levels[4] = {}, checked = 0;
        const dvec3 from{map.focus().x, 2.3, map.focus().z};
        if (exact(*program, from) <= 0) GTEST_FAIL() << "the camera is in the ground";
        const double edge = double(level_reach(32)) * double(map.voxel_size(3));
        for (int i = 0; i < 20000; ++i) {
            vec3 d = r.direction();
            d.y = -std::fabs(d.y) * (i % 2 == 0 ? 1.0f : 0.1f);
            d = normalize(d);
            const double ground = 2.43 / -double(d.y);
            if (ground * std::max(std::fabs(double(d.x)), std::fabs(double(d.z))) > edge - 3) continue;
            const Clipmap::Hit hit = map.cast(from, d, 1e6);
            ASSERT_EQ(hit.state, kMarchHit) << "budget " << budget << " ray " << d.x << " " << d.y << " " << d.z;
            ASSERT_LE(hit.t, ground + 3 * double(map.voxel_size(hit.level)) / -double(d.y) * 0.2 + 0.02);
            const dvec3 p{from.x + hit.t * double(d.x), from.y + hit.t * double(d.y), from.z + hit.t * double(d.z)};
            EXPECT_LE(std::fabs(exact(*program, p)), 2.0 * double(map.voxel_size(hit.level)));
            const Clipmap::Hit slow = map.cast(from, d, 1e6, false);
            ASSERT_EQ(hit.level, slow.level);
            ASSERT_EQ(hit.t, slow.t);
            ++levels[hit.level];
            ++checked;
        }
        EXPECT_GT(checked, 5000);
        EXPECT_GT(levels[3], 100);
        if (budget == std::numeric_limits<uint32_t>::max()) {
            for (int l = 0; l < 4; ++l) EXPECT_GT(levels[l], 100) << l;
        }
        if (budget == 0) {
            EXPECT_EQ(levels[0] + levels[1] + levels[2], 0);
        }
    }
}

// A float's step there is 0.4 of a voxel.
TEST(Clipmap, IsExactAHundredKilometresFromTheOrigin) {
    const vec3 there{100000.25f, 1.5f, -70000.5f};
    const auto at = [&](float x, float y, float z) { return there + vec3{x, y, z}; };  // multiples of 2^-6: exact
    std::vector<Edit> edits{
        worlds::edit(Plane{}), worlds::edit(Sphere{.radius = 0.3f}, there),
        worlds::edit(Box{.half_extents = {0.3f, 0.2f, 0.25f}}, at(0.5f, 0.25f, 0.125f), Op::Union, 0.1f),
        worlds::edit(Sphere{.radius = 0.15f}, at(-0.125f, 0.25f, 0), Op::Subtract)};
    edits[2].node.transform.rotation = axis_angle(normalize(vec3{1, 2, 0.5f}), 0.7f);
    edits[2].node.material = MaterialId{3, 0};
    worlds::Live live(edits);
    const auto program = live.program();
    const dvec3 focus{double(there.x) + 0.6, 1.6, double(there.z) + 0.3};
    const ClipmapOptions options{.voxel_size = 0.02f, .levels = 3, .cells = 32};
    Clipmap map = made(program, focus, options);
    map.work();
    const auto check = [&](const sdf::Program& now) {
        for (int level = 0; level < 3; ++level) {
            const float h = map.voxel_size(level);
            double worst = 0;
            int texels = 0, own = 0;
            std::map<std::array<int, 3>, float> seen;
            each_cell(map.window(level), [&](ivec3 c) {
                const uint32_t word = map.cell_word(level, c);
                if ((word & kCellOccupied) == 0 || (level > 0 && c.y != 0 && (c.x + c.z) % 5 != 0)) return;
                const BrickContent& brick = map.content(word & kCellSlotMask);
                EXPECT_EQ(map.records()[word & kCellSlotMask].far, 1u);
                bool near = false;
                for (int i = 0; i < 512; ++i) {
                    const ivec3 t{c.x * 7 + (i & 7), c.y * 7 + (i >> 3 & 7), c.z * 7 + (i >> 6)};
                    const dvec3 p{texel_position(t.x, h), texel_position(t.y, h), texel_position(t.z, h)};
                    EXPECT_LE(std::fabs(p.x - double(t.x) * double(h)), double(h) * 2e-5);
                    const double want = exact(now, p) / double(h), got = double(brick.distance(size_t(i)));
                    near = near || std::fabs(want) < double(kLevelOwnVoxels);
                    if (std::fabs(want) < 3.9) worst = std::max(worst, std::fabs(got - want));
                    const auto [first, fresh] = seen.try_emplace({t.x, t.y, t.z}, brick.distance(size_t(i)));
                    if (!fresh) {
                        EXPECT_EQ(first->second, brick.distance(size_t(i))) << "a shared texel";
                    }
                    ++texels;
                }
                EXPECT_TRUE(near);
                own += near;
            });
            EXPECT_GT(own, level == 0 ? 150 : 50);
            EXPECT_LE(worst, 0.002) << "level " << level << ", " << texels
                                    << " texels";  // half a step of a half is 2^-10
        }
    };
    check(*program);
    int hits = 0;
    worlds::Random r(3);
    for (int i = 0; i < 2000; ++i) {
        const vec3 d = r.direction();
        const Clipmap::Hit hit = map.cast({double(there.x) + 0.6, 2.2, double(there.z) + 0.9}, d, 1e6);
        if (hit.state != kMarchHit) continue;
        ++hits;
        const dvec3 p{double(there.x) + 0.6 + hit.t * double(d.x), 2.2 + hit.t * double(d.y),
                      double(there.z) + 0.9 + hit.t * double(d.z)};
        EXPECT_LE(std::fabs(exact(*program, p)), 0.7 * double(map.voxel_size(hit.level)));
    }
    EXPECT_GT(hits, 500);
    edits.push_back(worlds::edit(Sphere{.radius = 0.2f}, at(0.25f, -1.5f, 0.5f), Op::Subtract));
    map.edit(live.program(), live.become(edits));
    map.work();
    EXPECT_GT(map.counts(0).baked, 8u);
    check(*live.program());
    Clipmap fresh = made(live.program(), focus, options);
    fresh.work();
    EXPECT_EQ(hash_of_bricks(map), hash_of_bricks(fresh));
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
