// SPDX-License-Identifier: MIT
// Host bricks: the texels of a field's bricks in ordinary memory, and questions answered from them. A value: a copy is cheap and shares every
// brick that did not change, so a snapshot is kept by copying. Reading is for any thread; update() is the owner's.
#pragma once

#include "field/codes.gpu.h"
#include "field/cubic.gpu.h"
#include "field/field.h"
#include "field/wide_tables.h"

#include <kiln/query.h>

#include <cstdint>
#include <memory>
#include <span>

namespace kiln::field {

/// How a normal is made from texels.
enum class NormalKind : uint8_t { Dual, Central, Tetrahedral };

class HostBricks {
public:
    /// Builds a field and its bricks in one go.
    static Result<HostBricks> build(std::shared_ptr<const sdf::Program> program, const FieldOptions& options);
    /// All bricks of `field`, on `workers` threads (0: all cores).
    static HostBricks bake(std::shared_ptr<const Field> field, int workers = 0);
    /// Brings it to `next`: only next's jobs where it was made from this field, else everything. `made`: those jobs' texels, where the
    /// maker of `next` has them already.
    void update(std::shared_ptr<const Field> next, int workers = 0, MadeBricks* made = nullptr);
    /// Brings field and bricks to `program`, which is this field's with `changes` made; see Field::update. Unchanged on failure.
    Result<void> update(std::shared_ptr<const sdf::Program> program, std::span<const RowChange> changes);

    const Field& field() const { return *field_; }
    int texel_bytes() const { return field_->options().format == DistanceFormat::Half ? 2 : 1; }
    const std::shared_ptr<const Field>& shared_field() const { return field_; }
    /// Of a slot in use.
    const BrickContent& content(uint32_t slot) const { return contents_[slot]; }
    /// Materials that found no place in the 16 entries of a brick's palette, over all bricks.
    uint64_t dropped_materials() const;
    /// Of texels and palettes, shared ones too.
    uint64_t bytes() const;

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

    /// Distances alone, metres, for many points at once: trilinear in bricks (where texels are cut off at the band, less than the
    /// distance); in empty cells as far as the empty cells around reach, with the right sign: a lower bound of the size; 0 outside
    /// the grid, where nothing is known. The same bits from every instruction set and from distance().
    void distances(const sdf::Points& points, float* out, sdf::Isa isa = sdf::best_isa()) const;
    float distance(const vec3& p_world) const {
        const WideView& view = wide_view();
        return view.distance(view, p_world);
    }
    float distance(const vec3& p_world, sdf::Isa isa) const;

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
    /// March of many rays at once: give them in an order in which neighbours see the same, so that what they read is still near.
    /// Each hit has the bits of march() from 0 to the ray's t_max, but for the counters, which stay 0.
    void march(std::span<const Ray> rays, MarchHit* hits, sdf::Isa isa = sdf::best_isa()) const;
    /// The same, then each moved to where its brick's own code has the surface, and what a ray only just passed looked at with that code too:
    /// what the edits themselves would show, but for one grazing ray in two thousand. A ray's answer does not depend on the others.
    void march_refined(std::span<const Ray> rays, MarchHit* hits, sdf::Isa isa = sdf::best_isa()) const;
    /// Not normalised, per voxel, at p in the brick of a world cell ([0, 7]³).
    vec3 gradient(uint32_t slot, ivec3 cell, vec3 p, NormalKind kind) const;

    /// Of what is stored where, slot numbers aside: equal for equal fields, however they came about.
    uint64_t hash() const;

private:
    void take(MadeBricks& made);
    void march(std::span<const Ray> rays, MarchHit* hits, bool refine, sdf::Isa isa) const;
    void bake_slots(std::span<const uint32_t> slots, int workers);
    void surface_at(uint32_t slot, ivec3 cell, ivec3 voxel, vec3 p, NormalKind kind, Sample& out) const;

    const WideView& wide_view() const { return tables_->view(*field_, contents_); }

    std::shared_ptr<const Field> field_;
    BrickContents contents_;
    std::shared_ptr<WideTables> tables_ = std::make_shared<WideTables>();  // of field_ and contents_ as they are
};

/// A world position as whole and fractional texel coordinates.
TexelRay texel_ray_of(dvec3 origin_world, vec3 direction, float voxel_size);

}  // namespace kiln::field
