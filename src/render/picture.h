// SPDX-License-Identifier: MIT
// Putting pictures together from tiles that came back from the GPU.
#pragma once

#include <kiln/renderer.h>

#include <cstddef>
#include <span>

namespace kiln::render {

float float_from_half(uint16_t half);

// Copies a tile into its place. `radiance`: 4 halves a pixel (shaded) or 4 floats (other views); `shown`: 4 bytes a pixel.
void place_tile(Picture& picture, int x, int y, int width, int height, std::span<const std::byte> radiance,
                std::span<const std::byte> shown, std::span<const float> depth);
// The shown bytes of one alone.
void place_shown(Picture& picture, int x, int y, int width, int height, std::span<const std::byte> shown);

}  // namespace kiln::render
