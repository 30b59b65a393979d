// SPDX-License-Identifier: MIT

#include "image/png_file.h"

#include "feed.h"
#include "image/file.h"
#include "temp_folder.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <random>

using namespace kiln;
using namespace kiln::image;

namespace {

Pixels noise(int width, int height, int channels, int bits) {
    Pixels p{width, height, channels, bits, {}};
    std::mt19937 random(7);
    p.values.resize(size_t(width) * size_t(height) * size_t(channels));
    for (uint16_t& v : p.values) v = uint16_t(random() & (bits == 16 ? 0xffff : 0xff));
    return p;
}

}  // namespace

TEST(PngFile, EveryKindComesBackAsItWasWritten) {
    const TempFolder folder;
    const std::string path = (folder / "round.png").string();
    for (const int bits : {8, 16}) {
        for (const int channels : {1, 2, 3, 4}) {
            for (const int width : {1, 7, 64}) {
                const Pixels p = noise(width, 5, channels, bits);
                ASSERT_TRUE(write_png(path, p));
                Result<Pixels> back = read_png(path);
                ASSERT_TRUE(back) << back.error().message;
                EXPECT_EQ(back->width, width);
                EXPECT_EQ(back->height, 5);
                EXPECT_EQ(back->channels, channels);
                EXPECT_EQ(back->bits, bits);
                EXPECT_EQ(back->values, p.values) << bits << " bits, " << channels << " channels, " << width << " wide";
            }
        }
    }
}

TEST(PngFile, IsMarkedAsSrgbAndAlwaysTheSameBytes) {
    const TempFolder folder;
    const std::string path = (folder / "marked.png").string();
    const std::vector<uint8_t> rgba(4 * 6 * 3, 100);
    ASSERT_TRUE(write_png(path, 6, 3, rgba));
    Result<std::vector<std::byte>> first = read_bytes(path);
    ASSERT_TRUE(write_png(path, 6, 3, rgba));
    Result<std::vector<std::byte>> second = read_bytes(path);
    ASSERT_TRUE(first && second);
    EXPECT_EQ(*first, *second);
    const std::string text(reinterpret_cast<const char*>(first->data()), first->size());
    EXPECT_NE(text.find("sRGB"), std::string::npos);
}

TEST(PngFile, ErrorsNameTheFileAndLeaveNothingBehind) {
    const Result<Pixels> missing = read_png("/nowhere/at/all.png");
    ASSERT_FALSE(missing);
    EXPECT_EQ(missing.error().kind, ErrorKind::Input);
    EXPECT_NE(missing.error().message.find("/nowhere/at/all.png"), std::string::npos) << missing.error().message;

    const Result<void> unwritable = write_png("/nowhere/at/all.png", noise(4, 4, 3, 8));
    ASSERT_FALSE(unwritable);
    EXPECT_EQ(unwritable.error().kind, ErrorKind::Failed);
    EXPECT_NE(unwritable.error().message.find("/nowhere/at/all.png"), std::string::npos) << unwritable.error().message;

    const TempFolder folder;
    const std::string path = (folder / "text.png").string();
    std::ofstream(path) << "this is no picture";
    const Result<Pixels> text = read_png(path);
    ASSERT_FALSE(text);
    EXPECT_EQ(text.error().message, path + ": not a PNG file");
}

// A header that promises 30,000 x 30,000 pixels over a few bytes is refused before memory is taken.
TEST(PngFile, SizesThatTheFileCannotHoldAreRefused) {
    const TempFolder folder;
    const std::string path = (folder / "huge.png").string();
    ASSERT_TRUE(write_png(path, noise(2, 2, 4, 8)));
    std::vector<std::byte> bytes = *read_bytes(path);
    auto crc = [&](size_t from, size_t to) {
        uint32_t c = 0xffffffffu;
        for (size_t i = from; i < to; ++i) {
            c ^= uint32_t(bytes[i]);
            for (int k = 0; k < 8; ++k) c = (c & 1) ? 0xedb88320u ^ (c >> 1) : c >> 1;
        }
        return c ^ 0xffffffffu;
    };
    for (const size_t at : {size_t(16), size_t(20)}) {
        bytes[at] = bytes[at + 1] = std::byte(0);
        bytes[at + 2] = std::byte(30000 >> 8);
        bytes[at + 3] = std::byte(30000 & 0xff);
    }
    const uint32_t sum = crc(12, 29);
    for (size_t i = 0; i < 4; ++i) bytes[29 + i] = std::byte(sum >> (24 - 8 * i) & 0xff);
    const Result<Pixels> got = decode_png(bytes, "huge.png");
    ASSERT_FALSE(got);
    EXPECT_NE(got.error().message.find("more pixels than the file can hold"), std::string::npos) << got.error().message;
}

TEST(PngFile, CutAndFlippedFilesGiveErrorsOrPixelsNeverCrashes) {
    const TempFolder folder;
    const std::string path = (folder / "hostile.png").string();
    std::mt19937 random(11);
    for (const int bits : {8, 16}) {
        ASSERT_TRUE(write_png(path, noise(16, 9, 3, bits)));
        const std::vector<std::byte> good = *read_bytes(path);
        for (size_t size = 0; size < good.size(); size += 1 + good.size() / 150) {
            EXPECT_FALSE(decode_png(std::span(good).first(size), "cut.png")) << size << " of " << good.size();
        }
        for (int i = 0; i < 1500; ++i) {
            std::vector<std::byte> bad = good;
            for (uint32_t flips = 1 + random() % 4; flips > 0; --flips)
                bad[random() % bad.size()] ^= std::byte(1u << random() % 8);
            ASSERT_EQ(pixels_complaint(decode_png(bad, "flipped.png"), "flipped.png"), "");
        }
    }
}
