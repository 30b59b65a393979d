// SPDX-License-Identifier: MIT
// What the GPU has in its atlas against the CPU's bake of the same field, texel by texel.
#pragma once

#include "field/codes.gpu.h"
#include "field/host_bricks.h"
#include "render/gpu_field.h"
#include "rhi/rhi_test.h"

#include <algorithm>
#include <cmath>
#include <string>

namespace kiln::render {

struct BakeTally {
    uint64_t texels = 0, inexact = 0, signs = 0, far = 0, words = 0, masks = 0;
    double worst = 0;
};

// What a material word says, by the brick's palette: slots differ where only one side found a trace of some material in the brick.
struct StoredMix {
    uint32_t id0, id1, weight;  // weight: the second's share, in 510ths
};

template <typename Palette>
StoredMix mix_of(uint32_t word, const Palette& palette) {
    return {palette(word & 15u), palette((word >> 4) & 15u), word >> 8};
}

inline bool same_mix(const StoredMix& a, const StoredMix& b) {
    if (std::max(a.weight, b.weight) <= 1) return a.id0 == b.id0;
    const bool close = std::abs(int(a.weight) - int(b.weight)) <= 1;
    const bool swapped = a.id0 == b.id1 && a.id1 == b.id0 && std::min(a.weight, b.weight) >= 253;
    return close && (swapped || (a.id0 == b.id0 && a.id1 == b.id1));
}

inline BakeTally compare_bake(GpuField& gpu, const field::Field& f) {
    BakeTally tally;
    const bool half = f.options().format == field::DistanceFormat::Half;
    const std::vector<uint32_t> slots = f.slots();
    const auto read = rhi::must(gpu.read_back(slots));
    const float h = f.grid().voxel_size;
    for (size_t i = 0; i < read.size(); ++i) {
        const field::BrickRecord& r = f.records()[slots[i]];
        field::BrickEvaluator evaluator(f.program(), h);
        evaluator.evaluate(f.code_of(slots[i]), {r.texel_x, r.texel_y, r.texel_z});
        const field::BrickContent expected = evaluator.content(f.options().format);
        const auto palette = [&](uint32_t slot) { return read[i].palette[slot]; };
        const auto known = [&](uint32_t slot) { return uint32_t(expected.palette(slot)); };
        for (size_t t = 0; t < 512; ++t) {
            const float d = evaluator.distances()[t] / h;
            const float want = half ? field::stored_half(d) : field::stored_snorm8(d);
            const float got =
                half ? field::half_value(read[i].distance_codes[t]) : field::snorm8_value(read[i].distance_codes[t]);
            const float quantum =
                half ? std::ldexp(1.0f, std::max(std::ilogb(std::max(std::fabs(want), 1e-4f)) - 10, -14))
                     : 4.0f / 127.0f;
            const float off = std::fabs(got - want);
            ++tally.texels;
            tally.inexact += off != 0;
            tally.signs += (got <= 0) != (want <= 0);
            tally.far += off > std::max(quantum, 0x1p-10f) * 1.001f;
            tally.worst = std::max(tally.worst, double(off));
            // Near the band's end either side may call a texel far; weights may round the other way.
            if (std::fabs(d) > 3.99f) continue;
            tally.words += !same_mix(mix_of(read[i].material_words[t], palette), mix_of(expected.word(t), known));
        }
        // The mask of voxels with a solid texel, by the texels read back.
        for (int voxel = 0; voxel < 343; ++voxel) {
            const int x = voxel % 7, y = voxel / 7 % 7, z = voxel / 49;
            bool solid = false;
            for (int corner = 0; corner < 8; ++corner) {
                const size_t t = size_t((z + (corner >> 2)) * 64 + (y + (corner >> 1 & 1)) * 8 + x + (corner & 1));
                const uint32_t code = read[i].distance_codes[t];
                solid = solid || (half ? field::half_value(code) : field::snorm8_value(code)) <= 0;
            }
            const size_t word = size_t(field::solid_mask_word(y, z) - field::kPaletteSize);
            tally.masks += (read[i].solid_mask[word] >> field::solid_mask_bit(x, y) & 1u) != uint32_t(solid);
        }
    }
    return tally;
}

inline void expect_same_texels(GpuField& gpu, const field::Field& f, const std::string& name) {
    const BakeTally tally = compare_bake(gpu, f);
    EXPECT_GT(tally.texels, 2000u) << name;
    EXPECT_EQ(tally.far, 0u) << name << ": of " << tally.texels << ", worst " << tally.worst << " voxels";
    EXPECT_EQ(tally.words, 0u) << name << ": of " << tally.texels;
    EXPECT_EQ(tally.masks, 0u) << name << ": voxels whose mask is not what their texels say";
    EXPECT_LE(double(tally.signs), 1e-4 * double(tally.texels)) << name;
}

}  // namespace kiln::render
