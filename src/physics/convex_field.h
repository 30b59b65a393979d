// SPDX-License-Identifier: MIT
// A convex body as a field: its exact distance in closed form, so that whatever can be asked of fields can be asked of it.
#pragma once

#include "field/sdf_field.h"
#include "physics/convex.h"

namespace kiln::physics {

class ConvexField final : public field::SdfField {
public:
    explicit ConvexField(const Convex& convex) : convex_(convex) {}
    float distance(vec3 p) const override;
    float distance(vec3 p, vec3& gradient) const override;
    using SdfField::distances;
    void distances(const sdf::Points& points, float* out) const override;
    Box3 bounds() const override { return {-half_extents(convex_), half_extents(convex_)}; }

private:
    Convex convex_;
};

}  // namespace kiln::physics
