// SPDX-License-Identifier: MIT
// Ground as triangles, by regions: cubes of kRegionCells bricks a side. A region's mesh is marching cubes of the exact field's texels, so
// the meshes of two regions have the same vertices on the face between them, bit for bit, and no triangle belongs to both.
//
// Contacts of a body belong to the region their point lies in: where that is meshed they come from its triangles, elsewhere from the
// field. A region's mesh goes on for a brick beyond its border (the apron), so that an edge there is seen to be an inner one; what is
// found on an apron is another region's, or the field's, to tell.
#pragma once

#include "field/brick.gpu.h"
#include "field/sdf_field.h"
#include "field/words.gpu.h"

#include <kiln/math.h>

#include <algorithm>
#include <cstdint>
#include <memory>
#include <unordered_map>
#include <vector>

namespace kiln::physics {

using field::ivec3;

inline constexpr int kRegionCells = 16;

struct RegionMesh {
    ivec3 region;
    float cell = 0;  ///< metres: side of a brick
    std::vector<vec3> vertices;
    std::vector<uint32_t> indices;  ///< three a triangle; those of the region by its bricks (z, y, x), then the apron's
    std::vector<uint32_t> first_of;    ///< by brick: its first triangle; one more at the end: how many the region has
    std::shared_ptr<const void> made;  ///< what an engine made of it (World::region_builder())

    uint32_t own() const { return first_of.empty() ? 0 : first_of.back(); }
    Box3 box() const;  ///< of the region
    /// visit(triangle) for the region's triangles of bricks that meet the box.
    template <typename Visit>
    void each(const Box3& box, Visit&& visit) const;
};

/// On one thread: milliseconds.
std::shared_ptr<RegionMesh> mesh_region(const field::SdfField& exact, float voxel_size, ivec3 region);

/// Those that are meshed. Never changes: others are made of it.
class Regions {
public:
    explicit Regions(float side) : side_(side) {}
    float side() const { return side_; }
    ivec3 region_of(vec3 p) const;
    size_t size() const { return meshes_.size(); }
    /// Null where the field is what bodies touch. `number` tells meshes apart.
    struct Entry {
        std::shared_ptr<const RegionMesh> mesh;
        uint32_t number = 0;
    };
    const Entry* find(ivec3 region) const;
    const Entry* numbered(uint32_t number) const;
    std::shared_ptr<const Regions> with(std::shared_ptr<const RegionMesh> mesh) const;
    std::shared_ptr<const Regions> without(const std::vector<ivec3>& regions) const;
    /// visit(entry) for those that the box meets, ascending; whether they cover it.
    template <typename Visit>
    bool each(const Box3& box, Visit&& visit) const;

private:
    float side_;
    std::unordered_map<uint64_t, Entry> meshes_;
    std::vector<uint64_t> by_number_;  // 0: free
};

uint64_t region_key(ivec3 region);

template <typename Visit>
bool Regions::each(const Box3& box, Visit&& visit) const {
    const ivec3 low = region_of(box.min), high = region_of(box.max);
    bool all = true;
    for (int z = low.z; z <= high.z; ++z)
        for (int y = low.y; y <= high.y; ++y)
            for (int x = low.x; x <= high.x; ++x) {
                if (const Entry* e = find({x, y, z})) {
                    visit(*e);
                } else {
                    all = false;
                }
            }
    return all;
}

template <typename Visit>
void RegionMesh::each(const Box3& wanted, Visit&& visit) const {
    if (own() == 0) return;
    const Box3 all = box();
    const auto brick = [&](float v, float low) {
        return std::min(std::max(int((v - low) / cell), 0), kRegionCells - 1);  // the cast brings what is below 0 to 0
    };
    // A triangle may lie in a face of its brick.
    const vec3 slack = vec3{1, 1, 1} * (1e-3f * cell), min = wanted.min - slack, max = wanted.max + slack;
    if (!all.overlaps({min, max})) return;
    for (int z = brick(min.z, all.min.z); z <= brick(max.z, all.min.z); ++z)
        for (int y = brick(min.y, all.min.y); y <= brick(max.y, all.min.y); ++y) {
            const size_t row = size_t(z * kRegionCells + y) * kRegionCells;
            const size_t from = row + size_t(brick(min.x, all.min.x)), to = row + size_t(brick(max.x, all.min.x)) + 1;
            for (uint32_t t = first_of[from]; t < first_of[to]; ++t) visit(t);
        }
}

}  // namespace kiln::physics
