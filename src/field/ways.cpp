// SPDX-License-Identifier: MIT
// A cell reaches k cells on where no cell of the cube of k + 1 is blocked: blocked cells dilated k times by one cell towards it, an axis at a
// time, 57 cells an operation. With B(k) the k-th dilation, the reach is the number of k in 1 … 7 whose B(k) does not have the cell.

#include "field/ways.h"

#include <algorithm>
#include <array>
#include <cstring>

namespace kiln::field {
namespace {

constexpr int kWindow = 64 - kWayReach;  // cells of a word whose reach its bits decide

using Four __attribute__((vector_size(16))) = uint32_t;
constexpr Four kBit{1, 2, 4, 8};
Four all_ones_where(uint32_t bits) { return Four(((Four{} + bits) & kBit) != 0); }

}  // namespace

Ways::Ways(ivec3 size)
    : size_(size),
      row_words_((size_t(size.x) + 63) / 64 + 3),
      blocked_(row_words_ * size_t(size.y) * size_t(size.z)),
      words_(size_t(size.x) * size_t(size.y) * size_t(size.z), kWayFree) {}

void Ways::block(ivec3 cell, uint32_t word) {
    words_[index(cell)] = word;
    uint64_t& bits = blocked_word(cell);
    const uint64_t bit = uint64_t(1) << (cell.x & 63);
    if ((bits & bit) != 0) return;
    bits |= bit;
    changed_ = joined(changed_, {cell, cell + ivec3{1, 1, 1}});
}

void Ways::set_free(ivec3 cell) {
    uint64_t& bits = blocked_word(cell);
    const uint64_t bit = uint64_t(1) << (cell.x & 63);
    if ((bits & bit) == 0) return;
    bits &= ~bit;
    changed_ = joined(changed_, {cell, cell + ivec3{1, 1, 1}});
}

// Bit i: cell (x + i, y, z); x is between -64 and the grid's size.
uint64_t Ways::blocked_from(int x, int y, int z) const {
    if (y < 0 || z < 0 || y >= size_.y || z >= size_.z) return 0;
    const uint64_t* const row = blocked_.data() + (size_t(z) * size_t(size_.y) + size_t(y)) * row_words_;
    const size_t at = size_t(x + 64);
    const uint64_t low = row[at / 64] >> (at % 64);
    return at % 64 == 0 ? low : low | row[at / 64 + 1] << (64 - at % 64);
}

void Ways::settle() {
    if (changed_.empty()) return;
    for (int octant = 0; octant < 8; ++octant) {
        const auto axis = [&](int bit, int& low, int& high, int size) {
            if ((octant & bit) != 0) {
                low = std::max(low - kWayReach, 0);
            } else {
                high = std::min(high + kWayReach, size);
            }
        };
        CellBox box = changed_;
        axis(1, box.min.x, box.max.x, size_.x);
        axis(2, box.min.y, box.max.y, size_.y);
        axis(4, box.min.z, box.max.z, size_.z);
        for (int x = box.min.x; x < box.max.x; x += kWindow)
            settle_octant(octant,
                          {{x, box.min.y, box.min.z}, {std::min(x + kWindow, box.max.x), box.max.y, box.max.z}});
    }
    changed_ = {};
}

// At most kWindow cells along x.
void Ways::settle_octant(int octant, const CellBox& box) {
    const bool up_x = (octant & 1) != 0, up_y = (octant & 2) != 0, up_z = (octant & 4) != 0;
    const int shift = up_x ? 0 : kWayReach;  // bit of the first cell
    const int first_y = box.min.y - (up_y ? 0 : kWayReach), first_z = box.min.z - (up_z ? 0 : kWayReach);
    const int rows = box.max.y - box.min.y + kWayReach, planes = box.max.z - box.min.z + kWayReach;
    std::vector<uint64_t> bits(size_t(rows) * size_t(planes));
    const auto row = [&](int y, int z) -> uint64_t& { return bits[size_t(z) * size_t(rows) + size_t(y)]; };
    for (int z = 0; z < planes; ++z) {
        for (int y = 0; y < rows; ++y) row(y, z) = blocked_from(box.min.x - shift, first_y + y, first_z + z);
    }
    const int own_rows = box.max.y - box.min.y, own_planes = box.max.z - box.min.z;
    const int own_y = box.min.y - first_y, own_z = box.min.z - first_z;
    struct Reach {
        uint64_t blocked, low = ~uint64_t(0), middle = low, high = low;
    };
    std::vector<Reach> reach(size_t(own_rows) * size_t(own_planes));
    const auto each_own = [&](auto&& fn) {
        for (int z = 0; z < own_planes; ++z) {
            for (int y = 0; y < own_rows; ++y)
                fn(reach[size_t(z) * size_t(own_rows) + size_t(y)], row(own_y + y, own_z + z));
        }
    };
    each_own([](Reach& r, uint64_t b) { r.blocked = b; });
    for (int k = 1; k <= kWayReach; ++k) {
        // Each takes from rows that still are as they were. Beyond the last there is garbage to come, which k more steps do not bring here.
        for (int z = 0; z < planes; ++z) {
            for (int i = 0; i < rows; ++i) {
                const int y = up_y ? i : rows - 1 - i, from = up_y ? y + 1 : y - 1;
                uint64_t b = row(y, z);
                if (from >= 0 && from < rows) b |= row(from, z);
                row(y, z) = b | (up_x ? b >> 1 : b << 1);
            }
        }
        for (int i = 0; i + 1 < planes; ++i) {
            const int z = up_z ? i : planes - 1 - i, from = up_z ? z + 1 : z - 1;
            for (int y = 0; y < rows; ++y) row(y, z) |= row(y, from);
        }
        // The lowest bit of a number up to 7 turns with every step, the next with every other.
        each_own([k](Reach& r, uint64_t b) {
            r.low ^= b;
            if (k % 2 == 0) r.middle ^= b;
            if (k == 4) r.high ^= b;
        });
    }
    const int count = box.max.x - box.min.x;
    const Four free_bits = Four{} + (7u << way_shift(octant));
    for (int z = 0; z < own_planes; ++z) {
        for (int y = 0; y < own_rows; ++y) {
            const Reach& r = reach[size_t(z) * size_t(own_rows) + size_t(y)];
            uint32_t* const to = words_.data() + index({box.min.x, box.min.y + y, box.min.z + z});
            for (int x = 0; x < count; x += 4) {
                const auto four = [&](uint64_t word) { return uint32_t(word >> (x + shift)) & 15u; };
                const Four found = ((all_ones_where(four(r.low)) & 1u) | (all_ones_where(four(r.middle)) & 2u) |
                                    (all_ones_where(four(r.high)) & 4u))
                                   << way_shift(octant);
                const size_t bytes = sizeof(uint32_t) * size_t(std::min(4, count - x));
                Four had{};
                std::memcpy(&had, to + x, bytes);
                // What was blocked until now keeps no bits of that.
                const Four kept = had & (Four{} + kWayFree) & Four((had & (kWaySolid | kWayInside)) == 0) & ~free_bits;
                const Four blocked = all_ones_where(four(r.blocked));
                const Four now = (had & blocked) | ((kept | found) & ~blocked);
                std::memcpy(to + x, &now, bytes);
            }
        }
    }
}

}  // namespace kiln::field
