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

/// What the wide loops know of a cell, in one word: where to read codes (always somewhere), and, where it has a brick, its solid box: 16 bits
/// above the address and two below; else sign and jump. By cell_word_index(). Addresses have 47 bits and are multiples of 16.
using WideEntry = uint64_t;
using WidePage = std::array<WideEntry, kCellPage * kCellPage * kCellPage>;
inline constexpr WideEntry kWideOccupied = 1ull << 63;
inline constexpr WideEntry kWideInside = 1ull << 62;  // of an empty cell
inline constexpr int kWideJumpShift = 48;             // three bits, of an empty cell
inline constexpr int kWideBoxShift = 47;              // 16 bits, of a brick
inline constexpr WideEntry kWideAddress = (1ull << 47) - 16;

WideEntry wide_entry_of_brick(const std::byte* codes, uint32_t solid_box);
inline uint32_t wide_solid_box(WideEntry of_brick) {
    return uint32_t(of_brick >> kWideBoxShift & 0xffff) << 2 | uint32_t(of_brick & 3);
}
/// Of an empty cell's word.
WideEntry wide_entry_of_empty(uint32_t word);

/// What a ray asks of a cell, in a byte: whether to enter, else how many cells around it are empty too.
inline constexpr uint8_t kWaySolid = 0x80;   // a brick with some solid texel: rays look at no other bricks
inline constexpr uint8_t kWayInside = 0x40;  // empty, in solid
inline constexpr uint8_t kWayReach = 7;
inline constexpr int kWayPadding = 3;  // bytes behind the last cell's
uint8_t wide_way_of(uint32_t word, bool solid);

/// Where the wide loops find a field. Lives as long as the pages and bricks it was made of.
struct WideView {
    GridParams grid{};
    const WidePage* const* pages = nullptr;  ///< never null, by page of cells
    int pages_x = 0, pages_y = 0;
    const uint8_t* ways = nullptr;  ///< wide_way_of(), by (z * size_y + y) * size_x + x
    int texel_bytes = 2;            ///< 2: half_code(), 1: snorm8_code()
    // For one point: voxels a metre; first and past-the-last texel by axis, the fourth always holds 0.
    float inverse_voxel = 1;
    alignas(16) std::array<float, 4> low{}, high{};

    WideView() = default;
    WideView(const GridParams& grid, const WidePage* const* pages, int pages_x, int pages_y, const uint8_t* ways,
             int texel_bytes);
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
/// The same for one point.
float wide_distance(const WideView& view, vec3 p, sdf::Isa isa);
/// hits[i] = field_march(ray i, 0, t_max), but for `slot` (whether there is one: the caller knows it from the cell) and the counters
/// `cells` and `voxels`, which stay 0.
void wide_march(const WideView& view, const WideRays& rays, int count, MarchHit* hits, sdf::Isa isa);

}  // namespace kiln::field
