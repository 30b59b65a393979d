// SPDX-License-Identifier: MIT
// Chooses the instruction set at run time.

#include "field/wide.h"

#include "field/wide_isa.h"

namespace kiln::field {
namespace {

// Where points without a brick read: what they find is not looked at.
alignas(64) constexpr std::byte kNoTexels[2 * kBrickTexelCount] = {};

WideEntry address_of(const std::byte* codes) { return WideEntry(reinterpret_cast<uintptr_t>(codes)) & kWideAddress; }

}  // namespace

WideEntry wide_entry_of_brick(const std::byte* codes) { return kWideOccupied | address_of(codes); }
WideEntry wide_entry_of_empty(uint32_t word) {
    return ((word & kCellInside) != 0 ? kWideInside : 0) | WideEntry(word & 7u) << kWideJumpShift |
           address_of(kNoTexels);
}

WideView::WideView(const GridParams& g, const WidePage* const* first_page, int along_x, int along_y,
                   const uint32_t* first_way, int bytes)
    : grid(g),
      pages(first_page),
      pages_x(along_x),
      pages_y(along_y),
      ways(first_way),
      texel_bytes(bytes),
      inverse_voxel(1.0f / g.voxel_size) {
    const int cell[3] = {g.cell_x, g.cell_y, g.cell_z}, size[3] = {g.size_x, g.size_y, g.size_z};
    for (size_t axis = 0; axis < 3; ++axis) {
        low[axis] = float(cell[axis] * kBrickVoxels);
        high[axis] = float((cell[axis] + size[axis]) * kBrickVoxels);
    }
    high[3] = 1;
}

float wide_distance(const WideView& view, vec3 p, sdf::Isa isa) {
    const auto run = isa == sdf::Isa::Avx512 ? &wide_avx512::distance
                     : isa == sdf::Isa::Avx2 ? &wide_avx2::distance
                     : isa == sdf::Isa::Sse4 ? &wide_sse4::distance
                                             : &wide_scalar::distance;
    return run(view, p);
}

void wide_distances(const WideView& view, const sdf::Points& points, float* out, sdf::Isa isa) {
    const auto run = isa == sdf::Isa::Avx512 ? &wide_avx512::distances
                     : isa == sdf::Isa::Avx2 ? &wide_avx2::distances
                     : isa == sdf::Isa::Sse4 ? &wide_sse4::distances
                                             : &wide_scalar::distances;
    run(view, points, out);
}

#define KILN_CHOOSE_WIDE(isa, name)               \
    (isa == sdf::Isa::Avx512 ? &wide_avx512::name \
     : isa == sdf::Isa::Avx2 ? &wide_avx2::name   \
     : isa == sdf::Isa::Sse4 ? &wide_sse4::name   \
                             : &wide_scalar::name)

void wide_polish_looks(const RayPolish& rays, int count, float* x, float* y, float* z, sdf::Isa isa) {
    KILN_CHOOSE_WIDE(isa, polish_looks)(rays, count, x, y, z);
}

int wide_polish_steps(RayPolish& rays, int count, const float* metres, sdf::Isa isa) {
    return KILN_CHOOSE_WIDE(isa, polish_steps)(rays, count, metres);
}

void wide_polish_places(RayPolish& rays, int count, sdf::Isa isa) { KILN_CHOOSE_WIDE(isa, polish_places)(rays, count); }

void wide_march(const WideView& view, const WideRays& rays, int count, MarchHit* hits, RayNote* notes, sdf::Isa isa) {
    const auto run = isa == sdf::Isa::Avx512 ? &wide_avx512_rays::march
                     : isa == sdf::Isa::Avx2 ? &wide_avx2::march
                     : isa == sdf::Isa::Sse4 ? &wide_sse4::march
                                             : &wide_scalar::march;
    run(view, rays, count, hits, notes);
}

}  // namespace kiln::field
