// SPDX-License-Identifier: MIT
// Starts threads.
// The march that meets cells in no order (box_march.gpu.h), on the CPU: of all cells with a box, taken backwards and one by one, it ends where
// the walk does, bit for bit.
#include "field/brick_walk.gpu.h"
#include "field/worlds.h"
#include "render/gpu_boxes.h"

#include <algorithm>
#include <cmath>

namespace kiln::field {
namespace {

struct BoxReader {
    const HostBricks& bricks;
    const CellMap& cells;
    explicit BoxReader(const HostBricks& host) : bricks(host), cells(host.field().cells()) {}
    uint field_cell(ivec3 cell) const { return cells.at(cell.x, cell.y, cell.z); }
    static void field_enter(uint, ivec3) {}
    Corners field_corners(int slot, ivec3 voxel) const { return bricks.corners(uint32_t(slot), voxel); }
    static bool field_voxel_solid(int, ivec3) { return true; }
#include "field/march.gpu.h"

#include "field/box_march.gpu.h"
};

// Bricks that do not fit together: what stands at a corner of one says nothing of its neighbours. So cells that a ray enters at one parameter
// (through an edge or a corner of the lattice) may all end a march, and only their order says which does.
struct NoiseReader {
    static constexpr int kSide = 6;
    static constexpr GridParams kGrid{-3, -3, -3, 0.1f, kSide, kSide, kSide, 0};
    static uint32_t hash(uint32_t n) {
        n = (n ^ (n >> 16)) * 0x7feb352du;
        n = (n ^ (n >> 15)) * 0x846ca68bu;
        return n ^ (n >> 16);
    }
    static uint field_cell(ivec3 c) {
        const uint32_t slot = uint32_t(c.x + kSide * (c.y + kSide * c.z));
        return hash(slot) % 4 != 0 ? kCellOccupied | slot : 0u;
    }
    static void field_enter(uint, ivec3) {}
    static float corner(int slot, int x, int y, int z) {
        const uint32_t n = hash(uint32_t(slot * 512 + x + 8 * (y + 8 * z)) + 0x9e3779b9u);
        return n % 9 == 0 ? -0.5f : float(n % 1000) / 1000 + 0.01f;
    }
    static Corners field_corners(int slot, ivec3 v) {
        const auto at = [&](int x, int y, int z) { return corner(slot, v.x + x, v.y + y, v.z + z); };
        return {at(0, 0, 0), at(1, 0, 0), at(0, 1, 0), at(1, 1, 0), at(0, 0, 1), at(1, 0, 1), at(0, 1, 1), at(1, 1, 1)};
    }
    static bool field_voxel_solid(int, ivec3) { return true; }
#include "field/march.gpu.h"

#include "field/box_march.gpu.h"
};

// What march_trace.rgen and .rint do, with a traversal that knows nothing of order: among equals the last cell offered wins.
template <typename Reader>
MarchHit march_by_boxes(Reader& reader, const GridParams& grid, const std::vector<uint32_t>& boxes, const TexelRay& ray,
                        float t_max) {
    const MarchStart start = reader.march_start(grid, ray, 0, t_max);
    MarchHit hit = reader.march_miss(t_max);
    if (!start.meets) return hit;
    if (reader.march_cell(grid, ray, start.cell, reader.field_cell(start.cell), start.t, 0, t_max, hit)) return hit;
    bool found = false;
    float least = t_max;
    ivec3 end{};
    for (const uint32_t at : boxes) {
        const ivec3 cell{int(at) % grid.size_x, int(at) / grid.size_x % grid.size_y,
                         int(at) / (grid.size_x * grid.size_y)};
        float t = 0;
        int axis = -1;
        if (!reader.box_march_visits(ray, start, cell, t_max, t, axis) || axis < 0 || t > least) continue;
        MarchHit there = reader.march_miss(t_max);
        if (!reader.march_cell(grid, ray, cell, reader.field_cell(cell), t, 0, t_max, there)) continue;
        found = true;
        least = t;
        end = cell;
    }
    return found ? reader.box_march_end(grid, ray, start, end, t_max) : reader.march_miss(t_max);
}

// Of all kinds: parallel to axes, along planes, edges and diagonals of the lattice, from without and from within solid.
TexelRay some_ray(worlds::Random& r, const GridParams& g) {
    const auto inside = [&](int first, int size) { return float(first * 7) + r.in(0, float(size * 7)); };
    vec3 target{inside(g.cell_x, g.size_x), inside(g.cell_y, g.size_y), inside(g.cell_z, g.size_z)};
    vec3 d = r.direction();
    const auto sign = [&] { return r.below(2) == 0 ? 1.0f : -1.0f; };
    const int kind = r.below(9);
    if (kind == 0) d = {sign(), 0, 0};
    if (kind == 1) d = normalize(vec3{0, r.in(-1, 1), r.in(-1, 1)});
    if (kind == 2) d = normalize(vec3{sign(), sign(), sign()});
    if (kind == 3) d = normalize(vec3{sign(), sign(), 0});
    if (kind <= 4) target = {std::round(target.x), std::round(target.y), std::round(target.z)};
    if (kind == 2 || kind == 3)
        target = {7 * std::round(target.x / 7), 7 * std::round(target.y / 7), 7 * std::round(target.z / 7)};
    const float away = kind == 5 ? 0.0f : kind == 6 ? 20000.0f : kind == 2 || kind == 3 ? 0 : r.in(50, 400);
    vec3 from = target - d * away;
    if (kind == 2 || kind == 3)
        from = target - vec3{d.x > 0 ? 70.0f : -70.0f, d.y > 0 ? 70.0f : -70.0f,
                             d.z == 0  ? 0
                             : d.z > 0 ? 70.0f
                                       : -70.0f};
    const ivec3 whole{int(std::floor(from.x)), int(std::floor(from.y)), int(std::floor(from.z))};
    return texel_ray(whole, {from.x - float(whole.x), from.y - float(whole.y), from.z - float(whole.z)}, d);
}

TEST(BoxMarch, EndsWhereTheWalkEnds) {
    using namespace worlds;
    int hits = 0, insides = 0, misses = 0;
    for (const World& world : {sphere_of(10), sphere_of(40), boxes(), blends(), thin_walls()}) {
        const HostBricks bricks = HostBricks::bake(world.field());
        const std::vector<uint32_t> cells = render::box_cells(bricks.field());
        BoxReader reader(bricks);
        Random r(17);
        for (int i = 0; i < 1500; ++i) {
            const TexelRay ray = some_ray(r, bricks.field().grid());
            const MarchHit walk = bricks.march(ray, 0, kFarVoxels, false);
            const MarchHit got = march_by_boxes(reader, bricks.field().grid(), cells, ray, kFarVoxels);
            ASSERT_EQ(got.state, walk.state) << world.name << " ray " << i;
            ASSERT_EQ(got.t, walk.t) << world.name << " ray " << i;
            ASSERT_EQ(got.slot, walk.slot) << world.name << " ray " << i;
            ASSERT_TRUE(got.voxel == walk.voxel && got.p == walk.p) << world.name << " ray " << i;
            if (walk.state != kMarchMiss) {
                ASSERT_TRUE(got.cell == walk.cell) << world.name << " ray " << i;
            }
            hits += walk.state == kMarchHit, insides += walk.state == kMarchInside, misses += walk.state == kMarchMiss;
        }
    }
    EXPECT_GT(hits, 1000);
    EXPECT_GT(insides, 20);
    EXPECT_GT(misses, 100);
}

TEST(BoxMarch, OfCellsEnteredAtOnceTheWalksFirstCounts) {
    NoiseReader reader;
    const GridParams grid = NoiseReader::kGrid;
    std::vector<uint32_t> up, down;
    for (uint32_t slot = 0; slot < 216; ++slot)
        if (NoiseReader::field_cell({int(slot) % 6, int(slot) / 6 % 6, int(slot) / 36}) != 0) up.push_back(slot);
    down.assign(up.rbegin(), up.rend());
    worlds::Random r(31);
    int hits = 0;
    for (int i = 0; i < 4000; ++i) {
        // Along diagonals through corners of cells, in all directions; every third ray through edges only.
        const auto sign = [&] { return r.below(2) == 0 ? 1.0f : -1.0f; };
        vec3 d{sign(), sign(), sign()};
        if (i % 3 == 0) d.z = 0;
        ivec3 from{7 * (r.below(8) - 4), 7 * (r.below(8) - 4), 7 * (r.below(8) - 4)};
        if (i % 3 == 0) from.z += 3;
        const TexelRay ray = texel_ray(from, {0, 0, i % 3 == 0 ? 0.4f : 0.0f}, normalize(d));
        const MarchHit walk = reader.field_march(grid, ray, 0, kFarVoxels, false);
        hits += walk.state == kMarchHit;
        for (const auto& boxes : {up, down}) {
            const MarchHit got = march_by_boxes(reader, grid, boxes, ray, kFarVoxels);
            ASSERT_EQ(got.state, walk.state) << i;
            ASSERT_EQ(got.slot, walk.slot) << i;
            ASSERT_EQ(got.t, walk.t) << i;
            ASSERT_TRUE(got.voxel == walk.voxel) << i;
        }
    }
    EXPECT_GT(hits, 1000);
}

// A walk without jumps looks at the cells on the way, in the order of their t: those and no others.
TEST(BoxMarch, CellsOnTheWayAreThoseOfTheWalk) {
    using namespace worlds;
    const HostBricks bricks = HostBricks::bake(sphere_of(10).field());
    BoxReader reader(bricks);
    const GridParams grid = bricks.field().grid();
    Random r(23);
    int judged = 0;
    for (int i = 0; i < 400; ++i) {
        const TexelRay ray = some_ray(r, grid);
        const MarchStart start = reader.march_start(grid, ray, 0, kFarVoxels);
        if (!start.meets || bricks.march(ray, 0, kFarVoxels, false).state != kMarchMiss) continue;
        int visited = 0;
        for (int z = 0; z < grid.size_z; ++z)
            for (int y = 0; y < grid.size_y; ++y)
                for (int x = 0; x < grid.size_x; ++x) {
                    float t = 0;
                    int axis = -1;
                    visited += reader.box_march_visits(ray, start, {x, y, z}, kFarVoxels, t, axis);
                }
        EXPECT_EQ(visited, bricks.march(ray, 0, kFarVoxels, false).cells) << i;
        ++judged;
    }
    EXPECT_GT(judged, 50);
}

}  // namespace
}  // namespace kiln::field
