// SPDX-License-Identifier: MIT
// Many points or rays at once through host bricks: one lane each, 16, 8 or 4 of them in step, by the widest instructions that the
// processor has. Every instruction set gives the same bytes, and a ray's hit has the bits of field_march() (march.gpu.h).
#pragma once

#include "field/brick.gpu.h"
#include "field/cubic.gpu.h"
#include "sdf/eval.h"

#include <array>
#include <cstddef>
#include <vector>

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
    /// By axis and texel, from the grid's first. The sum of a place's three: above, page * words of a page + word of its entry; below, its
    /// texel in the brick.
    std::array<const uint64_t*, 3> places{};
    /// wide_distance() by the best instructions there are.
    float (*distance)(const WideView& view, const vec3& p) = nullptr;

    WideView() = default;
    WideView(const GridParams& grid, const WidePage* const* pages, int pages_x, int pages_y, const uint32_t* ways,
             int texel_bytes, std::array<const uint64_t*, 3> places);
};
/// WideView::places of one axis; 0, 1, 2: x, y, z.
std::vector<uint64_t> wide_places(int axis, ivec3 size);

/// A ray in texels, counted from the grid's first, and how far it goes (voxels): four rows of four numbers.
struct alignas(64) WideRay {
    float inverse[3];  ///< the march's own, as `octant`
    float t_max;
    float direction[3];
    int32_t octant;
    float part[3];
    int32_t unused_after_part;
    int32_t whole[3];
    int32_t unused_after_whole;
};

/// A voxel with a solid corner that a ray left again.
struct NearPass {
    float least;     ///< lower bound of its value along the ray, voxels
    float from, to;  ///< the voxel's stretch of the ray
    ivec3 cell;      ///< world cell
};
/// What a march saw of a ray beside its hit.
struct RayNote {
    /// Where texels may have lost some: those with the least bounds, the least first; kNearPassVoxels where there is none.
    NearPass passes[2];
    float slope;  ///< of a kMarchHit's value there, along the ray
};
inline constexpr float kNearPassVoxels = 0.35f;

/// Rays that are moved to where code has the surface, all of one brick, counted from where they met that of the texels; voxels.
struct RayPolish {
    static constexpr int kMost = 64;
    enum : int32_t { kIdle, kOpen, kDone };
    static constexpr float kStepBack = 0.125f;  ///< of a ray that does not enter the solid where it is

    float voxel_size;                                              ///< metres
    float base[3];                                                 ///< the brick's first texel
    int round;                                                     ///< looks before
    alignas(64) float first[3][kMost], along[3][kMost];            // from `base`; direction
    alignas(64) float t[kMost], t_before[kMost], d_before[kMost];  // of the next look, and the last one with its value
    alignas(64) float slope[kMost];                                // before the first look
    alignas(64) int32_t state[kMost];
    alignas(64) int32_t voxel[3][kMost];  // where t is, as in MarchHit
    alignas(64) float p[3][kMost];
};
/// Where the next looks are, metres. `count` is a multiple of 16.
void wide_polish_looks(const RayPolish& rays, int count, float* x, float* y, float* z, sdf::Isa isa);
/// What follows from what they saw (metres): how many are to look again. Those done are at t, idle ones stay where they were.
int wide_polish_steps(RayPolish& rays, int count, const float* metres, sdf::Isa isa);
/// Fills in voxel and p.
void wide_polish_places(RayPolish& rays, int count, sdf::Isa isa);

/// out[i] = distance at point i, metres. See HostBricks::distances().
void wide_distances(const WideView& view, const sdf::Points& points, float* out, sdf::Isa isa);
/// The same for one point.
float wide_distance(const WideView& view, const vec3& p, sdf::Isa isa);
/// hits[i] = field_march(ray i, 0, t_max), but for `slot` (whether there is one: the caller knows it from the cell) and the counters
/// `cells` and `voxels`, which stay 0. notes[i]: ray i's, where asked for.
void wide_march(const WideView& view, WideRay* rays, int count, MarchHit* hits, RayNote* notes, sdf::Isa isa);

}  // namespace kiln::field
