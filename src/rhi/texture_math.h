// SPDX-License-Identifier: MIT
// Sizes of mips, layers and copy regions: the arithmetic that every backend needs.
#pragma once

#include "rhi/commands.h"

#include <algorithm>

namespace kiln::rhi {

inline uint32_t layer_count(const TextureDesc& d) { return d.dimension == Dimension::D2Array ? d.size.depth : 1; }

inline Extent mip_extent(const TextureDesc& d, uint32_t mip) {
    const auto down = [&](uint32_t n) { return mip < 32 ? std::max(1u, n >> mip) : 1u; };
    return {down(d.size.width), down(d.size.height), d.dimension == Dimension::D3 ? down(d.size.depth) : d.size.depth};
}

inline uint32_t full_mip_count(const TextureDesc& d) {
    uint32_t largest = std::max(d.size.width, d.size.height);
    if (d.dimension == Dimension::D3) largest = std::max(largest, d.size.depth);
    uint32_t n = 1;
    while (largest >>= 1) ++n;
    return n;
}

// The same range with its counts spelt out. Beyond the texture: counts of 0.
inline Subresources resolved(const TextureDesc& d, Subresources r) {
    const uint32_t layers = layer_count(d);
    if (r.mip_count == kRemaining) r.mip_count = r.base_mip < d.mips ? d.mips - r.base_mip : 0;
    if (r.layer_count == kRemaining) r.layer_count = r.base_layer < layers ? layers - r.base_layer : 0;
    return r;
}

// How a copy walks through buffer bytes.
struct RowLayout {
    uint64_t bytes_per_row;
    uint64_t bytes_per_layer;
    uint64_t total_bytes;  // from the first byte to one past the last that is touched
};

inline RowLayout row_layout(Format format, Extent size, uint32_t bytes_per_row, uint32_t rows_per_layer) {
    const uint64_t tight = uint64_t{size.width} * bytes_per_texel(format);
    RowLayout out{};
    out.bytes_per_row = bytes_per_row ? bytes_per_row : tight;
    out.bytes_per_layer = out.bytes_per_row * (rows_per_layer ? rows_per_layer : size.height);
    const bool empty = size.width == 0 || size.height == 0 || size.depth == 0;
    out.total_bytes =
        empty ? 0 : out.bytes_per_layer * (size.depth - 1) + out.bytes_per_row * (size.height - 1) + tight;
    return out;
}

}  // namespace kiln::rhi
