// SPDX-License-Identifier: MIT
// SdfShape: a field as the shape of a body. Bodies that move also have points of its surface, and mass properties integrated from it.
#pragma once

#include "field/sdf_field.h"

#include <kiln/result.h>

#include <memory>
#include <vector>

namespace kiln::physics {

class Regions;

/// In the body's frame. `moments` are about the centre along the axes of `axes` (body = axes · principal).
struct MassProperties {
    double mass = 0;  ///< kg
    vec3 center{};
    quat axes{};
    dvec3 moments{};
};
/// From the symmetric inertia tensor about the centre: xx, yy, zz, xy, xz, yz.
MassProperties principal(double mass, vec3 center, const double (&inertia)[6]);

class SdfShape {
public:
    /// Of a world that never moves. `bricks`: the same solid for contacts to be found on, within a quarter of a voxel of `field`
    /// (field::BrickField); null: `field` itself.
    static std::shared_ptr<const SdfShape> fixed(std::shared_ptr<const field::SdfField> field,
                                                 std::shared_ptr<const field::SdfField> bricks = nullptr);
    /// Of a body. Fails when the solid has no volume, or no end. Integrates and samples: milliseconds.
    static Result<std::shared_ptr<const SdfShape>> moving(std::shared_ptr<const field::SdfField> field,
                                                          std::shared_ptr<const field::SdfField> bricks = nullptr);
    /// The same with bricks(): null where they need no renewal (SdfField::renewed()).
    std::shared_ptr<const SdfShape> renewed() const;
    /// The same as ground of which some regions are meshed.
    std::shared_ptr<const SdfShape> with(std::shared_ptr<const Regions> regions) const;
    /// The same with another mass for 1 kg/m³: of a mesh that bounds it more exactly than a grid does.
    std::shared_ptr<const SdfShape> with(const MassProperties& mass) const;
    /// Null where none ever is: convex bodies touch the field everywhere.
    const Regions* regions() const { return regions_.get(); }

    /// What questions and casts are answered from.
    const field::SdfField& field() const { return *field_; }
    const std::shared_ptr<const field::SdfField>& shared_field() const { return field_; }
    /// What contacts are found on.
    const field::SdfField& bricks() const { return *bricks_; }
    /// What a walk down the surface is led by: the field where it is short, which then costs no more than its bricks and has no facets.
    const field::SdfField& slope() const { return *slope_; }
    Box3 bounds() const { return bounds_; }
    bool moves() const { return !groups_.empty(); }
    /// For a density of 1 kg/m³.
    const MassProperties& mass() const { return mass_; }
    double inner_radius() const { return inner_radius_; }
    /// Mean distance of neighbouring surface points, metres.
    float spacing() const { return spacing_; }

    /// A run of neighbouring surface points, and a ball around them.
    struct Group {
        int first = 0, count = 0;
        vec3 center{};
        float radius = 0;
    };
    const std::vector<Group>& groups() const { return groups_; }
    /// On the surface to within a thousandth of the spacing.
    vec3 point(int i) const { return {x_[size_t(i)], y_[size_t(i)], z_[size_t(i)]}; }
    int point_count() const { return int(x_.size()); }

private:
    SdfShape() = default;
    void take(std::shared_ptr<const field::SdfField> field, std::shared_ptr<const field::SdfField> bricks);
    void sample_surface();
    std::shared_ptr<const field::SdfField> field_, bricks_;
    const field::SdfField* slope_ = nullptr;  // one of them
    Box3 bounds_;
    MassProperties mass_;
    double inner_radius_ = 0;
    float spacing_ = 0;
    std::vector<float> x_, y_, z_;
    std::vector<Group> groups_;
    std::shared_ptr<const Regions> regions_;
};

}  // namespace kiln::physics
