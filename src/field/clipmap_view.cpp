// SPDX-License-Identifier: MIT
// What a picture may show of the cells that are missing, and so is made first.
//
// A group of cells counts as seen where it comes to within a cell of the view's pyramid. A cell that is made must have the coarser level there and in
// the cells around (levels.gpu.h), so what is under a seen group and beside it counts too, down to the last level. The view is a hint: it says
// what comes first and leaves nothing out. Nor is anything held back for lying behind what is solid (docs/architecture.md has the count).

#include "field/clipmap.h"

#include <array>
#include <cmath>

namespace kiln::field {
namespace {

// Half-spaces through the eye whose common part is the view, by their unit normals.
std::array<vec3, 5> sides_of(const BakeView& view) {
    const auto side = [&](vec3 towards) { return normalize(view.forward * dot(towards, towards) - towards); };
    return {normalize(view.forward), side(view.right), side(-view.right), side(view.up), side(-view.up)};
}

// Cells: beside a missing one corners are a mix of two levels (level_field.gpu.h), so what is seen must have its neighbours to be final.
constexpr double kMargin = 1;

// First cell of one of a block's groups.
ivec3 group_in(ivec3 block, int i) {
    return block + ivec3{kGroupCells * (i & 3), kGroupCells * (i >> 2 & 3), kGroupCells * (i >> 4)};
}

// A cube round `middle`, which counts from the eye.
bool may_see(const std::array<vec3, 5>& sides, vec3 middle, float half) {
    for (const vec3& n : sides) {
        if (dot(n, middle) < -half * (std::fabs(n.x) + std::fabs(n.y) + std::fabs(n.z))) return false;
    }
    return true;
}

}  // namespace

std::vector<CellGroups> Clipmap::seen_groups(const BakeView& view) const {
    const std::array<vec3, 5> sides = sides_of(view);
    std::vector<CellGroups> out(size_t(options_.levels), CellGroups(options_.cells));
    for (int level = 0; level < options_.levels; ++level) {
        const double side = double(voxel_size(level)) * kBrickVoxels;
        const auto sees = [&](ivec3 first, int cells) {
            const double half = 0.5 * cells;
            const vec3 middle{float((first.x + half) * side - view.eye.x), float((first.y + half) * side - view.eye.y),
                              float((first.z + half) * side - view.eye.z)};
            return may_see(sides, middle, float((half + kMargin) * side));
        };
        const std::vector<ivec3>& blocks = levels_[size_t(level)].blocks;
        const CellBox window = this->window(level);
        for (const ivec3 block : blocks) {
            if (!sees(block, kBlockCells)) continue;
            uint64_t seen = 0;
            for (int i = 0; i < 64; ++i) {
                const ivec3 first = group_in(block, i);
                // Others could take the place of a group at the window's far side.
                if (!meet(CellBox{first, first + all_of(kGroupCells)}, window)) continue;
                if (sees(first, kGroupCells)) seen |= CellGroups::bit(first);
            }
            out[size_t(level)].add(block, seen);
        }
        if (level + 1 == options_.levels) break;
        // What is under a group of four cells and beside that is four cells of the coarser level, from an odd one on.
        CellGroups& coarser = out[size_t(level) + 1];
        for (const ivec3 block : blocks) {
            const uint64_t seen = out[size_t(level)].of(block);
            for (int i = 0; i < 64; ++i) {
                const ivec3 first = group_in(block, i);
                if ((seen & CellGroups::bit(first)) == 0) continue;
                for (int corner = 0; corner < 8; ++corner) {
                    const auto axis = [&](int a, int far) { return (a >> 1) - 1 + 3 * (corner >> far & 1); };
                    const ivec3 cell{axis(first.x, 0), axis(first.y, 1), axis(first.z, 2)};
                    const auto begin = [](int a) { return a & ~(kBlockCells - 1); };
                    coarser.add({begin(cell.x), begin(cell.y), begin(cell.z)}, CellGroups::bit(cell));
                }
            }
        }
    }
    return out;
}

}  // namespace kiln::field
