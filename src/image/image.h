// SPDX-License-Identifier: MIT
// Pictures in memory. Rows from the top, pixels from the left, channels interleaved.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace kiln::image {

// Whole numbers as a file stores them: 0 to 255 for 8 bits, to 65535 for 16. 1 channel is grey, 2 grey and alpha, 3 RGB, 4 RGBA.
struct Pixels {
    int width = 0, height = 0, channels = 0, bits = 8;
    std::vector<uint16_t> values;

    uint16_t at(int x, int y, int channel) const {
        return values[(size_t(y) * size_t(width) + size_t(x)) * size_t(channels) + size_t(channel)];
    }
};

// Any values: linear light, distances; +infinity and NaN may occur.
struct FloatPixels {
    int width = 0, height = 0, channels = 0;
    std::vector<float> values;

    float at(int x, int y, int channel) const {
        return values[(size_t(y) * size_t(width) + size_t(x)) * size_t(channels) + size_t(channel)];
    }
};

// Longest side that is read or written.
inline constexpr int kMaxSide = 32768;

}  // namespace kiln::image
