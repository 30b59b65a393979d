// SPDX-License-Identifier: MIT
// What tests of clipmaps share: a country to look at, and what must hold of any clipmap at any time.
#pragma once

#include "field/clipmap.h"

#include "base/hash.h"
#include "rounds.h"
#include "sdf/eval.h"
#include "worlds.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <string>
#include <vector>

namespace kiln::field {

// A ground with lumps, pits and thin things on it, over 160 m.
inline std::vector<Edit> country(int count = 160, uint32_t seed = 3, float blend = 0.5f) {
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

inline Clipmap made(std::shared_ptr<const sdf::Program> program, dvec3 focus, ClipmapOptions options) {
    auto out = Clipmap::make(std::move(program), options, focus);
    EXPECT_TRUE(out) << (out ? "" : out.error().message);
    return std::move(*out);
}
inline constexpr ClipmapOptions kSmall{.voxel_size = 0.05f, .levels = 4, .cells = 32};

inline uint64_t hash_of(const BrickContent& brick) {
    uint64_t sum = brick.half ? hash64_of(std::span<const uint16_t>(brick.half->codes))
                              : hash64_of(std::span<const uint8_t>(brick.bytes->codes));
    sum = hash_combine(sum, brick.material);
    if (!brick.materials) return sum;
    sum = hash_combine(sum, hash64_of(std::span<const uint16_t>(brick.materials->words)));
    return hash_combine(sum, hash64_of(std::span<const uint32_t>(brick.materials->palette)));
}

template <typename F>
void each_cell(const CellBox& box, F&& fn) {
    for (int z = box.min.z; z < box.max.z; ++z) {
        for (int y = box.min.y; y < box.max.y; ++y) {
            for (int x = box.min.x; x < box.max.x; ++x) fn({x, y, z});
        }
    }
}

// A cell that is there has, around it, the coarser level there too: how many have not, up to four.
inline int cells_alone(const Clipmap& map) {
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
    return wrong;
}

// Every cell that is there has, to the byte, the distances of a field of the level's program. (Materials deep under a cut may differ: they
// depend on where blocks of cells begin, which is elsewhere in a field. Clipmaps are compared with each other to the last byte.)
inline void expect_is_its_program(const Clipmap& map, int level, const std::string& when) {
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
inline void expect_is_its_program(const Clipmap& map, const std::string& when) {
    for (int level = 0; level < map.level_count(); level += kSanitized ? 3 : 1) expect_is_its_program(map, level, when);
}

// How many cells of a box, counted from the window's first, are of a kind, from sums over all boxes at the corner (F. Crow, "Summed-Area Tables for Texture Mapping",
// SIGGRAPH 1984, on three axes).
class CellSums {
public:
    template <typename Is>
    CellSums(const CellBox& window, Is&& is) : size_(window.max - window.min + all_of(1)) {
        sums_.resize(size_t(size_.x) * size_t(size_.y) * size_t(size_.z));
        each_cell(window, [&](ivec3 c) {
            const ivec3 p = c - window.min;
            int sum = is(c);
            for (int corner = 1; corner < 8; ++corner) {
                const ivec3 before{p.x + 1 - (corner & 1), p.y + 1 - (corner >> 1 & 1), p.z + 1 - (corner >> 2)};
                sum += std::popcount(unsigned(corner)) % 2 == 1 ? at(before) : -at(before);
            }
            at(p + all_of(1)) = sum;
        });
    }
    int operator()(const CellBox& box) const {
        const ivec3 &lo = box.min, &hi = box.max;
        int sum = 0;
        for (int corner = 0; corner < 8; ++corner) {
            const ivec3 p{(corner & 1) != 0 ? lo.x : hi.x, (corner & 2) != 0 ? lo.y : hi.y,
                          (corner & 4) != 0 ? lo.z : hi.z};
            sum += std::popcount(unsigned(corner)) % 2 == 0 ? at(p) : -at(p);
        }
        return sum;
    }

private:
    ivec3 size_;
    std::vector<int> sums_;
    size_t index(ivec3 p) const {
        return (size_t(p.z) * size_t(size_.y) + size_t(p.y)) * size_t(size_.x) + size_t(p.x);
    }
    int& at(ivec3 p) { return sums_[index(p)]; }
    int at(ivec3 p) const { return sums_[index(p)]; }
};

// Marks beside missing cells, and that a jump never leads over anything but air of one sign. Words may be `rough`: marks there for nothing.
inline void expect_true_words(const Clipmap& map, int level, bool rough = false) {
    const CellBox window = map.window(level);
    const auto bits = [&](ivec3 c) { return map.cell_word(level, c) & (kCellOccupied | kCellInside); };
    const CellSums outside(window, [&](ivec3 c) { return bits(c) == 0; });
    const CellSums inside(window, [&](ivec3 c) { return bits(c) == kCellInside; });
    const CellSums missing(window, [&](ivec3 c) { return map.cell_word(level, c) == kCellMissing; });
    int wrong = 0;
    each_cell(window, [&](ivec3 c) {
        const uint32_t word = map.cell_word(level, c);
        if (word == kCellMissing || wrong > 3) return;
        const bool brick = (word & kCellOccupied) != 0;
        const int reach = brick ? 1 : int(word & 7u) - 1;
        ASSERT_GE(reach, 0);
        const ivec3 from = c - window.min;
        const CellBox around = grown({from, from + all_of(1)}, reach, window.max - window.min);
        const ivec3 size = around.max - around.min;
        const bool beside = missing(around) > 0;
        if (!brick && ((word & kCellInside) != 0 ? inside : outside)(around) != size.x * size.y * size.z) {
            ADD_FAILURE() << "level " << level << ": a jump leads over a cell of another kind";
            ++wrong;
        } else if (brick && beside != ((word & kCellFades) != 0) && (beside || !rough)) {
            ADD_FAILURE() << "level " << level << ": mark " << !beside << " beside " << beside;
            ++wrong;
        }
    });
}

inline uint64_t hash_of_bricks(const Clipmap& map) {
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

// Missing cells of the last level that are drawn and have nothing under them.
inline int holes(const Clipmap& map) {
    const int last = map.level_count() - 1;
    int out = 0;
    each_cell(map.drawn(last), [&](ivec3 c) {
        bool there = false;
        for (int level = last; level < map.shown_levels(); ++level) {
            const int by = level - last;
            const ivec3 over{c.x >> by, c.y >> by, c.z >> by};
            there = there || (contains(map.window(level), over) && map.cell_word(level, over) != kCellMissing);
        }
        out += !there;
    });
    return out;
}

// By the last work(), of all levels.
inline uint32_t baked(const Clipmap& map) {
    uint32_t out = 0;
    for (int level = 0; level < map.all_levels(); ++level) out += map.counts(level).baked;
    return out;
}

inline double exact(const sdf::Program& program, dvec3 p) { return sdf::evaluate(sdf::view(program), p); }

}  // namespace kiln::field
