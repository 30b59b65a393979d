// SPDX-License-Identifier: MIT
// Cell words in rows of eight, as their pages have them: what jumps and marks are made with, a row an operation.
#pragma once

#include "field/jumps.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <type_traits>

namespace kiln::field {

/// A row of a page's cells.
using Eight __attribute__((vector_size(32))) = uint32_t;
inline constexpr Eight kLanes{0, 1, 2, 3, 4, 5, 6, 7};
static_assert(kCellPage == 8);

inline bool is_brick(uint32_t word) { return (word & kCellOccupied) != 0 && word != kCellMissing; }
/// The order of cells in a box.
inline bool before(ivec3 a, ivec3 b) { return a.z != b.z ? a.z < b.z : a.y != b.y ? a.y < b.y : a.x < b.x; }

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

/// The first position of the row of a page that x is in.
inline int first_of_row(int x) { return x & ~(kCellPage - 1); }

/// fn(words, changes, part, y, z) of the rows of a box: which bits of them to turn. `part` is what their page has of it. Pages that stay as they are
/// are not copied.
template <typename Fn>
void rewrite(CellMap& cells, const CellBox& box, Fn&& fn) {
    each_page(cells, box, [&](size_t page, const CellBox& part) {
        const CellMap::Words::Page* old = cells.words().find(page);
        for (int z = part.min.z; z < part.max.z; ++z) {
            for (int y = part.min.y; y < part.max.y; ++y) {
                Eight had = Eight{} + uint32_t(kMaxJump);
                if (old != nullptr) std::memcpy(&had, old->data() + row_of(y, z), sizeof had);
                Eight changes{};
                fn(had, changes, part, y, z);
                uint64_t halves[4];
                std::memcpy(halves, &changes, sizeof changes);
                if ((halves[0] | halves[1] | halves[2] | halves[3]) == 0) continue;
                CellMap::Words::Page& mine = cells.words().write_page(page);
                had ^= changes;
                std::memcpy(mine.data() + row_of(y, z), &had, sizeof had);
                old = &mine;
            }
        }
    });
}

/// fn(word, cell) for the words of a box, a page at a time.
template <typename Cells, typename Fn>
void each_word(Cells& cells, const CellBox& box, Fn&& fn) {
    each_page(cells, box, [&](size_t page, const CellBox& part) {
        auto& words = [&]() -> auto& {
            if constexpr (std::is_const_v<Cells>)
                return *cells.words().find(page);
            else
                return cells.words().write_page(page);
        }
        ();
        for (int z = part.min.z; z < part.max.z; ++z) {
            for (int y = part.min.y; y < part.max.y; ++y) {
                auto* const row = words.data() + row_of(y, z);
                for (int x = part.min.x; x < part.max.x; ++x) fn(row[x & (kCellPage - 1)], ivec3{x, y, z});
            }
        }
    });
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

/// Of 8 words, bit k of each is word k's: whether it is occupied; its jump's three bits, none where it is occupied.
struct RowBits {
    uint32_t occupied, jump[3];
};
inline RowBits row_bits(const uint32_t* words) {
#if defined(__SSE2__)
    using Four __attribute__((vector_size(16))) = int32_t;
    using Bytes __attribute__((vector_size(16))) = char;
    // A byte a word: its jump, and bit 3 where it is occupied.
    const auto half = [](const uint32_t* from) {
        Four four;
        std::memcpy(&four, from, sizeof four);
        return (four & 7) | (four >> 31 & 8);
    };
    using Eights __attribute__((vector_size(16))) = int16_t;
    const Eights eight = __builtin_ia32_packssdw128(half(words), half(words + 4));
    const Eights bytes = Eights(__builtin_ia32_packsswb128(eight, Eights{}));
    const auto bit = [&](int i) { return uint32_t(__builtin_ia32_pmovmskb128(Bytes(bytes << (7 - i)))); };
    const uint32_t occupied = bit(3);
    return {occupied, {bit(0) & ~occupied, bit(1) & ~occupied, bit(2) & ~occupied}};
#else
    const uint32_t occupied = bits_of(words, 31);
    return {occupied, {bits_of(words, 0) & ~occupied, bits_of(words, 1) & ~occupied, bits_of(words, 2) & ~occupied}};
#endif
}

}  // namespace kiln::field
