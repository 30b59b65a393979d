// SPDX-License-Identifier: MIT
// The host part of the shape texts, compiled once.

#include "sdf/bounds.h"

#include "sdf/custom.h"
#include "sdf/eval_isa.h"
#include "sdf/tables.h"

#include <limits>

namespace kiln::sdf {

namespace host {
#define KILN_SCALAR float
#define KILN_HOST
#include "sdf/lang/scalar.h"

#include "sdf/lang/host.h"
#define KILN_T real
#include "sdf/lang/trig.sdf.h"
#undef KILN_T
#include "sdf/texts.gen.inl"
}  // namespace host

namespace {

host::Bounds to_host(const Box3& b) {
    return {host::param3(b.min.x, b.min.y, b.min.z), host::param3(b.max.x, b.max.y, b.max.z)};
}
Box3 from_host(const host::Bounds& b) { return {{b.lo.x, b.lo.y, b.lo.z}, {b.hi.x, b.hi.y, b.hi.z}}; }

}  // namespace

Box3 shape_bounds(const Shape& shape) {
    if (shape_rows()[shape.kind].how == KindRow::Custom) {
        const auto custom = check_custom(shape);
        return custom ? Box3{-custom->half_extents, custom->half_extents} : Box3{};
    }
    return from_host(host::shape_bounds(shape.kind, shape.params.data()));
}

Box3 warp_bounds(const Warp& warp, const Box3& child, float rate) {
    const Box3 out = from_host(host::warp_bounds(warp.kind, warp.params.data(), to_host(child)));
    if (warp_rows()[warp.kind].how != KindRow::Value || rate == 1.0f) return out;
    // The texts say how far the surface moves where the value is a distance; where it grows slower it moves farther.
    const auto farther = [&](float from, float to) { return std::isfinite(from) ? from + (to - from) / rate : from; };
    return {{farther(child.min.x, out.min.x), farther(child.min.y, out.min.y), farther(child.min.z, out.min.z)},
            {farther(child.max.x, out.max.x), farther(child.max.y, out.max.y), farther(child.max.z, out.max.z)}};
}

float warp_lipschitz(const Warp& warp, const Box3& region) {
    const float l = host::warp_lipschitz(warp.kind, warp.params.data(), to_host(region));
    return l >= 1.0f ? l : (l < 1.0f ? 1.0f : std::numeric_limits<float>::infinity());  // NaN: unbounded region
}

vec3 second_copies(const Warp& warp, const Box3& region) {
    const host::param3 s = host::second_copies(warp.kind, warp.params.data(), to_host(region));
    return {s.x, s.y, s.z};
}

Box3 transformed_box(const Box3& box, const Transform& transform) {
    const float lo[3] = {box.min.x, box.min.y, box.min.z};
    const float hi[3] = {box.max.x, box.max.y, box.max.z};
    const float scale[3] = {transform.scale.x, transform.scale.y, transform.scale.z};
    const vec3 axes[3] = {rotate(transform.rotation, {1, 0, 0}), rotate(transform.rotation, {0, 1, 0}),
                          rotate(transform.rotation, {0, 0, 1})};
    float out_lo[3] = {transform.position.x, transform.position.y, transform.position.z};
    float out_hi[3] = {out_lo[0], out_lo[1], out_lo[2]};
    for (int j = 0; j < 3; ++j) {
        const float column[3] = {axes[j].x, axes[j].y, axes[j].z};
        for (int i = 0; i < 3; ++i) {
            // An axis that is turned away only by rounding must not carry an infinite face over.
            if (std::fabs(column[i]) < 1e-7f) continue;
            const float a = column[i] * (scale[j] * lo[j]);
            const float b = column[i] * (scale[j] * hi[j]);
            out_lo[i] += std::min(a, b);
            out_hi[i] += std::max(a, b);
        }
    }
    return {{out_lo[0], out_lo[1], out_lo[2]}, {out_hi[0], out_hi[1], out_hi[2]}};
}

float smallest_scale(const Transform& transform) {
    return std::min({transform.scale.x, transform.scale.y, transform.scale.z});
}

float largest_scale(const Transform& transform) {
    return std::max({transform.scale.x, transform.scale.y, transform.scale.z});
}

}  // namespace kiln::sdf
