// SPDX-License-Identifier: MIT
// Starts threads.

#include "image/metrics.h"

#include "image/exr_file.h"
#include "image/png_file.h"
#include "temp_folder.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <random>

using namespace kiln;
using namespace kiln::image;

namespace {

Rgb flat(int width, int height, float r, float g, float b) {
    Rgb out{width, height, {}};
    for (int i = 0; i < width * height; ++i) out.values.insert(out.values.end(), {r, g, b});
    return out;
}

// Smooth colours with a sharp disc: something for every part of the metrics.
Rgb scene(int width, int height, float shift = 0) {
    Rgb out{width, height, {}};
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            const float u = (float(x) + shift) / float(width), v = float(y) / float(height);
            const bool in = std::hypot(u - 0.5f, v - 0.5f) < 0.25f;
            out.values.insert(out.values.end(),
                              {in ? 0.9f : 0.3f * u + 0.2f, in ? 0.4f : v * 0.6f, 0.5f + 0.3f * std::sin(9 * u)});
        }
    }
    return out;
}

Rgb noisy(Rgb rgb, float amount) {
    std::mt19937 random(1);
    for (float& v : rgb.values) v = std::clamp(v + amount * (float(random() % 2001) / 1000 - 1), 0.0f, 1.0f);
    return rgb;
}

}  // namespace

TEST(Metrics, EqualPicturesAreEqual) {
    const Rgb a = scene(48, 40);
    EXPECT_TRUE(std::isinf(psnr(a, a)));
    EXPECT_NEAR(ssim(a, a), 1, 1e-12);
    EXPECT_EQ(flip(a, a), 0);
    EXPECT_EQ(largest_difference(a, a), 0);
}

TEST(Metrics, PsnrIsTheMeanSquaredError) {
    EXPECT_NEAR(psnr(flat(9, 5, 0.5f, 0.5f, 0.5f), flat(9, 5, 0.6f, 0.6f, 0.6f)), 20, 1e-5);
    EXPECT_NEAR(psnr(flat(9, 5, 0, 0, 0), flat(9, 5, 0.01f, 0.01f, 0.01f)), 40, 1e-4);
}

// On flat pictures only the luminance term is left: (2pq + c1) / (p² + q² + c1).
TEST(Metrics, SsimOfFlatPicturesIsItsLuminanceTerm) {
    const double p = 0.25, q = 0.75;
    EXPECT_NEAR(ssim(flat(20, 20, 0.25f, 0.25f, 0.25f), flat(20, 20, 0.75f, 0.75f, 0.75f)),
                (2 * p * q + 1e-4) / (p * p + q * q + 1e-4), 1e-6);
    Rgb checker = flat(32, 32, 0, 0, 0), inverse = checker;
    for (size_t i = 0; i < checker.values.size(); ++i) {
        checker.values[i] = float((i / 3 + i / 96) % 2);
        inverse.values[i] = 1 - checker.values[i];
    }
    EXPECT_LT(ssim(checker, inverse), -0.9) << "opposite structure";
}

// Values that follow from the paper's formulas on flat pictures, where filters do nothing.
TEST(Flip, FlatPicturesGiveTheColorErrorAlone) {
    // The most distant pair of the gamut, by definition.
    EXPECT_NEAR(flip(flat(24, 24, 0, 1, 0), flat(24, 24, 0, 0, 1)), 1, 1e-6);
    // Black to white: HyAB is 100 (L* alone), and green to blue 203.3 (from their L*a*b* values with the Hunt effect):
    // in L*a*b*, green is (87.73, -86.18, 83.18) and blue (32.30, 79.19, -107.86).
    const double green[] = {87.73, -86.18 * 0.8773, 83.18 * 0.8773}, blue[] = {32.30, 79.19 * 0.3230, -107.86 * 0.3230};
    const double most = std::pow(green[0] - blue[0] + std::hypot(green[1] - blue[1], green[2] - blue[2]), 0.7);
    const double e = std::pow(100.0, 0.7);
    const double expected = 0.95 + (e - 0.4 * most) / (0.6 * most) * 0.05;
    EXPECT_NEAR(flip(flat(24, 24, 0, 0, 0), flat(24, 24, 1, 1, 1)), expected, 1e-4);
    // Two greys differ in L* alone.
    auto lightness = [](double s) { return 116 * std::cbrt(std::pow((s + 0.055) / 1.055, 2.4)) - 16; };
    EXPECT_NEAR(flip(flat(24, 24, 0.5f, 0.5f, 0.5f), flat(24, 24, 0.52f, 0.52f, 0.52f)),
                std::pow(lightness(0.52) - lightness(0.5), 0.7) * 0.95 / (0.4 * most), 1e-4);
}

TEST(Flip, IsTheSameBothWaysAndGrowsWithTheError) {
    const Rgb a = scene(64, 48);
    double before = 0;
    for (const float amount : {0.01f, 0.05f, 0.2f, 0.6f}) {
        const Rgb b = noisy(a, amount);
        const double there = flip(a, b), back = flip(b, a);
        EXPECT_NEAR(there, back, 1e-9);
        EXPECT_GT(there, before);
        EXPECT_LE(there, 1);
        before = there;
    }
}

// High frequencies are filtered as the eye filters them: fine noise hurts less at more pixels a degree.
TEST(Flip, SeesFineNoiseLessFromFarther) {
    const Rgb a = flat(64, 64, 0.5f, 0.5f, 0.5f), b = noisy(a, 0.2f);
    EXPECT_LT(flip(a, b, 120), flip(a, b, 67));
    EXPECT_LT(flip(a, b, 67), flip(a, b, 20));
}

TEST(Flip, FindsAMovedEdgeWhereItIs) {
    const Rgb a = scene(64, 64), b = scene(64, 64, 2);
    const std::vector<float> map = flip_map(a, b);
    const float at_edge = map[32 * 64 + 15], inside = map[32 * 64 + 32];
    EXPECT_GT(at_edge, 0.4f);
    EXPECT_LT(inside, at_edge / 2);
}

TEST(Metrics, FilesAreComparedByContent) {
    const TempFolder folder;
    const std::string a = (folder / "a.png").string(), b = (folder / "b.png").string(), c = (folder / "c.exr").string();
    Pixels p{8, 8, 3, 8, std::vector<uint16_t>(192, 128)};
    ASSERT_TRUE(write_png(a, p));
    p.values[0] = 255;
    ASSERT_TRUE(write_png(b, p));
    ASSERT_TRUE(write_exr(c, 4, 8, 3, std::vector<float>(96, 0.5f)));
    Result<Difference> same = compare_files(a, a), other = compare_files(a, b);
    ASSERT_TRUE(same && other);
    EXPECT_EQ(same->flip, 0);
    EXPECT_NEAR(other->max_abs, 127.0 / 255, 1e-6);
    EXPECT_GT(other->flip, 0);
    Result<Difference> sizes = compare_files(a, c);
    ASSERT_FALSE(sizes);
    EXPECT_NE(sizes.error().message.find("8 x 8"), std::string::npos) << sizes.error().message;
    EXPECT_FALSE(compare_files(a, "/nowhere.png"));
}
