// SPDX-License-Identifier: MIT
#include "render/picture.h"

#include "base/assert.h"
#include "base/format.h"
#include "image/exr_file.h"
#include "image/png_file.h"

#include <bit>
#include <cstring>

namespace kiln {

namespace render {

float float_from_half(uint16_t half) {
    const uint32_t sign = uint32_t(half & 0x8000u) << 16;
    const uint32_t size = half & 0x7fffu;
    if (size >= 0x7c00u) return std::bit_cast<float>(sign | 0x7f800000u | (size & 0x3ffu) << 13);
    if (size < 0x0400u) return std::bit_cast<float>(sign | std::bit_cast<uint32_t>(float(size) * 0x1p-24f));
    return std::bit_cast<float>(sign | ((size << 13) + 0x38000000u));
}

void place_shown(Picture& picture, int x, int y, int width, int height, std::span<const std::byte> shown) {
    const size_t row = size_t(width) * 4;
    KILN_ASSERT(shown.size() == row * size_t(height));
    for (size_t j = 0; j < size_t(height); ++j)
        std::memcpy(picture.srgb.data() + ((size_t(y) + j) * size_t(picture.width) + size_t(x)) * 4,
                    shown.data() + j * row, row);
}

void place_tile(Picture& picture, int x, int y, int width, int height, std::span<const std::byte> radiance,
                std::span<const std::byte> shown, std::span<const float> depth) {
    const size_t row = size_t(width);
    const bool halves = picture.view == View::Shaded;
    KILN_ASSERT(depth.size() == row * size_t(height) && (shown.empty() || shown.size() == depth.size() * 4));
    KILN_ASSERT(radiance.size() == depth.size() * (halves ? 8 : 16));
    for (size_t j = 0; j < size_t(height); ++j) {
        const size_t to = (size_t(y) + j) * size_t(picture.width) + size_t(x);
        const size_t from = j * row;
        std::memcpy(picture.depth.data() + to, depth.data() + from, row * 4);
        if (!shown.empty()) std::memcpy(picture.srgb.data() + to * 4, shown.data() + from * 4, row * 4);
        if (!halves) {
            std::memcpy(picture.rgba.data() + to * 4, radiance.data() + from * 16, row * 16);
            continue;
        }
        for (size_t i = 0; i < row * 4; ++i) {
            uint16_t half = 0;
            std::memcpy(&half, radiance.data() + (from * 4 + i) * 2, 2);
            picture.rgba[to * 4 + i] = float_from_half(half);
        }
    }
}

}  // namespace render

Result<void> Picture::save(const std::string& path) const {
    if (path.ends_with(".png")) return image::write_png(path, width, height, srgb);
    if (!path.ends_with(".exr")) {
        return Error{formatted("{}: a picture's name ends in .png or .exr", path), ErrorKind::Usage};
    }
    if (view == View::Depth) return image::write_exr_depth(path, width, height, depth);
    return image::write_exr(path, width, height, 4, rgba);
}

}  // namespace kiln
