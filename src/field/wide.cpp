// SPDX-License-Identifier: MIT
// Chooses the instruction set at run time.

#include "field/wide.h"

#include "field/wide_isa.h"

#include <array>
#include <immintrin.h>

namespace kiln::field {
namespace {

typedef float F4 __attribute__((vector_size(16)));
typedef int32_t I4 __attribute__((vector_size(16)));

F4 to_float(I4 v) { return __builtin_convertvector(v, F4); }

// Where points without a brick read: what they find is not looked at.
alignas(64) constexpr std::byte kNoTexels[2 * kBrickTexelCount] = {};

}  // namespace

float wide_distance(const WideView& view, vec3 p) {
    // x, y, z and one unused lane; whole numbers in floats, right for grids of fewer than 2^22 texels an axis.
    const GridParams& g = view.grid;
    const I4 first{g.cell_x * kBrickVoxels, g.cell_y * kBrickVoxels, g.cell_z * kBrickVoxels, 0};
    const I4 size{g.size_x * kBrickVoxels, g.size_y * kBrickVoxels, g.size_z * kBrickVoxels, 1};
    const F4 q = F4{p.x, p.y, p.z, 0} * (1.0f / g.voxel_size);
    const F4 low = to_float(first), high = to_float(first + size);
    if (_mm_movemask_ps((__m128)((q >= low) & (q < high))) != 15) return 0;
    const F4 toward_zero = to_float(__builtin_convertvector(q, I4));
    const F4 down = toward_zero > q ? toward_zero - 1.0f : toward_zero;
    const F4 part = q - down, texel = down - low;
    const I4 cell = __builtin_convertvector((texel + 0.5f) * (1.0f / 7.0f), I4);
    const F4 voxel = texel - to_float(cell) * 7.0f;
    const I4 at = __builtin_convertvector(voxel, I4);
    const uint32_t word = view.cells[(cell[2] * g.size_y + cell[1]) * g.size_x + cell[0]];

    const bool occupied = (word & kCellOccupied) != 0;
    const size_t row = size_t((at[2] * 8 + at[1]) * 8 + at[0]);
    F4 a, b;  // values at x and x + 1; lanes by y, then z
    if (view.texel_bytes == 2) {
        const std::byte* const brick = occupied ? view.bricks[word & kCellSlotMask] : kNoTexels;
        const auto pair = [brick, row](size_t offset) {
            int32_t w;
            std::memcpy(&w, brick + 2 * (row + offset), 4);
            return w;
        };
        const I4 w{pair(0), pair(8), pair(64), pair(72)};
        constexpr int32_t kKept = int32_t(0x8fffe000);  // as in wide.inl
        a = (F4)(((w << 16) >> 3) & kKept) * 0x1p112f;
        b = (F4)((w >> 3) & kKept) * 0x1p112f;
    } else {
        const std::byte* const brick = occupied ? view.bricks[word & kCellSlotMask] : kNoTexels;
        const auto value = [brick, row](size_t offset) { return snorm8_value(uint32_t(brick[row + offset])); };
        a = F4{value(0), value(8), value(64), value(72)};
        b = F4{value(1), value(9), value(65), value(73)};
    }
    const F4 x = a * (1.0f - part[0]) + b * part[0];
    const F4 near = __builtin_shuffle(x, I4{0, 2, 0, 2}), far = __builtin_shuffle(x, I4{1, 3, 1, 3});
    const F4 y = near * (1.0f - part[1]) + far * part[1];
    const float stored = y[0] * (1.0f - part[2]) + y[1] * part[2];

    // Every cell nearer than the jump is empty too.
    const int jump = int(word & 7u);
    const F4 in_cell = voxel + part;
    const F4 other = 7.0f - in_cell;
    const F4 to_face = in_cell < other ? in_cell : other;
    const float nearest = std::min(std::min(to_face[0], to_face[1]), to_face[2]);
    const float size_free = jump == 0 ? 0.0f : float(jump - 1) * 7.0f + nearest;
    const float empty = (word & kCellInside) != 0 ? -size_free : size_free;
    return (occupied ? stored : empty) * g.voxel_size;
}

void solid_mask(const std::byte* texels, int texel_bytes, std::byte* out) {
    std::array<uint64_t, 9> plane{};  // by z: byte y, bit x; solid texels
    for (size_t z = 0; z < 8; ++z) {
        for (size_t i = 0; i < 64; ++i) {
            int value;  // a code's sign is its distance's
            if (texel_bytes == 2) {
                int16_t code;
                std::memcpy(&code, texels + (z * 64 + i) * 2, 2);
                value = code;
            } else {
                value = int8_t(texels[z * 64 + i]);
            }
            plane[z] |= uint64_t(value <= 0) << i;
        }
    }
    for (size_t z = 0; z < 8; ++z) {
        uint64_t any = plane[z] | plane[z + 1];
        any |= any >> 8;
        any |= any >> 1;  // bit 7 takes the next row's: no voxel is there
        std::memcpy(out + z * 8, &any, 8);
    }
}

void wide_distances(const WideView& view, const sdf::Points& points, float* out, sdf::Isa isa) {
    const auto run = isa == sdf::Isa::Avx512 ? &wide_avx512::distances
                     : isa == sdf::Isa::Avx2 ? &wide_avx2::distances
                     : isa == sdf::Isa::Sse4 ? &wide_sse4::distances
                                             : &wide_scalar::distances;
    run(view, points, out);
}

void wide_march(const WideView& view, const WideRays& rays, int count, MarchHit* hits, sdf::Isa isa) {
    const auto run = isa == sdf::Isa::Avx512 ? &wide_avx512::march
                     : isa == sdf::Isa::Avx2 ? &wide_avx2::march
                     : isa == sdf::Isa::Sse4 ? &wide_sse4::march
                                             : &wide_scalar::march;
    run(view, rays, count, hits);
}

}  // namespace kiln::field
