// SPDX-License-Identifier: MIT
// Chooses the instruction set at run time.

#include "field/wide.h"

#include "field/wide_isa.h"

namespace kiln::field {
namespace {

// Where points without a brick read: what they find is not looked at. As in a brick, something is before the codes.
struct NoTexels {
    alignas(64) std::byte before[64], codes[2 * kBrickTexelCount];
};
constexpr NoTexels kNoTexels{};

auto distance_by(sdf::Isa isa) {
    return isa == sdf::Isa::Avx512 ? &wide_avx512::distance
           : isa == sdf::Isa::Avx2 ? &wide_avx2::distance
           : isa == sdf::Isa::Sse4 ? &wide_sse4::distance
                                   : &wide_scalar::distance;
}

WideEntry address_of(const std::byte* codes) { return WideEntry(reinterpret_cast<uintptr_t>(codes)) & kWideAddress; }

}  // namespace

WideEntry wide_entry_of_brick(const std::byte* codes) { return kWideOccupied | address_of(codes); }
WideEntry wide_entry_of_empty(uint32_t word) {
    return ((word & kCellInside) != 0 ? kWideInside : 0) | WideEntry(word & 7u) << kWideJumpShift |
           address_of(kNoTexels.codes);
}

WideView::WideView(const GridParams& g, const WidePage* const* first_page, int along_x, int along_y,
                   const uint32_t* first_way, int bytes, std::array<const uint64_t*, 3> by_texel)
    : grid(g),
      pages(first_page),
      pages_x(along_x),
      pages_y(along_y),
      ways(first_way),
      texel_bytes(bytes),
      inverse_voxel(1.0f / g.voxel_size),
      places(by_texel),
      distance(distance_by(sdf::best_isa())) {
    const int cell[3] = {g.cell_x, g.cell_y, g.cell_z}, size[3] = {g.size_x, g.size_y, g.size_z};
    for (size_t axis = 0; axis < 3; ++axis) {
        low[axis] = float(cell[axis] * kBrickVoxels);
        high[axis] = float((cell[axis] + size[axis]) * kBrickVoxels);
    }
    high[3] = 1;
}

std::vector<uint64_t> wide_places(int axis, ivec3 size) {
    const auto pages = [](int cells) { return uint64_t(cells + kCellPage - 1) / kCellPage; };
    const uint64_t page_step = axis == 0 ? 1 : axis == 1 ? pages(size.x) : pages(size.x) * pages(size.y);
    const uint64_t step = axis == 0 ? 1 : axis == 1 ? 8 : 64;  // of a cell in its page and a texel in its brick
    const int cells = axis == 0 ? size.x : axis == 1 ? size.y : size.z;
    std::vector<uint64_t> out;
    out.reserve(size_t(cells) * kBrickVoxels);
    for (int cell = 0; cell < cells; ++cell) {
        const uint64_t page = uint64_t(cell / kCellPage) * page_step, word = uint64_t(cell % kCellPage) * step;
        const uint64_t entry = page * std::tuple_size_v<WidePage> + word;
        for (uint64_t texel = 0; texel < kBrickVoxels; ++texel) out.push_back(entry << 32 | texel * step);
    }
    return out;
}

float wide_distance(const WideView& view, const vec3& p, sdf::Isa isa) { return distance_by(isa)(view, p); }

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

void wide_march(const WideView& view, WideRay* rays, int count, MarchHit* hits, RayNote* notes, sdf::Isa isa) {
    KILN_CHOOSE_WIDE(isa, march)(view, rays, count, hits, notes);
}

}  // namespace kiln::field
