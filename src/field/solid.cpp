// SPDX-License-Identifier: MIT
#include "field/solid.h"

#include <algorithm>
#include <bit>
#include <cstring>
#ifdef __SSE2__
#include <immintrin.h>
#endif

namespace kiln::field {

std::array<Slice, 8> solid_texels(const std::byte* codes, int texel_bytes) {
    std::array<Slice, 8> out{};
#ifdef __SSE2__
    const __m128i zero = _mm_setzero_si128();
    const auto at = [&](int block) { return _mm_loadu_si128(reinterpret_cast<const __m128i*>(codes) + block); };
    for (int z = 0; z < 8; ++z) {
        Slice empty = 0;
        for (int pair = 0; pair < 4; ++pair) {
            const int block = z * 4 + pair;
            const __m128i above = texel_bytes == 2 ? _mm_packs_epi16(_mm_cmpgt_epi16(at(2 * block), zero),
                                                                     _mm_cmpgt_epi16(at(2 * block + 1), zero))
                                                   : _mm_cmpgt_epi8(at(block), zero);
            empty |= Slice(uint32_t(_mm_movemask_epi8(above))) << 16 * pair;
        }
        out[size_t(z)] = ~empty;
    }
#else
    for (size_t z = 0; z < 8; ++z) {
        for (size_t i = 0; i < 64; ++i) {
            const size_t texel = z * 64 + i;
            bool empty = int8_t(codes[texel * size_t(texel_bytes)]) > 0;
            if (texel_bytes == 2) {
                int16_t code;
                std::memcpy(&code, codes + 2 * texel, 2);
                empty = code > 0;
            }
            out[z] |= Slice(!empty) << i;
        }
    }
#endif
    return out;
}

uint32_t solid_voxels(const std::array<Slice, 8>& texels, SolidRows& rows) {
    Slice all = 0;
    uint32_t slices = 0;  // bit z: some voxel is solid
    const auto voxels = [&](size_t z) {
        Slice any = texels[z] | texels[z + 1];
        any |= any >> 8;
        any |= any >> 1;
        any &= 0x007f7f7f7f7f7f7fu;
        slices |= uint32_t(any != 0) << z;
        all |= any;
        return any;
    };
    for (size_t z = 0; z < 7; ++z) {
        const Slice slice = voxels(z);
        std::memcpy(rows.data() + sizeof(Slice) * z, &slice, sizeof slice);
    }
    std::fill(rows.begin() + 7 * sizeof(Slice), rows.end(), uint8_t(0));
    if (all == 0) return kNoSolidBox;
    const int first_y = std::countr_zero(all) / 8, last_y = 7 - std::countl_zero(all) / 8;
    Slice columns = all | all >> 32;
    columns |= columns >> 16;
    columns = (columns | columns >> 8) & 0x7f;
    return solid_box({std::countr_zero(columns), first_y, std::countr_zero(slices)},
                     {63 - std::countl_zero(columns), last_y, 31 - std::countl_zero(slices)});
}

}  // namespace kiln::field
