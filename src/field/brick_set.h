// SPDX-License-Identifier: MIT
// Brick set: an object baked once, in its own frame, by what bakes the world. Whatever looks alike shares one, and a pose is all that
// makes two of it. Immutable; any thread.
#pragma once

#include "base/hash.h"
#include "field/host_bricks.h"
#include "field/jumps.h"

#include <memory>

namespace kiln::field {

class BrickSet {
public:
    /// Voxels for an object beside a field of `field_voxel`: as fine, and fine enough for its smallest side; but no longest side of more
    /// than kMostVoxels.
    static float voxel_size_for(const sdf::Program& object, float field_voxel);
    static constexpr float kLeastVoxels = 32;  ///< along the smallest side
    static constexpr float kMostVoxels = 1024;
    static constexpr uint32_t kMostBricks = 1u << 16;
    /// Equal for objects that look alike: of code and numbers.
    static Hash128 key(const sdf::Program& object, float voxel_size, DistanceFormat format);

    /// `object` counts from the object's own origin and is bounded; parts without a material are of material 0. Voxels are doubled
    /// where it would need more than kMostBricks.
    static Result<std::shared_ptr<const BrickSet>> make(std::shared_ptr<const sdf::Program> object, float voxel_size,
                                                        DistanceFormat format = DistanceFormat::Half);

    const sdf::Program& program() const { return bricks_.field().program(); }
    const HostBricks& bricks() const { return bricks_; }
    const Field& field() const { return bricks_.field(); }
    float voxel_size() const { return field().options().voxel_size; }
    /// Holds all that is solid, and the bricks around it.
    const Box3& box() const { return field().options().bounds; }
    /// All voxels that hold some of the surface or lie within, from the object's origin; empty where nothing is solid. Rays meet the
    /// object nowhere else.
    const CellBox& solid_voxels() const { return solid_voxels_; }

private:
    BrickSet() = default;
    HostBricks bricks_;
    CellBox solid_voxels_{};
};

}  // namespace kiln::field
