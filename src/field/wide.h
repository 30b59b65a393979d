// SPDX-License-Identifier: MIT
// Many points or rays at once through host bricks: one lane each, 16, 8 or 4 of them in step, by the widest instructions that the
// processor has. Every instruction set gives the same bytes, and a ray's hit has the bits of field_march() (march.gpu.h).
#pragma once

#include "field/brick.gpu.h"
#include "field/cubic.gpu.h"
#include "sdf/eval.h"

#include <array>
#include <cstddef>

namespace kiln::field {

/// What the wide loops know of a cell, in one word: where to read codes (always somewhere), whether there is a brick; else sign and jump. By
/// cell_word_index(). Addresses have 47 bits and are multiples of 16.
using WideEntry = uint64_t;
using WidePage = std::array<WideEntry, kCellPage * kCellPage * kCellPage>;
inline constexpr WideEntry kWideOccupied = 1ull << 63;
inline constexpr WideEntry kWideInside = 1ull << 62;  // of an empty cell
inline constexpr int kWideJumpShift = 48;             // three bits, of an empty cell
inline constexpr WideEntry kWideAddress = (1ull << 47) - 16;

WideEntry wide_entry_of_brick(const std::byte* codes);
/// Of an empty cell's word.
WideEntry wide_entry_of_empty(uint32_t word);

/// Where the wide loops find a field. Lives as long as the pages and bricks it was made of.
struct WideView {
    GridParams grid{};
    const WidePage* const* pages = nullptr;  ///< never null, by page of cells
    int pages_x = 0, pages_y = 0;
    const uint32_t* ways = nullptr;  ///< Ways::words()
    int texel_bytes = 2;             ///< 2: half_code(), 1: snorm8_code()
    // For one point: voxels a metre; first and past-the-last texel by axis, the fourth always holds 0.
    float inverse_voxel = 1;
    alignas(16) std::array<float, 4> low{}, high{};

    WideView() = default;
    WideView(const GridParams& grid, const WidePage* const* pages, int pages_x, int pages_y, const uint32_t* ways,
             int texel_bytes);
};

/// Rays in texels, as arrays: TexelRay's fields without `inverse`, and how far each goes (voxels).
struct WideRays {
    const int32_t* whole[3];
    const float* part[3];
    const float* direction[3];
    const float* t_max;
};

/// Where a ray came nearest to what it did not meet: of the voxels with a solid corner that it left again, its value rising, the one whose
/// values along the ray have the least lower bound.
struct NearPass {
    float least;     ///< that bound, voxels; kNearPassVoxels: there is none below it
    float from, to;  ///< the voxel's stretch of the ray
    ivec3 cell;      ///< world cell
};
inline constexpr float kNearPassVoxels = 0.5f;

/// out[i] = distance at point i, metres. See HostBricks::distances().
void wide_distances(const WideView& view, const sdf::Points& points, float* out, sdf::Isa isa);
/// The same for one point.
float wide_distance(const WideView& view, vec3 p, sdf::Isa isa);
/// hits[i] = field_march(ray i, 0, t_max), but for `slot` (whether there is one: the caller knows it from the cell) and the counters
/// `cells` and `voxels`, which stay 0. passes[i]: ray i's, where asked for.
void wide_march(const WideView& view, const WideRays& rays, int count, MarchHit* hits, NearPass* passes, sdf::Isa isa);

}  // namespace kiln::field
