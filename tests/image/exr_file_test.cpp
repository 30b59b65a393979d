// SPDX-License-Identifier: MIT

#include "image/exr_file.h"

#include "feed.h"
#include "image/file.h"
#include "temp_folder.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <random>

using namespace kiln;
using namespace kiln::image;

namespace {

constexpr float kInf = std::numeric_limits<float>::infinity();

}  // namespace

TEST(ExrFile, LightComesBackAsHalves) {
    const TempFolder folder;
    const std::string path = (folder / "light.exr").string();
    std::mt19937 random(3);
    for (const int channels : {3, 4}) {
        std::vector<float> values(size_t(33 * 17 * channels));
        for (float& v : values) v = std::exp2(float(random() % 2000) / 100 - 10);
        values[0] = 0;
        values[1] = 1e9f;                                     // stored as the largest half
        values[2] = std::numeric_limits<float>::quiet_NaN();  // stored as 0
        ASSERT_TRUE(write_exr(path, 33, 17, channels, values));
        Result<FloatPixels> back = read_exr(path);
        ASSERT_TRUE(back) << back.error().message;
        ASSERT_EQ(back->channels, channels);
        ASSERT_EQ(back->values.size(), values.size());
        EXPECT_EQ(back->values[0], 0);
        EXPECT_EQ(back->values[1], 65504);
        EXPECT_EQ(back->values[2], 0);
        for (size_t i = 3; i < values.size(); ++i) ASSERT_NEAR(back->values[i], values[i], values[i] * 0x1p-11f) << i;
    }
}

TEST(ExrFile, DepthComesBackExactlyWithItsInfinities) {
    const TempFolder folder;
    const std::string path = (folder / "depth.exr").string();
    std::vector<float> depth(20 * 11);
    for (size_t i = 0; i < depth.size(); ++i) depth[i] = i % 7 == 0 ? kInf : 0.1f + float(i) * 1.2345678f;
    ASSERT_TRUE(write_exr_depth(path, 20, 11, depth));
    Result<FloatPixels> back = read_exr(path);
    ASSERT_TRUE(back) << back.error().message;
    EXPECT_EQ(back->channels, 1);
    EXPECT_EQ(back->width, 20);
    EXPECT_EQ(back->height, 11);
    EXPECT_EQ(back->values, depth);
}

TEST(ExrFile, ErrorsNameTheFileAndLeaveNothingBehind) {
    const Result<FloatPixels> missing = read_exr("/nowhere/at/all.exr");
    ASSERT_FALSE(missing);
    EXPECT_EQ(missing.error().kind, ErrorKind::Input);
    EXPECT_NE(missing.error().message.find("/nowhere/at/all.exr"), std::string::npos);
    const std::vector<float> values(3);
    const Result<void> unwritable = write_exr("/nowhere/at/all.exr", 1, 1, 3, values);
    ASSERT_FALSE(unwritable);
    EXPECT_EQ(unwritable.error().kind, ErrorKind::Failed);
    EXPECT_NE(unwritable.error().message.find("/nowhere/at/all.exr"), std::string::npos);
    EXPECT_FALSE(write_exr_depth("/nowhere/at/all.exr", 3, 1, values));
}

TEST(ExrFile, CutAndFlippedFilesGiveErrorsOrPixelsNeverCrashes) {
    const TempFolder folder;
    const std::string path = (folder / "hostile.exr").string();
    std::vector<float> values(24 * 40 * 3);
    for (size_t i = 0; i < values.size(); ++i) values[i] = float(i % 97) * 0.01f;
    ASSERT_TRUE(write_exr(path, 24, 40, 3, values));
    const std::vector<std::byte> good = *read_bytes(path);
    for (size_t size = 0; size < good.size(); size += 1 + good.size() / 100) {
        ASSERT_EQ(pixels_complaint(decode_exr(std::span(good).first(size), "cut.exr"), "cut.exr"), "");
    }
    std::mt19937 random(5);
    for (int i = 0; i < 1000; ++i) {
        std::vector<std::byte> bad = good;
        // Mostly in the header, where a flip does the most harm.
        const size_t reach = i % 4 == 0 ? bad.size() : std::min<size_t>(bad.size(), 400);
        for (auto flips = 1 + random() % 3; flips > 0; --flips) bad[random() % reach] ^= std::byte(1u << random() % 8);
        ASSERT_EQ(pixels_complaint(decode_exr(bad, "flipped.exr"), "flipped.exr"), "");
    }
}
