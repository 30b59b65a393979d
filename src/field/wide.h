// SPDX-License-Identifier: MIT
// Many points or rays at once through host bricks: one lane each, 16, 8 or 4 of them in step, by the widest instructions that the
// processor has. Every instruction set gives the same bytes, and a ray's hit has the bits of field_march() (march.gpu.h).
#pragma once

#include "field/brick.gpu.h"
#include "field/cubic.gpu.h"
#include "sdf/eval.h"

#include <cstddef>

namespace kiln::field {

/// Which voxels of a brick have a solid corner, so that a surface may be in them: byte z * 8 + y, bit x.
inline constexpr int kSolidMaskBytes = 64;
void solid_mask(const std::byte* texels, int texel_bytes, std::byte* out);

/// Where the wide loops find a field: what they gather from. Lives as long as the bricks it was made of.
struct WideView {
    GridParams grid{};
    const uint32_t* cells = nullptr;           ///< cell words by index in the grid
    const std::byte* const* bricks = nullptr;  ///< codes by slot, of at least one
    int texel_bytes = 2;                       ///< 2: half_code(), 1: snorm8_code()
    const std::byte* solid =
        nullptr;  ///< solid_mask() of slot s at s * kSolidMaskBytes, three more bytes at the end; rays only
};

/// Rays in texels, as arrays: TexelRay's fields without `inverse`, and how far each goes (voxels).
struct WideRays {
    const int32_t* whole[3];
    const float* part[3];
    const float* direction[3];
    const float* t_max;
};

/// out[i] = distance at point i, metres. See HostBricks::distances().
void wide_distances(const WideView& view, const sdf::Points& points, float* out, sdf::Isa isa);
/// The same for one point: three axes in step instead of many points, and no branch on where the point is.
float wide_distance(const WideView& view, vec3 p);
/// hits[i] = field_march(ray i, 0, t_max), but for the counters `cells` and `voxels`, which stay 0.
void wide_march(const WideView& view, const WideRays& rays, int count, MarchHit* hits, sdf::Isa isa);

}  // namespace kiln::field
