// SPDX-License-Identifier: MIT
// Starts threads.
// Gate G19 at the sizes that pictures have, not only at powers of two: the energy of a spark wherever it is, its glow while it moves by less than
// a pixel, and the same picture at another resolution.
#include "image/metrics.h"
#include "render/lens.h"
#include "rounds.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

namespace kiln::render {
namespace {

Picture picture_of(int width, int height, const std::function<vec3(double, double)>& light) {
    Picture p;
    p.width = width;
    p.height = height;
    p.rgba.resize(size_t(width) * size_t(height) * 4, 1);
    p.srgb.resize(p.rgba.size());
    constexpr int kAcross = 4;  // samples of a pixel
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            vec3 sum{};
            for (int k = 0; k < kAcross * kAcross; ++k)
                sum = sum +
                      light((x + (k % kAcross + 0.5) / kAcross) / height, (y + (k / kAcross + 0.5) / kAcross) / height);
            sum = sum * (1.0f / (kAcross * kAcross));
            float* const to = &p.rgba[(size_t(y) * size_t(width) + size_t(x)) * 4];
            to[0] = sum.x, to[1] = sum.y, to[2] = sum.z;
        }
    }
    return p;
}

Picture spark(int width, int height, int x, int y, float first, float second) {
    Picture p;
    p.width = width;
    p.height = height;
    p.rgba.resize(size_t(width) * size_t(height) * 4);
    for (size_t c = 0; c < 3; ++c) {
        p.rgba[(size_t(y) * size_t(width) + size_t(x)) * 4 + c] = first;
        p.rgba[(size_t(y) * size_t(width) + size_t(x) + 1) * 4 + c] = second;
    }
    return p;
}

double energy(const Picture& p, const Camera& camera) {
    double sum = 0;
    for (const vec3& c : glow_of(p, camera, 1)) sum += double(c.y);
    return sum;
}

constexpr int kSizes[][2] = {{256, 256}, {480, 270}, {251, 179}, {320, 181}};

TEST(BloomGate, ASparkKeepsItsEnergyAtEverySizeAndPlace) {
    for (const auto& [width, height] : kSizes) {
        for (int i = 0; i < 5; ++i) {
            const int x = width / 2 - 17 + 7 * i, y = height / 2 + 5 * i - 11;
            const Camera camera{.bloom = 1, .bloom_size = 0.05f};
            EXPECT_NEAR(energy(spark(width, height, x, y, 1000, 0), camera), 1000, 1)
                << width << " x " << height << ", spark at " << x << ", " << y;
        }
    }
}

TEST(BloomGate, ASparkThatMovesByPartsOfAPixelDoesNotFlicker) {
    for (const auto& [width, height] : kSizes) {
        double least = 1e30, most = 0, low = 1e30, high = 0;
        for (int step = 0; step < rounds(16); ++step) {
            const float share = float(step % 4) / 4;
            const int x = width / 2 + step / 4, y = height / 2;
            const Picture p = spark(width, height, x, y, 1000 * (1 - share), 1000 * share);
            const Camera camera{.bloom = 1, .bloom_size = 0.1f};
            const auto glow = glow_of(p, camera, 1);
            double sum = 0;
            for (const vec3& c : glow) sum += double(c.y);
            least = std::min(least, sum), most = std::max(most, sum);
            // Its brightness where it is looked at from: a ring around it, so that the spark's own place does not count.
            double ring = 0;
            for (int k = 0; k < 16; ++k) {
                const double turn = k * 0.39269908169872414;
                const int u = int(x + double(share) + 0.5 + 8 * std::cos(turn)), v = int(y + 0.5 + 8 * std::sin(turn));
                ring += double(glow[size_t(v) * size_t(width) + size_t(u)].y);
            }
            low = std::min(low, ring), high = std::max(high, ring);
        }
        EXPECT_LE(most / least, 1.05) << width << " x " << height;
        EXPECT_LE(high / low, 1.1) << width << " x " << height;
    }
}

// Lamps of several sizes in a dim room, at one and at twice the resolution.
double flip_at_twice(int height) {
    const auto room = [](double x, double y) {
        vec3 out{0.05f + 0.05f * float(y), 0.06f, 0.08f};
        constexpr double kLamps[][4] = {
            {0.4, 0.3, 0.05, 12}, {1.2, 0.6, 0.02, 60}, {0.9, 0.25, 0.008, 200}, {1.5, 0.8, 0.1, 4}};
        for (const auto& [u, v, radius, light] : kLamps)
            if (std::hypot(x - u, y - v) < radius) out = out + vec3{1, 0.8f, 0.6f} * float(light);
        return out;
    };
    const Camera camera{.tone_map = ToneMap::Aces, .bloom = 0.1f, .bloom_size = 0.15f};
    const auto shown = [&](int pixels) {
        Picture p = picture_of(pixels * 16 / 9, pixels, room);
        develop(p, camera, {.multiplier = 1, .stops = 0, .measured = 0, .known = 0});
        return p;
    };
    const Picture one = shown(height), two = shown(2 * height);
    image::Rgb a, b;
    a.width = b.width = one.width, a.height = b.height = one.height;
    for (int y = 0; y < one.height; ++y) {
        for (int x = 0; x < one.width; ++x) {
            for (size_t c = 0; c < 3; ++c) {
                a.values.push_back(float(one.srgb[(size_t(y) * size_t(one.width) + size_t(x)) * 4 + c]) / 255);
                float sum = 0;
                for (int k = 0; k < 4; ++k)
                    sum += float(two.srgb[(size_t(2 * y + k / 2) * size_t(two.width) + size_t(2 * x + k % 2)) * 4 + c]);
                b.values.push_back(sum / (4 * 255));
            }
        }
    }
    const double flip = image::flip(a, b);
    testing::Test::RecordProperty("flip_" + std::to_string(height), std::to_string(flip));
    return flip;
}

TEST(BloomGate, APictureAtTwiceTheResolutionShowsTheSameGlow) { EXPECT_LE(flip_at_twice(180), 0.01); }

TEST(BloomGateSlow, FullHdShowsTheGlowOf540Lines) { EXPECT_LE(flip_at_twice(540), 0.01); }

}  // namespace
}  // namespace kiln::render
