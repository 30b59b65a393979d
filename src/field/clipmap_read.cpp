// SPDX-License-Identifier: MIT
// Samples of a clipmap and rays through it: the texts that shaders read, over pages in ordinary memory.

#include "field/clipmap.h"

#include "field/brick_walk.gpu.h"
#include "field/host_bricks.h"

#include <algorithm>
#include <cmath>

namespace kiln::field {
namespace {

struct LevelsReader {
    const Clipmap& map;
    LevelsParams levels;

    explicit LevelsReader(const Clipmap& clipmap) : map(clipmap), levels(clipmap.params()) {}

    ivec3 level_first_cell(int level) const { return map.first_cell(level); }
    uint level_word(int level, ivec3 cell) const { return map.cell_word(level, cell); }
    float brick_texel(int slot, ivec3 t) const {
        return map.content(uint32_t(slot)).distance(size_t((t.z * kBrickTexels + t.y) * kBrickTexels + t.x));
    }
    static bool brick_voxel_solid(int, ivec3) { return true; }
    Corners brick_corners(int slot, ivec3 v) const {
        const BrickContent& brick = map.content(uint32_t(slot));
        const size_t at = size_t((v.z * kBrickTexels + v.y) * kBrickTexels + v.x);
        return {brick.distance(at),      brick.distance(at + 1),  brick.distance(at + 8),  brick.distance(at + 9),
                brick.distance(at + 64), brick.distance(at + 65), brick.distance(at + 72), brick.distance(at + 73)};
    }

#include "field/level_field.gpu.h"

#include "field/march.gpu.h"

#include "field/level_march.gpu.h"
};

}  // namespace

Clipmap::Sample Clipmap::sample(dvec3 p_world) const {
    LevelsReader reader(*this);
    Sample out;
    const double h = double(options_.voxel_size);
    const double away =
        std::max({std::fabs(p_world.x - focus_.x), std::fabs(p_world.y - focus_.y), std::fabs(p_world.z - focus_.z)});
    for (int level = reader.levels.first; level < reader.levels.count; ++level) {
        const double size = h * double(1 << level);
        const double t[3] = {p_world.x / size, p_world.y / size, p_world.z / size};
        if (away >= double(level_reach(options_.cells)) * h * double(1 << std::min(level, options_.levels - 1)))
            continue;
        const ivec3 voxel{int(std::floor(t[0])), int(std::floor(t[1])), int(std::floor(t[2]))};
        const ivec3 cell{cell_of_texel(voxel.x), cell_of_texel(voxel.y), cell_of_texel(voxel.z)};
        const uint32_t word = cell_word(level, cell);
        if (word == kCellMissing) continue;
        out.level = level;
        if ((word & kCellOccupied) == 0) {
            out.distance = (word & kCellInside) != 0 ? -voxel_size(level) : voxel_size(level);
            return out;
        }
        const ivec3 first{cell.x * kBrickVoxels, cell.y * kBrickVoxels, cell.z * kBrickVoxels};
        reader.enter_brick(level, word, first);
        const Corners c = reader.field_corners(int(word & kCellSlotMask), voxel - first);
        out.from_brick = true;
        out.distance = voxel_size(level) *
                       trilinear_value(c, {float(t[0] - voxel.x), float(t[1] - voxel.y), float(t[2] - voxel.z)});
        return out;
    }
    return out;
}

Clipmap::Hit Clipmap::cast(dvec3 origin_world, vec3 direction, double t_max, bool accelerate) const {
    LevelsReader reader(*this);
    const double h = double(options_.voxel_size);
    const LevelHit found = reader.level_march(texel_ray_of(origin_world, direction, options_.voxel_size), 0.0f,
                                              float(std::min(t_max / h, double(kFarVoxels))), accelerate);
    Hit out;
    out.state = found.hit.state;
    out.level = found.level;
    out.t = double(found.hit.t) * h;
    out.march = found.hit;
    if (out.state == kMarchHit) {
        const ivec3 voxel = found.hit.voxel;
        const vec3 p = found.hit.p;
        const vec3 g = reader.level_gradient(found.level, found.hit.cell,
                                             {float(voxel.x) + p.x, float(voxel.y) + p.y, float(voxel.z) + p.z});
        const float size = length(g);
        out.normal = size > 0 ? g / size : vec3{};
    }
    return out;
}

}  // namespace kiln::field
