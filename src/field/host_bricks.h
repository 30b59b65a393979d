// SPDX-License-Identifier: MIT
// Host bricks: the texels of a field's bricks in ordinary memory, baked on the CPU from the same jobs as the GPU's, and questions
// answered from them. Reading is for any thread; update() is the owner's.
//
// Layout, by slot: 512 distance codes (2 bytes: half_code(); 1 byte: snorm8_code()) and 512 material words (2 bytes), x fastest,
// then y, then z; 16 palette entries (4 bytes), ascending material numbers, the unused ones kNoMaterial.
// Material words are those of codes.gpu.h; texels outside the band (|d| >= 4 voxels) hold 0: no surface ever asks them.
#pragma once

#include "field/codes.gpu.h"
#include "field/cubic.gpu.h"
#include "field/field.h"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace kiln::field {

/// How a normal is made from texels.
enum class NormalKind : uint8_t { Dual, Central, Tetrahedral };

/// What a brick's texels are, before anything is packed.
struct BrickTexels {
    float distance[kBrickTexelCount];     ///< metres, not clamped
    uint16_t material[kBrickTexelCount];  ///< words
    uint32_t palette[kPaletteSize];
    uint32_t dropped;  ///< materials that found no place in the palette
};

/// Evaluates one job. Any thread.
void bake_brick(const Field& field, const BrickJob& job, BrickTexels& out);

class HostBricks {
public:
    /// All bricks of `field`, on `workers` threads (0: all cores).
    static HostBricks bake(std::shared_ptr<const Field> field, int workers = 0);
    /// Brings it to `next`: only next's jobs where it was made from this field, else everything.
    void update(std::shared_ptr<const Field> next, int workers = 0);

    const Field& field() const { return *field_; }
    int texel_bytes() const { return field_->options().format == DistanceFormat::Half ? 2 : 1; }
    std::span<const std::byte> distances() const { return distances_; }
    std::span<const uint16_t> materials() const { return materials_; }
    std::span<const uint32_t> palettes() const { return palettes_; }
    /// Materials that found no place in the 16 entries of a brick's palette, over all bricks.
    uint64_t dropped_materials() const;
    uint64_t bytes() const { return distances_.size() + materials_.size() * 2 + palettes_.size() * 4; }

    /// Stored value of a texel (0 … 7 an axis), voxels.
    float texel(uint32_t slot, int x, int y, int z) const;
    Corners corners(uint32_t slot, ivec3 voxel) const;

    struct Sample {
        double distance = 0;                    ///< metres, negative inside
        vec3 normal;                            ///< unit; 0 where the gradient vanishes
        uint16_t material0 = 0, material1 = 0;  ///< material numbers, the heaviest first; equal when there is one
        float share = 0;                        ///< the second's, [0, 1/2]
        bool from_brick = false;
    };
    /// Trilinear where a brick is and none of the eight texels is cut off at the band; elsewhere the exact program.
    Sample sample(dvec3 p_world, NormalKind kind = NormalKind::Dual) const;

    struct Hit {
        int state = kMarchMiss;  ///< kMarchMiss, kMarchHit, kMarchInside
        double t = 0;            ///< metres
        Sample surface;          ///< of a kMarchHit; its distance is 0
        MarchHit march;
    };
    /// First solid point along a ray through the grid; `direction` has unit length, t_max is in metres.
    Hit cast(dvec3 origin_world, vec3 direction, double t_max, NormalKind kind = NormalKind::Dual,
             bool accelerate = true) const;
    /// The march alone, in voxels.
    MarchHit march(const TexelRay& ray, float t_min, float t_max, bool accelerate = true) const;
    /// Not normalised, per voxel, at p in the brick of a world cell ([0, 7]³).
    vec3 gradient(uint32_t slot, ivec3 cell, vec3 p, NormalKind kind) const;

    /// Of what is stored where, slot numbers aside: equal for equal fields, however they came about.
    uint64_t hash() const;

private:
    void store(const BrickJob& job, const BrickTexels& texels);
    void bake_jobs(std::span<const BrickJob> jobs, int workers);
    void surface_at(uint32_t slot, ivec3 cell, ivec3 voxel, vec3 p, NormalKind kind, Sample& out) const;

    std::shared_ptr<const Field> field_;
    std::vector<std::byte> distances_;
    std::vector<uint16_t> materials_;
    std::vector<uint32_t> palettes_;
    std::vector<uint32_t> dropped_;  // by slot
};

/// A world position as whole and fractional texel coordinates.
TexelRay texel_ray_of(dvec3 origin_world, vec3 direction, float voxel_size);

}  // namespace kiln::field
