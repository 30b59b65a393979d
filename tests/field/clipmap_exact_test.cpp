// SPDX-License-Identifier: MIT
// Starts threads.
// Clipmaps against the exact program: bounds, seams, rays, and places far out.
#include "clipmaps.h"
#include "rounds.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

namespace kiln::field {
namespace {

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
        do map.work({.bricks = 700});
        while (map.shown_levels() > map.level_count());
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
        int levels[kMostLevels] = {}, checked = 0;
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
        if (budget != 0) {
            EXPECT_GT(levels[3], 100);
        }
        if (budget == std::numeric_limits<uint32_t>::max()) {
            for (int l = 0; l < 4; ++l) EXPECT_GT(levels[l], 100) << l;
        }
        if (budget == 0) {
            EXPECT_EQ(levels[0] + levels[1] + levels[2] + levels[3], 0);
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
                if ((c.x + 3 * c.y + c.z) % (4 / rounds(4)) != 0) return;
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
            EXPECT_GT(own, (level == 0 ? 150 : 50) * rounds(4) / 4);
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

}  // namespace
}  // namespace kiln::field
