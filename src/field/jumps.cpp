// SPDX-License-Identifier: MIT
// Occupancy as one bit a cell: cells within k of a brick are the occupied ones dilated k times by one cell, an axis at a time, 64 cells an
// operation. What the k-th dilation adds has jump k.

#include "field/jumps.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <vector>

namespace kiln::field {
namespace {

// Bits of a box of cells; rows along x begin at multiples of kCellPage, so that a page's row of cells is one byte.
struct BitBox {
    ivec3 size;
    size_t row_words;
    std::vector<uint64_t> words;

    explicit BitBox(ivec3 s)
        : size(s), row_words((size_t(s.x) + 63) / 64), words(row_words * size_t(s.y) * size_t(s.z)) {}
    uint64_t* row(int y, int z) { return words.data() + (size_t(z) * size_t(size.y) + size_t(y)) * row_words; }
    uint8_t byte(int x8, int y, int z) { return uint8_t(row(y, z)[size_t(x8) / 8] >> (x8 % 8 * 8)); }
};

// from dilated by one cell into `to`; `between` is scratch of the same shape.
void dilate(const BitBox& from, BitBox& between, BitBox& to) {
    const size_t w = from.row_words, plane = w * size_t(from.size.y), n = from.words.size();
    for (size_t i = 0; i < n; ++i) {
        const uint64_t here = from.words[i];
        uint64_t near = here | here << 1 | here >> 1;
        if (i % w > 0) near |= from.words[i - 1] >> 63;
        if (i % w + 1 < w) near |= from.words[i + 1] << 63;
        to.words[i] = near;
    }
    for (int z = 0; z < from.size.z; ++z) {
        for (size_t i = 0; i < plane; ++i) {
            const size_t at = size_t(z) * plane + i;
            uint64_t near = to.words[at];
            if (i >= w) near |= to.words[at - w];
            if (i + w < plane) near |= to.words[at + w];
            between.words[at] = near;
        }
    }
    for (size_t i = 0; i < n; ++i) {
        uint64_t near = between.words[i];
        if (i >= plane) near |= between.words[i - plane];
        if (i + plane < n) near |= between.words[i + plane];
        to.words[i] = near;
    }
}

// Word k of entry b is bit k of b.
constexpr auto kSpread = [] {
    std::array<std::array<uint32_t, kCellPage>, 256> out{};
    for (uint32_t b = 0; b < 256; ++b) {
        for (uint32_t k = 0; k < uint32_t(kCellPage); ++k) out[b][k] = (b >> k) & 1u;
    }
    return out;
}();

// Where a row of cells lies in its page.
size_t row_of(int y, int z) { return size_t(((z & (kCellPage - 1)) * kCellPage + (y & (kCellPage - 1))) * kCellPage); }

// The pages that a box meets, and what each has of it.
template <typename Fn>
void each_page(const CellMap& cells, const CellBox& box, Fn&& fn) {
    const auto first = [](int a) { return a >> 3; };  // kCellPage = 8; positions on a torus may be negative
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

// Bit k is the highest bit of word k, of 8.
uint32_t top_bits(const uint32_t* words) {
    uint32_t out = 0;
#if defined(__SSE__)
    for (int half = 0; half < 2; ++half) {
        float four __attribute__((vector_size(16)));
        std::memcpy(&four, words + 4 * half, sizeof four);
        out |= uint32_t(__builtin_ia32_movmskps(four)) << (4 * half);
    }
#else
    for (int k = 0; k < kCellPage; ++k) out |= (words[k] >> 31) << k;
#endif
    return out;
}

}  // namespace

CellBox grown(const CellBox& box, int by, ivec3 grid_size) {
    return {{std::max(box.min.x - by, 0), std::max(box.min.y - by, 0), std::max(box.min.z - by, 0)},
            {std::min(box.max.x + by, grid_size.x), std::min(box.max.y + by, grid_size.y),
             std::min(box.max.z + by, grid_size.z)}};
}

CellBox joined(const CellBox& a, const CellBox& b) {
    if (a.empty()) return b;
    if (b.empty()) return a;
    return {{std::min(a.min.x, b.min.x), std::min(a.min.y, b.min.y), std::min(a.min.z, b.min.z)},
            {std::max(a.max.x, b.max.x), std::max(a.max.y, b.max.y), std::max(a.max.z, b.max.z)}};
}

void update_jumps(CellMap& cells, const CellBox& box) {
    if (box.empty()) return;
    CellBox wide = cells.wraps() ? CellBox{box.min - ivec3{kMaxJump, kMaxJump, kMaxJump},
                                           box.max + ivec3{kMaxJump, kMaxJump, kMaxJump}}
                                 : grown(box, kMaxJump, cells.size());
    wide.min.x &= ~(kCellPage - 1);
    const ivec3 size = wide.max - wide.min;
    BitBox occupied(size), near(size), next(size), between(size);
    each_page(cells, wide, [&](size_t page, const CellBox& part) {
        const CellMap::Words::Page* const words = cells.words().find(page);
        if (words == nullptr) return;
        const int x8 = (part.min.x - wide.min.x) / kCellPage;
        for (int z = part.min.z; z < part.max.z; ++z) {
            for (int y = part.min.y; y < part.max.y; ++y) {
                occupied.row(y - wide.min.y, z - wide.min.z)[size_t(x8) / 8] |=
                    uint64_t(top_bits(words->data() + row_of(y, z))) << (x8 % 8 * 8);
            }
        }
    });
    // The jump's three bits, 7 until a dilation arrives.
    std::array<BitBox, 3> jump{near, near, near};
    for (BitBox& plane : jump) std::fill(plane.words.begin(), plane.words.end(), ~uint64_t(0));
    near = occupied;
    for (uint32_t k = 1; k < uint32_t(kMaxJump); ++k) {
        dilate(near, between, next);
        uint64_t any = 0;
        for (size_t i = 0; i < next.words.size(); ++i) {
            const uint64_t arrived = next.words[i] & ~near.words[i];
            any |= arrived;
            for (uint32_t bit = 0; bit < 3; ++bit) {
                if ((k >> bit & 1u) == 0) jump[bit].words[i] &= ~arrived;
            }
        }
        if (any == 0) break;
        std::swap(near, next);
    }
    each_page(cells, box, [&](size_t page, const CellBox& part) {
        const CellMap::Words::Page* old = cells.words().find(page);
        const int cx = part.min.x & ~(kCellPage - 1), x8 = (cx - wide.min.x) / kCellPage;
        for (int z = part.min.z; z < part.max.z; ++z) {
            for (int y = part.min.y; y < part.max.y; ++y) {
                std::array<uint32_t, kCellPage> had, wanted;
                if (old != nullptr) {
                    std::copy_n(old->data() + row_of(y, z), had.size(), had.begin());
                } else {
                    had.fill(uint32_t(kMaxJump));
                }
                const int ly = y - wide.min.y, lz = z - wide.min.z;
                const auto& low = kSpread[jump[0].byte(x8, ly, lz)];
                const auto& middle = kSpread[jump[1].byte(x8, ly, lz)];
                const auto& high = kSpread[jump[2].byte(x8, ly, lz)];
                for (size_t k = 0; k < had.size(); ++k) {
                    const uint32_t empty = (had[k] & kCellInside) | low[k] | middle[k] << 1 | high[k] << 2;
                    wanted[k] = (had[k] & kCellOccupied) != 0 ? had[k] : empty;
                }
                for (int x = cx; x < part.min.x; ++x) wanted[size_t(x - cx)] = had[size_t(x - cx)];
                for (int x = part.max.x; x < cx + kCellPage; ++x) wanted[size_t(x - cx)] = had[size_t(x - cx)];
                if (wanted == had) continue;
                CellMap::Words::Page& mine = cells.words().write_page(page);
                std::copy(wanted.begin(), wanted.end(), mine.begin() + ptrdiff_t(row_of(y, z)));
                old = &mine;
            }
        }
    });
}

}  // namespace kiln::field
