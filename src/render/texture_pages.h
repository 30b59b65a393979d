// SPDX-License-Identifier: MIT
// Textures in pages. No device need offer an array of textures of any size (bindless), so textures of one size share an array texture, and
// there are kMeshPages sizes for colours and as many for numbers: sides are brought to powers of two, rare small sizes to larger ones.
#pragma once

#include "rhi/types.h"

#include <cstdint>
#include <span>
#include <vector>

namespace kiln::render {

struct PagedTexture {
    int width = 0, height = 0;
    const uint8_t* rgba = nullptr;
    bool srgb = false;
    // Where it is; page < 0: there was no room.
    int page = -1;
    uint32_t layer = 0;
};

// Gives every texture a page and a layer; answers the sizes of the pages, colours first.
std::vector<rhi::Extent> assign_pages(std::span<PagedTexture> textures);

// A texture at another size (bilinear, in linear light, edges repeat), and its next smaller level (each texel the mean of four).
std::vector<uint8_t> resized(const PagedTexture& texture, rhi::Extent size);
std::vector<uint8_t> half_sized(std::span<const uint8_t> rgba, rhi::Extent size, bool srgb);

}  // namespace kiln::render
