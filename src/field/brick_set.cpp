// SPDX-License-Identifier: MIT
#include "field/brick_set.h"

#include "base/assert.h"
#include "sdf/place.h"

#include <algorithm>
#include <vector>

namespace kiln::field {

namespace {

// Around the solid: a cell owns a brick up to a voxel away, and gradients look one further.
constexpr float kMarginVoxels = 2;

CellBox solid_voxels_of(const HostBricks& bricks) {
    const Field& f = bricks.field();
    const GridParams grid = f.grid();
    CellBox out{};
    const auto add = [&](ivec3 cell, ivec3 first, ivec3 last) {
        const ivec3 texel{(grid.cell_x + cell.x) * kBrickVoxels, (grid.cell_y + cell.y) * kBrickVoxels,
                          (grid.cell_z + cell.z) * kBrickVoxels};
        const CellBox box{{texel.x + first.x, texel.y + first.y, texel.z + first.z},
                          {texel.x + last.x + 1, texel.y + last.y + 1, texel.z + last.z + 1}};
        out = out.empty() ? box : joined(out, box);
    };
    for (int z = 0; z < grid.size_z; ++z) {
        for (int y = 0; y < grid.size_y; ++y) {
            for (int x = 0; x < grid.size_x; ++x) {
                const uint32_t word = f.cells().at(x, y, z);
                if ((word & kCellOccupied) != 0) {
                    const uint32_t box = bricks.content(word & kCellSlotMask).solid_box;
                    const auto at = [&](int shift) { return int(box >> shift & 7u); };
                    if (box < kNoSolidBox) add({x, y, z}, {at(0), at(3), at(6)}, {at(9), at(12), at(15)});
                } else if ((word & kCellInside) != 0) {
                    constexpr int last = kBrickVoxels - 1;
                    add({x, y, z}, {0, 0, 0}, {last, last, last});
                }
            }
        }
    }
    return out;
}

}  // namespace

float BrickSet::voxel_size_for(const sdf::Program& object, float field_voxel) {
    const Box3 solid = sdf::solid_box(object);
    const vec3 size = object.bounds.empty() ? vec3{} : object.bounds.max - object.bounds.min;
    const vec3 whole = solid.empty() ? vec3{} : solid.max - solid.min;
    const float least = std::min({size.x, size.y, size.z}), most = std::max({whole.x, whole.y, whole.z});
    const float wanted = least > 0 ? std::min(field_voxel, least / kLeastVoxels) : field_voxel;
    return std::max(wanted, most / kMostVoxels);
}

Hash128 BrickSet::key(const sdf::Program& object, float voxel_size, DistanceFormat format) {
    std::vector<std::byte> bytes;
    const auto add = [&](const auto* from, size_t count) {
        const auto part = std::as_bytes(std::span(from, count));
        bytes.insert(bytes.end(), part.begin(), part.end());
    };
    add(object.tape().data(), object.tape().size());
    add(object.params.data(), object.params.size());
    add(object.samples.data(), object.samples.size());
    add(&voxel_size, 1);
    add(&format, 1);
    return hash128(bytes);
}

Result<std::shared_ptr<const BrickSet>> BrickSet::make(std::shared_ptr<const sdf::Program> object, float voxel_size,
                                                       DistanceFormat format) {
    KILN_ASSERT(!object->unbounded, "a brick set of something without bounds");
    const Box3 solid = sdf::solid_box(*object);
    for (;; voxel_size *= 2) {
        const Box3 box = solid.empty() ? Box3{{0, 0, 0}, {0, 0, 0}} : solid;
        const FieldOptions options{.voxel_size = voxel_size,
                                   .bounds = box.inflated(kMarginVoxels * voxel_size),
                                   .format = format,
                                   .max_bricks = kMostBricks};
        auto made = HostBricks::build(object, options);
        if (!made) {
            if (made.error().kind == ErrorKind::OutOfMemory && voxel_size < 1e6f) continue;
            return made.error();
        }
        BrickSet out;
        out.bricks_ = std::move(*made);
        out.solid_voxels_ = solid_voxels_of(out.bricks_);
        return std::make_shared<const BrickSet>(std::move(out));
    }
}

}  // namespace kiln::field
