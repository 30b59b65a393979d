// SPDX-License-Identifier: MIT
// Which texels and voxels of a brick are solid, as bits: found once by SIMD compares of codes, read by rays (which pass over voxels
// without a solid corner: a ray from outside meets no surface in them) and by both meshers.
#pragma once

#include "field/brick.gpu.h"

#include <array>
#include <cstddef>
#include <cstdint>

namespace kiln::field {

/// Bits of a slice of texels: bit y * 8 + x.
using Slice = uint64_t;

/// Solid texels (value <= 0) by z. A code's sign is its distance's in both formats. `texel_bytes`: 2: half_code(), 1: snorm8_code().
std::array<Slice, 8> solid_texels(const std::byte* codes, int texel_bytes);

/// The voxels of a brick with a solid corner, by z * 8 + y: bit x. 60 bytes, of which 55 mean something.
using SolidRows = std::array<uint8_t, 60>;

/// The smallest box with all of them: first and last voxel by axis, 3 bits each: x, y, z of the first, then of the last. kNoSolidBox where
/// there are none; else below it.
inline constexpr uint32_t kNoSolidBox = 1u << 18;
inline constexpr uint32_t solid_box(ivec3 first, ivec3 last) {
    return uint32_t(first.x | first.y << 3 | first.z << 6 | last.x << 9 | last.y << 12 | last.z << 15);
}

/// Fills the rows; the box.
uint32_t solid_voxels(const std::array<Slice, 8>& texels, SolidRows& rows);

}  // namespace kiln::field
