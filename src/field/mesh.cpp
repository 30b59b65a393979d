// SPDX-License-Identifier: MIT
#include "field/mesh.h"

#include <algorithm>

namespace kiln::field {
namespace {

std::vector<MeshBrick> bricks_of(const HostBricks& host) {
    const Field& field = host.field();
    std::vector<MeshBrick> out;
    for (const uint32_t slot : field.slots()) {
        const BrickRecord& r = field.records()[slot];
        const ivec3 cell{r.texel_x / kBrickVoxels, r.texel_y / kBrickVoxels, r.texel_z / kBrickVoxels};
        out.push_back({cell, slot, host.content(slot).codes()});
    }
    return out;
}

// By cell, so that a small region costs little in a large field.
std::vector<MeshBrick> bricks_of(const HostBricks& host, const MeshRegion& region) {
    const GridParams g = host.field().grid();
    std::vector<MeshBrick> out;
    for (int z = std::max(region.min.z, g.cell_z); z < std::min(region.max.z, g.cell_z + g.size_z); ++z) {
        for (int y = std::max(region.min.y, g.cell_y); y < std::min(region.max.y, g.cell_y + g.size_y); ++y) {
            for (int x = std::max(region.min.x, g.cell_x); x < std::min(region.max.x, g.cell_x + g.size_x); ++x) {
                const uint32_t word = host.field().cell_word(x, y, z);
                if ((word & kCellOccupied) == 0) continue;
                const uint32_t slot = word & kCellSlotMask;
                out.push_back({{x, y, z}, slot, host.content(slot).codes()});
            }
        }
    }
    return out;
}

// Stable counting sort by one coordinate.
template <typename Key>
void sort_by(std::vector<MeshBrick>& bricks, std::vector<MeshBrick>& spare, int low, int size, Key&& key) {
    std::vector<uint32_t> first(size_t(size) + 1);
    for (const MeshBrick& b : bricks) ++first[size_t(key(b) - low) + 1];
    for (size_t i = 1; i < first.size(); ++i) first[i] += first[i - 1];
    spare.resize(bricks.size());
    for (const MeshBrick& b : bricks) spare[first[size_t(key(b) - low)]++] = b;
    bricks.swap(spare);
}

}  // namespace

MeshBricks::MeshBricks(const HostBricks& bricks)
    : bricks_(bricks_of(bricks)),
      format_(bricks.field().options().format),
      voxel_size_(bricks.field().grid().voxel_size) {
    index();
}

MeshBricks::MeshBricks(const HostBricks& bricks, const MeshRegion& region)
    : bricks_(bricks_of(bricks, region)),
      format_(bricks.field().options().format),
      voxel_size_(bricks.field().grid().voxel_size) {
    index();
}

MeshBricks::MeshBricks(std::vector<MeshBrick> bricks, DistanceFormat format, float voxel_size)
    : bricks_(std::move(bricks)), format_(format), voxel_size_(voxel_size) {
    index();
}

void MeshBricks::index() {
    if (bricks_.empty()) return;
    low_ = bricks_.front().cell;
    ivec3 high = low_;
    for (const MeshBrick& b : bricks_) {
        low_ = {std::min(low_.x, b.cell.x), std::min(low_.y, b.cell.y), std::min(low_.z, b.cell.z)};
        high = {std::max(high.x, b.cell.x), std::max(high.y, b.cell.y), std::max(high.z, b.cell.z)};
    }
    size_ = high - low_ + ivec3{1, 1, 1};
    std::vector<MeshBrick> spare;
    sort_by(bricks_, spare, low_.x, size_.x, [](const MeshBrick& b) { return b.cell.x; });
    sort_by(bricks_, spare, low_.y, size_.y, [](const MeshBrick& b) { return b.cell.y; });
    sort_by(bricks_, spare, low_.z, size_.z, [](const MeshBrick& b) { return b.cell.z; });

    row_at_.assign(size_t(size_.y) * size_t(size_.z), -1);
    for (uint32_t i = 0; i < bricks_.size(); ++i) {
        const ivec3 cell = bricks_[i].cell;
        if (rows_.empty() || rows_.back().y != cell.y || rows_.back().z != cell.z) {
            row_at_[size_t(cell.z - low_.z) * size_t(size_.y) + size_t(cell.y - low_.y)] = int32_t(rows_.size());
            rows_.push_back({cell.y, cell.z, i, i});
        }
        rows_.back().end = i + 1;
    }
}

const MeshBricks::Row* MeshBricks::row(int y, int z) const {
    y -= low_.y;
    z -= low_.z;
    if (y < 0 || z < 0 || y >= size_.y || z >= size_.z) return nullptr;
    const int32_t at = row_at_[size_t(z) * size_t(size_.y) + size_t(y)];
    return at < 0 ? nullptr : &rows_[size_t(at)];
}

}  // namespace kiln::field
