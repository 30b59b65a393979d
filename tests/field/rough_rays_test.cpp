// SPDX-License-Identifier: MIT
// Starts threads.
// What rays meet in a clipmap whose words are not settled yet.
#include "clipmaps.h"

namespace kiln::field {
namespace {

// Words of a level that say less than they could: marks beside nothing that is missing, jumps that end in air of the same kind.
int rough_words(const Clipmap& map, int level) {
    const CellBox window = map.window(level);
    int out = 0;
    // Jumps go round the torus.
    each_cell({window.min + all_of(1), window.max - all_of(1)}, [&](ivec3 c) {
        const uint32_t word = map.cell_word(level, c);
        if (word == kCellMissing) return;
        const bool brick = (word & kCellOccupied) != 0;
        if (brick ? (word & kCellFades) == 0 : (word & 7u) > 1) return;
        bool met = false;
        for (int i = 0; i < 27; ++i) {
            const uint32_t other = map.cell_word(level, c + ivec3{i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1});
            met = met || (brick ? other == kCellMissing : (other & kCellOccupied) != 0);
        }
        out += !met;
    });
    return out;
}

// A camera that walks and leaps over ground that changes, and nothing is ever settled.
TEST(RoughRays, MeetTheSameThingsBeforeAnythingIsSettled) {
    std::vector<Edit> edits = country(400);
    worlds::Live live(edits);
    Clipmap map = made(live.program(), {0, 0.5, 0}, kSmall);
    map.work();
    worlds::Random r(3);
    dvec3 at{0, 0.5, 0};
    int hits = 0, rough = 0;
    for (int frame = 0; frame < 9; ++frame) {
        if (frame % 8 == 7) at = {double(r.in(-30, 30)), 0.5, double(r.in(-30, 30))};
        at.x += 0.7;
        map.move(at);
        expect_true_words(map, frame % 4, true);
        if (frame % 3 == 1) {
            edits.push_back(worlds::edit(Sphere{.radius = r.in(0.3f, 2)}, {float(at.x), 1, float(at.z)},
                                         frame % 2 == 0 ? Op::Subtract : Op::Union));
            map.edit(live.program(), live.become(edits));
        }
        map.work({.bricks = frame % 2 == 0 ? 400u : 3000u, .layers = 0});
        const int level = (frame + 2) % 4;
        expect_true_words(map, level, true);
        rough += rough_words(map, level);
        for (int i = 0; i < 60; ++i) {
            const dvec3 from{at.x + double(r.in(-6, 6)), 9, at.z + double(r.in(-6, 6))};
            const vec3 along = normalize(vec3{r.in(-1, 1), -1, r.in(-1, 1)});
            const Clipmap::Hit quick = map.cast(from, along, 1e6), slow = map.cast(from, along, 1e6, false);
            ASSERT_EQ(quick.state, slow.state);
            ASSERT_EQ(quick.level, slow.level);
            ASSERT_EQ(quick.t, slow.t);
            hits += quick.state == kMarchHit;
        }
    }
    EXPECT_GT(hits, 300);
    EXPECT_GT(rough, 1000);
    // A layer, then the rest.
    EXPECT_FALSE(map.work({.bricks = 1, .layers = 1}));
    expect_true_words(map, 0, true);
    EXPECT_TRUE(map.work());
    for (int level = 0; level < 4; ++level) {
        expect_true_words(map, level);
        EXPECT_EQ(rough_words(map, level), 0);
    }
    expect_is_its_program(map, "settled");
}

}  // namespace
}  // namespace kiln::field
