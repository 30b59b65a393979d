// SPDX-License-Identifier: MIT
// max(|dx|, |dy|, |dz|) is separable: the least over x first, then over y of max(|dy|, that), then over z likewise.

#include "field/jumps.h"

#include "base/parallel_for.h"

#include <algorithm>
#include <cstdlib>
#include <vector>

namespace kiln::field {
namespace {

// out[i] = least over j in [0, count) with |i − j| < kMaxJump of max(|i − j|, in[j * stride]), at most kMaxJump.
void least_along(const uint8_t* in, uint8_t* out, int count, size_t stride) {
    for (int i = 0; i < count; ++i) {
        int best = kMaxJump;
        for (int step = 0; step < best; ++step) {
            const int before = i - step >= 0 ? in[size_t(i - step) * stride] : kMaxJump;
            const int after = i + step < count ? in[size_t(i + step) * stride] : kMaxJump;
            best = std::min(best, std::max(step, std::min(before, after)));
        }
        out[size_t(i) * stride] = uint8_t(best);
    }
}

}  // namespace

CellBox grown(const CellBox& box, int by, ivec3 grid_size) {
    return {{std::max(box.min.x - by, 0), std::max(box.min.y - by, 0), std::max(box.min.z - by, 0)},
            {std::min(box.max.x + by, grid_size.x), std::min(box.max.y + by, grid_size.y),
             std::min(box.max.z + by, grid_size.z)}};
}

void update_jumps(std::span<uint32_t> cells, ivec3 grid_size, const CellBox& box, int workers) {
    if (box.empty()) return;
    const CellBox wide = grown(box, kMaxJump, grid_size);
    const ivec3 size = wide.max - wide.min;
    const size_t row = size_t(size.x), slab = row * size_t(size.y);
    const auto cell_index = [&](int x, int y, int z) {
        return (size_t(wide.min.z + z) * size_t(grid_size.y) + size_t(wide.min.y + y)) * size_t(grid_size.x) +
               size_t(wide.min.x + x);
    };
    std::vector<uint8_t> a(slab * size_t(size.z)), b(a.size());
    parallel_for(size.z, workers, [&](int z) {
        uint8_t* from = a.data() + size_t(z) * slab;
        uint8_t* to = b.data() + size_t(z) * slab;
        for (int y = 0; y < size.y; ++y) {
            for (int x = 0; x < size.x; ++x) {
                from[size_t(y) * row + size_t(x)] =
                    (cells[cell_index(x, y, z)] & kCellOccupied) != 0 ? 0 : uint8_t(kMaxJump);
            }
            least_along(from + size_t(y) * row, to + size_t(y) * row, size.x, 1);
        }
        for (int x = 0; x < size.x; ++x) least_along(to + x, from + x, size.y, row);
    });
    parallel_for(size.y, workers, [&](int y) {
        for (int x = 0; x < size.x; ++x) {
            const size_t at = size_t(y) * row + size_t(x);
            least_along(a.data() + at, b.data() + at, size.z, slab);
        }
    });
    for (int z = box.min.z; z < box.max.z; ++z) {
        for (int y = box.min.y; y < box.max.y; ++y) {
            for (int x = box.min.x; x < box.max.x; ++x) {
                const ivec3 local = ivec3{x, y, z} - wide.min;
                uint32_t& word = cells[cell_index(local.x, local.y, local.z)];
                if ((word & kCellOccupied) != 0) continue;
                word = (word & kCellInside) | b[size_t(local.z) * slab + size_t(local.y) * row + size_t(local.x)];
            }
        }
    }
}

}  // namespace kiln::field
