// SPDX-License-Identifier: MIT

#include "feed.h"
#include "image/jpeg_bytes.h"
#include "image/jpeg_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

using namespace kiln;
using namespace kiln::image;

TEST(JpegFile, IsThePictureThatWasWritten) {
    for (const bool progressive : {false, true}) {
        for (const int channels : {1, 3}) {
            for (const int width : {1, 37, 64}) {
                const auto back = decode_jpeg(jpeg_bytes(width, 29, channels, progressive), "a.jpg");
                ASSERT_TRUE(back) << back.error().message;
                ASSERT_EQ(back->width, width);
                ASSERT_EQ(back->height, 29);
                ASSERT_EQ(back->channels, channels);
                ASSERT_EQ(back->bits, 8);
                double off = 0;
                for (int y = 0; y < 29; ++y)
                    for (int x = 0; x < width; ++x)
                        for (int c = 0; c < channels; ++c)
                            off += std::abs(int(back->values[size_t((y * width + x) * channels + c)]) -
                                            jpeg_value(x, y, c));
                EXPECT_LT(off / (29.0 * width * channels), 4) << width << " x 29, " << channels;
            }
        }
    }
}

TEST(JpegFile, WhatIsBrokenSaysSo) {
    const std::vector<std::byte> whole = jpeg_bytes(64, 64, 3, false);
    const auto fault = [](std::span<const std::byte> bytes) {
        const auto read = decode_jpeg(bytes, "a.jpg");
        return read ? std::string("read") : read.error().message;
    };
    EXPECT_EQ(fault({}), "a.jpg: not a JPEG file");
    EXPECT_THAT(fault(std::span(whole).first(whole.size() * 2 / 3)),
                testing::StartsWith("a.jpg: broken JPEG: it is cut short"));
    EXPECT_THAT(fault(std::span(whole).first(100)), testing::StartsWith("a.jpg: broken JPEG: "));
    EXPECT_THAT(fault(jpeg_bytes(8, 8, 4, false)), testing::HasSubstr("neither grey nor colour"));
    // A header that claims a picture far beyond its bytes.
    std::vector<std::byte> vast = whole;
    for (size_t i = 0; i + 8 < vast.size(); ++i) {
        if (vast[i] != std::byte{0xff} || vast[i + 1] != std::byte{0xc0}) continue;
        vast[i + 5] = vast[i + 7] = std::byte{0x3f};
        break;
    }
    EXPECT_THAT(fault(vast), testing::HasSubstr("more pixels than the file can hold"));
}

TEST(JpegFile, AnyBytesAreAPictureOrAnError) {
    std::mt19937 random(5);
    const std::vector<std::byte> whole[] = {jpeg_bytes(40, 24, 3, false), jpeg_bytes(33, 40, 3, true),
                                            jpeg_bytes(24, 24, 1, true)};
    int read = 0;
    for (int i = 0; i < 3000; ++i) {
        std::vector<std::byte> bytes = whole[random() % 3];
        for (size_t n = 1 + random() % 4; n-- > 0;)
            bytes[3 + random() % (bytes.size() - 3)] = std::byte(random() & 255);
        if (random() % 8 == 0) bytes.resize(3 + random() % (bytes.size() - 3));
        const auto picture = decode_jpeg(bytes, "a.jpg");
        read += picture ? 1 : 0;
        ASSERT_EQ(pixels_complaint(picture, "a.jpg"), "");
    }
    EXPECT_GT(read, 50);
}
