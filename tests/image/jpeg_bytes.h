// SPDX-License-Identifier: MIT
// JPEG files for tests, as libjpeg writes them.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <jpeglib.h>
#include <span>
#include <vector>

namespace kiln::image {

// A smooth picture, of which little is lost.
inline uint8_t jpeg_value(int x, int y, int channel) {
    return uint8_t(128 + 60 * std::sin(0.11 * x + channel) + 50 * std::cos(0.07 * y - 2 * channel));
}

inline std::vector<std::byte> jpeg_bytes(int width, int height, int channels, bool progressive) {
    jpeg_compress_struct jpeg{};
    jpeg_error_mgr errors{};
    jpeg.err = jpeg_std_error(&errors);
    jpeg_create_compress(&jpeg);
    unsigned char* out = nullptr;
    unsigned long size = 0;
    jpeg_mem_dest(&jpeg, &out, &size);
    jpeg.image_width = JDIMENSION(width), jpeg.image_height = JDIMENSION(height);
    jpeg.input_components = channels;
    jpeg.in_color_space = channels == 1 ? JCS_GRAYSCALE : channels == 3 ? JCS_RGB : JCS_CMYK;
    jpeg_set_defaults(&jpeg);
    jpeg_set_quality(&jpeg, 95, TRUE);
    if (progressive) jpeg_simple_progression(&jpeg);
    jpeg_start_compress(&jpeg, TRUE);
    std::vector<uint8_t> row(size_t(width) * size_t(channels));
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x)
            for (int c = 0; c < channels; ++c) row[size_t(x * channels + c)] = jpeg_value(x, y, c);
        JSAMPROW rows = row.data();
        jpeg_write_scanlines(&jpeg, &rows, 1);
    }
    jpeg_finish_compress(&jpeg);
    const auto bytes = std::as_bytes(std::span(out, size));
    std::vector<std::byte> kept(bytes.begin(), bytes.end());
    jpeg_destroy_compress(&jpeg);
    std::free(out);
    return kept;
}

}  // namespace kiln::image
