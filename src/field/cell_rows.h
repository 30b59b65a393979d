// SPDX-License-Identifier: MIT
// Cell words in rows of eight, as their pages have them: what jumps and marks are made with, a row an operation.
#pragma once

#include "field/jumps.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>

namespace kiln::field {

/// A row of a page's cells.
using Eight __attribute__((vector_size(32))) = uint32_t;
inline constexpr Eight kLanes{0, 1, 2, 3, 4, 5, 6, 7};
static_assert(kCellPage == 8);

/// Where a row of cells lies in its page.
inline size_t row_of(int y, int z) {
    return size_t(((z & (kCellPage - 1)) * kCellPage + (y & (kCellPage - 1))) * kCellPage);
}

/// The pages that a box meets, and what each has of it.
template <typename Fn>
void each_page(const CellMap& cells, const CellBox& box, Fn&& fn) {
    const auto first = [](int a) { return a >> 3; };  // positions on a torus may be negative
    for (int z = first(box.min.z); z * kCellPage < box.max.z; ++z) {
        for (int y = first(box.min.y); y * kCellPage < box.max.y; ++y) {
            for (int x = first(box.min.x); x * kCellPage < box.max.x; ++x) {
                const ivec3 low{x * kCellPage, y * kCellPage, z * kCellPage};
                fn(cells.page_index(x, y, z),
                   CellBox{{std::max(low.x, box.min.x), std::max(low.y, box.min.y), std::max(low.z, box.min.z)},
                           {std::min(low.x + kCellPage, box.max.x), std::min(low.y + kCellPage, box.max.y),
                            std::min(low.z + kCellPage, box.max.z)}});
            }
        }
    }
}

/// Word k of entry b is bit k of b.
inline constexpr auto kSpread = [] {
    std::array<std::array<uint32_t, kCellPage>, 256> out{};
    for (uint32_t b = 0; b < 256; ++b) {
        for (uint32_t k = 0; k < uint32_t(kCellPage); ++k) out[b][k] = (b >> k) & 1u;
    }
    return out;
}();
inline void spread(uint8_t bits, Eight& out) { std::memcpy(&out, kSpread[bits].data(), sizeof out); }

/// Bit k is this bit of word k, of 8.
inline uint32_t bits_of(const uint32_t* words, int bit) {
    uint32_t out = 0;
#if defined(__SSE__)
    for (int half = 0; half < 2; ++half) {
        uint32_t four __attribute__((vector_size(16)));
        std::memcpy(&four, words + 4 * half, sizeof four);
        using Floats __attribute__((vector_size(16))) = float;
        out |= uint32_t(__builtin_ia32_movmskps(Floats(four << (31 - bit)))) << (4 * half);
    }
#else
    for (int k = 0; k < kCellPage; ++k) out |= (words[k] >> bit & 1u) << k;
#endif
    return out;
}

}  // namespace kiln::field
