// SPDX-License-Identifier: MIT
#include "render/texture_pages.h"

#include "render/lib/color.gpu.h"
#include "render/passes/mesh.gpu.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

namespace kiln::render {
namespace {

using rhi::Extent;

uint64_t area(Extent e) { return uint64_t{e.width} * e.height; }

float from_byte(uint8_t v, bool srgb) {
    static const std::array<float, 256> table = [] {
        std::array<float, 256> out{};
        for (size_t i = 0; i < 256; ++i) {
            const float f = float(i) / 255;
            out[i] = shade::linear_from_srgb3({f, f, f}).x;
        }
        return out;
    }();
    return srgb ? table[v] : float(v) / 255;
}

uint8_t to_byte(float v, bool srgb) {
    if (srgb) v = shade::srgb_from_linear3({v, v, v}).x;
    return uint8_t(std::lround(std::clamp(v, 0.0f, 1.0f) * 255));
}

}  // namespace

std::vector<Extent> assign_pages(std::span<PagedTexture> textures) {
    std::vector<Extent> out(2 * kMeshPages, Extent{1, 1, 1});
    for (const bool srgb : {true, false}) {
        std::vector<Extent> sizes, of(textures.size());
        for (size_t i = 0; i < textures.size(); ++i) {
            if (textures[i].srgb != srgb) continue;
            of[i] = {std::min(std::bit_ceil(uint32_t(textures[i].width)), rhi::kMaxTexture2d),
                     std::min(std::bit_ceil(uint32_t(textures[i].height)), rhi::kMaxTexture2d), 1};
            if (std::find(sizes.begin(), sizes.end(), of[i]) == sizes.end()) sizes.push_back(of[i]);
        }
        const auto smaller = [](Extent a, Extent b) {
            return area(a) != area(b) ? area(a) < area(b) : a.width < b.width;
        };
        std::sort(sizes.begin(), sizes.end(), smaller);
        while (sizes.size() > kMeshPages) {
            // The smallest goes to the next that holds it, or grows to where one does.
            const Extent least = sizes.front();
            sizes.erase(sizes.begin());
            Extent to{};
            for (const Extent s : sizes)
                if (to.width <= 1 && s.width >= least.width && s.height >= least.height) to = s;
            if (to.width <= 1) {
                to = {std::max(least.width, sizes.back().width), std::max(least.height, sizes.back().height), 1};
                if (std::find(sizes.begin(), sizes.end(), to) == sizes.end()) sizes.push_back(to);
            }
            for (Extent& e : of)
                if (e == least) e = to;
        }
        const size_t first = srgb ? 0 : kMeshPages;
        for (size_t p = 0; p < sizes.size(); ++p) {
            uint32_t layers = 0;
            for (size_t i = 0; i < textures.size(); ++i) {
                if (textures[i].srgb != srgb || of[i] != sizes[p] || layers == rhi::kMaxTextureLayers) continue;
                textures[i].page = int(first + p);
                textures[i].layer = layers++;
            }
            out[first + p] = {sizes[p].width, sizes[p].height, std::max(layers, 1u)};
        }
    }
    return out;
}

std::vector<uint8_t> resized(const PagedTexture& t, Extent size) {
    const size_t width = size_t(t.width), height = size_t(t.height);
    if (width == size.width && height == size.height) return {t.rgba, t.rgba + width * height * 4};
    std::vector<uint8_t> out(size_t{size.width} * size.height * 4);
    for (size_t y = 0; y < size.height; ++y) {
        const float v = (float(y) + 0.5f) / float(size.height) * float(height) - 0.5f;
        const float v0 = std::floor(v), fy = v - v0;
        const size_t y0 = (size_t(v0 + float(height))) % height, y1 = (y0 + 1) % height;
        for (size_t x = 0; x < size.width; ++x) {
            const float u = (float(x) + 0.5f) / float(size.width) * float(width) - 0.5f;
            const float u0 = std::floor(u), fx = u - u0;
            const size_t x0 = (size_t(u0 + float(width))) % width, x1 = (x0 + 1) % width;
            for (size_t c = 0; c < 4; ++c) {
                const bool srgb = t.srgb && c < 3;
                const auto at = [&](size_t i, size_t j) { return from_byte(t.rgba[(j * width + i) * 4 + c], srgb); };
                const float low = at(x0, y0) * (1 - fx) + at(x1, y0) * fx,
                            high = at(x0, y1) * (1 - fx) + at(x1, y1) * fx;
                out[(y * size.width + x) * 4 + c] = to_byte(low * (1 - fy) + high * fy, srgb);
            }
        }
    }
    return out;
}

std::vector<uint8_t> half_sized(std::span<const uint8_t> rgba, Extent size, bool srgb) {
    const size_t width = std::max(size.width / 2, 1u), height = std::max(size.height / 2, 1u);
    std::vector<uint8_t> out(width * height * 4);
    for (size_t y = 0; y < height; ++y) {
        for (size_t x = 0; x < width; ++x) {
            for (size_t c = 0; c < 4; ++c) {
                float sum = 0;
                for (size_t k = 0; k < 4; ++k) {
                    const size_t i = std::min(2 * x + (k & 1), size_t{size.width} - 1),
                                 j = std::min(2 * y + (k >> 1), size_t{size.height} - 1);
                    sum += from_byte(rgba[(j * size.width + i) * 4 + c], srgb && c < 3);
                }
                out[(y * width + x) * 4 + c] = to_byte(0.25f * sum, srgb && c < 3);
            }
        }
    }
    return out;
}

}  // namespace kiln::render
