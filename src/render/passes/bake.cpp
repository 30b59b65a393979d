// SPDX-License-Identifier: MIT
#include "render/passes/passes.h"

#include "base/assert.h"
#include "shaders/bake_copy.spv.h"
#include "shaders/bake_half.spv.h"
#include "shaders/bake_snorm8.spv.h"

namespace kiln::render {

namespace {
constexpr rhi::SpecConstant kWithHalf[] = {{0, 0}};
constexpr rhi::SpecConstant kWithSnorm8[] = {{0, 1}};
}  // namespace

const Kernel kBakeHalf{"bake half", kBakeHalfSpv};
const Kernel kBakeSnorm8{"bake snorm8", kBakeSnorm8Spv};
const Kernel kBakeCopyHalf{"bake copy half", kBakeCopySpv, kWithHalf};
const Kernel kBakeCopySnorm8{"bake copy snorm8", kBakeCopySpv, kWithSnorm8};

namespace {

// Where the jobs' bricks go, as runs of bricks that lie side by side in the buffer and in the atlas. A brick's row of 8 texels is
// `row_bytes` in the buffer and `row_texels` in the texture.
std::vector<CopyRegion> copy_regions(std::span<const uint32_t> slots, uint32_t bricks_x, uint32_t bricks_y,
                                     uint32_t row_bytes, uint32_t row_texels = 8) {
    const uint32_t side_by_side = uint32_t(kBakeCopyBytes) / row_bytes;
    std::vector<CopyRegion> out;
    for (uint32_t job = 0; job < slots.size();) {
        uint32_t run = 1;
        while (job + run < slots.size() && (job + run) % side_by_side != 0 && slots[job + run] == slots[job] + run &&
               (slots[job] + run) % bricks_x != 0) {
            ++run;
        }
        const uint32_t slot = slots[job];
        out.push_back(
            {.buffer_offset = uint64_t{job / side_by_side} * kBakeCopyRows * kBakeCopyBytes +
                              uint64_t{job % side_by_side} * row_bytes,
             .bytes_per_row = uint32_t(kBakeCopyBytes),
             .rows_per_layer = 8,
             .origin = {slot % bricks_x * row_texels, slot / bricks_x % bricks_y * 8, slot / (bricks_x * bricks_y) * 8},
             .size = {run * row_texels, 8, 8}});
        job += run;
    }
    return out;
}

}  // namespace

const Kernel& bake_kernel(rhi::Format format, bool by_copy, const TapeUse& use) {
    const bool half = format == rhi::Format::R16Float;
    KILN_ASSERT(half || format == rhi::Format::R8Snorm);
    if (by_copy) return specialised(half ? kBakeCopyHalf : kBakeCopySnorm8, use);
    return specialised(half ? kBakeHalf : kBakeSnorm8, use);
}

void bake_bricks(Graph& g, FieldHandles& f, std::span<const uint32_t> slots, const BakePush& push, rhi::Format format,
                 bool by_copy, const TapeUse& use) {
    const Buffer jobs = g.upload("bake jobs", slots);
    const Groups groups{uint32_t(slots.size()), 1, 1};
    if (!by_copy) {
        g.dispatch(bake_kernel(format, by_copy, use), groups,
                   {g.read(jobs), g.read(f.records), g.read(f.code), g.read(f.numbers), g.write(f.tables),
                    g.read_write(f.dropped), g.write(f.materials), g.write(f.distances)},
                   push);
        return;
    }
    const uint32_t row_bytes = format == rhi::Format::R16Float ? 16 : 8;
    const uint32_t side_by_side = uint32_t(kBakeCopyBytes) / row_bytes;
    const uint64_t groups_of_bricks = (slots.size() + side_by_side - 1) / side_by_side;
    Buffer codes = g.create_buffer("bake codes", groups_of_bricks * kBakeCopyRows * kBakeCopyBytes);
    g.dispatch(bake_kernel(format, by_copy, use), groups,
               {g.read(jobs), g.read(f.records), g.read(f.code), g.read(f.numbers), g.write(f.tables),
                g.read_write(f.dropped), g.write(f.materials), g.write(codes)},
               push);
    g.copy(codes, f.distances,
           copy_regions(slots, push.atlas_bricks_x_y & 0xffffu, push.atlas_bricks_x_y >> 16, row_bytes));
}

size_t packed_at(size_t job, size_t row, size_t row_bytes) {
    const size_t side_by_side = size_t(kBakeCopyBytes) / row_bytes;
    return ((job / side_by_side) * size_t(kBakeCopyRows) + row) * size_t(kBakeCopyBytes) +
           job % side_by_side * row_bytes;
}

size_t packed_bytes(size_t jobs, size_t row_bytes) {
    const size_t side_by_side = size_t(kBakeCopyBytes) / row_bytes;
    return (jobs + side_by_side - 1) / side_by_side * size_t(kBakeCopyRows) * size_t(kBakeCopyBytes);
}

void store_bricks(Graph& g, FieldHandles& f, std::span<const uint32_t> slots, std::span<const std::byte> codes,
                  std::span<const std::byte> words, uint32_t atlas_bricks_x_y, rhi::Format format) {
    const uint32_t bricks_x = atlas_bricks_x_y & 0xffffu;
    const uint32_t bricks_y = atlas_bricks_x_y >> 16;
    g.copy(g.upload("host codes", codes), f.distances,
           copy_regions(slots, bricks_x, bricks_y, 8 * rhi::bytes_per_texel(format)));
    g.copy(g.upload("host words", words), f.materials, copy_regions(slots, bricks_x, bricks_y, 16, 4));
}

}  // namespace kiln::render
