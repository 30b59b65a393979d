// SPDX-License-Identifier: MIT
// Starts threads.
// Bloom, exposure and what they make of a picture: the host's way against closed forms (gate G19), the kernels against the host.
#include "gpu_worlds.h"
#include "render/lens.h"

#include <cmath>
#include <numbers>

namespace kiln::render {
namespace {

Picture black(int width, int height) {
    Picture p;
    p.width = width;
    p.height = height;
    p.rgba.resize(size_t(width) * size_t(height) * 4);
    return p;
}

void set(Picture& p, int x, int y, float light) {
    for (size_t k = 0; k < 3; ++k) p.rgba[(size_t(y) * size_t(p.width) + size_t(x)) * 4 + k] = light;
}

double energy(const std::vector<vec3>& glow) {
    double sum = 0;
    for (const vec3& c : glow) sum += double(c.y);
    return sum;
}

TEST(Lens, GlowsKeepTheLightOfASpark) {
    for (const BloomKind kind : {BloomKind::Pyramid, BloomKind::Gaussian}) {
        Picture p = black(256, 256);
        set(p, 131, 126, 1000);
        EXPECT_NEAR(energy(glow_of(p, {.bloom = 1, .bloom_size = 0.05f, .bloom_kind = kind}, 1)), 1000, 1) << int(kind);
    }
}

// Ten passes of the classic blur are one Gaussian of the sum of their variances, in closed form.
TEST(Lens, TheClassicBlurIsAGaussian) {
    Picture p = black(96, 96);
    set(p, 48, 47, 1000);
    const auto glow = glow_of(p, {.bloom = 1, .bloom_kind = BloomKind::Gaussian}, 1);
    double sum = 0, second = 0;
    for (int i = -6; i <= 6; ++i) sum += std::exp(-i * i / 8.0), second += i * i * std::exp(-i * i / 8.0);
    const double variance = 5 * second / sum, peak = 1000 / (2 * std::numbers::pi * variance);
    for (int y = 30; y < 64; ++y)
        for (int x = 30; x < 66; ++x)
            EXPECT_NEAR(glow[size_t(y) * 96 + size_t(x)].y,
                        peak * std::exp(-((x - 48) * (x - 48) + (y - 47) * (y - 47)) / (2 * variance)), 0.02 * peak)
                << x << ", " << y;
}

TEST(Lens, GlowIsRound) {
    Picture p = black(256, 256);
    for (const int x : {127, 128})
        for (const int y : {127, 128}) set(p, x, y, 1000);
    const auto glow = glow_of(p, {.bloom = 1, .bloom_size = 0.1f}, 1);
    const auto at = [&](double x, double y) {
        const int i = int(std::floor(x - 0.5)), j = int(std::floor(y - 0.5));
        const double s = x - 0.5 - i, t = y - 0.5 - j;
        const auto texel = [&](int u, int v) { return double(glow[size_t(v) * 256 + size_t(u)].y); };
        return (texel(i, j) * (1 - s) + texel(i + 1, j) * s) * (1 - t) +
               (texel(i, j + 1) * (1 - s) + texel(i + 1, j + 1) * s) * t;
    };
    for (const double r : {6.0, 10.0, 16.0, 24.0}) {
        double least = 1e30, most = 0;
        for (int i = 0; i < 64; ++i) {
            const double turn = i * std::numbers::pi / 32,
                         value = at(128 + r * std::cos(turn), 128 + r * std::sin(turn));
            least = std::min(least, value);
            most = std::max(most, value);
        }
        EXPECT_LE(most - least, 0.02 * at(128, 128)) << "at " << r << " pixels";
        EXPECT_LE(most / least, r < 8 ? 1.2 : 1.06) << "at " << r << " pixels";
    }
}

// A spark narrower than a pixel keeps its glow while it moves.
TEST(Lens, GlowOfAMovingSparkDoesNotFlicker) {
    double least = 1e30, most = 0;
    for (int step = 0; step < 16; ++step) {
        Picture p = black(192, 128);
        const float share = float(step % 8) / 8;
        set(p, 90 + step / 8, 64, 1000 * (1 - share));
        set(p, 91 + step / 8, 64, 1000 * share);
        const auto glow = glow_of(p, {.bloom = 1, .bloom_size = 0.1f}, 1);
        const double peak = double(glow[64 * 192 + 91].y);
        const double sum = energy(glow);
        least = std::min(least, sum);
        most = std::max(most, sum);
        EXPECT_GT(peak, 0);
    }
    EXPECT_LE(most / least, 1.05);
}

TEST(Lens, GlowIsAsLargeAtAnyResolution) {
    std::vector<std::vector<double>> profiles;  // at shares of the height, each of the light of the whole
    for (const int height : {90, 180, 270, 360}) {
        Picture p = black(height, height);
        const int from = height * 4 / 9, to = height * 5 / 9;
        for (int y = from; y < to; ++y)
            for (int x = from; x < to; ++x) set(p, x, y, 1);
        const auto glow = glow_of(p, {.bloom = 1, .bloom_size = 0.2f}, 1);
        profiles.emplace_back();
        for (const double share : {0.02, 0.08, 0.14, 0.2}) {
            const int x = int((0.5 + share) * height), y = height / 2;
            profiles.back().push_back(double(glow[size_t(y) * size_t(height) + size_t(x)].y));
        }
    }
    for (size_t i = 1; i < profiles.size(); ++i)
        for (size_t k = 0; k < profiles[0].size(); ++k)
            EXPECT_NEAR(profiles[i][k], profiles.back()[k], 0.03) << "resolution " << i << ", place " << k;
}

TEST(Lens, MiddleLuminanceBecomesMiddleGrey) {
    for (const float light : {0.01f, 1.0f, 300.0f}) {
        Picture p = black(64, 64);
        for (int y = 0; y < 48; ++y)
            for (int x = 0; x < 64; ++x) set(p, x, y, light);  // what is black does not count
        const auto state = measured_exposure(p.rgba, {.auto_exposure = true}, 0, {});
        EXPECT_NEAR(state.multiplier * light / 0.18f, 1, 0.05) << light;
        const auto brighter = measured_exposure(p.rgba, {.exposure = 2, .auto_exposure = true}, 0, {});
        EXPECT_FLOAT_EQ(brighter.multiplier, 2 * state.multiplier);
    }
    const auto dark = measured_exposure(black(8, 8).rgba, {.exposure = 3, .auto_exposure = true}, 0, {});
    EXPECT_FLOAT_EQ(dark.multiplier, 3);
}

TEST(Lens, EyesFollowAtAnyFrameRateWithoutOvershoot) {
    Picture dim = black(16, 16), bright = black(16, 16);
    for (int y = 0; y < 16; ++y)
        for (int x = 0; x < 16; ++x) set(dim, x, y, 0.5f), set(bright, x, y, 40);
    for (const bool to_bright : {true, false}) {
        std::vector<float> after;  // half a second
        for (const int rate : {30, 60, 144}) {
            const Camera camera{.auto_exposure = true};
            auto state = measured_exposure((to_bright ? dim : bright).rgba, camera, 0, {});
            const Picture& now = to_bright ? bright : dim;
            const float end = measured_exposure(now.rgba, camera, 0, {}).stops;
            float before = state.stops;
            for (int i = 0; i < 4 * rate; ++i) {
                state = measured_exposure(now.rgba, camera, 1 / float(rate), state);
                EXPECT_TRUE(to_bright ? state.stops >= before && state.stops <= end + 1e-4f
                                      : state.stops <= before && state.stops >= end - 1e-4f);
                before = state.stops;
                if (i + 1 == rate / 2) after.push_back(state.stops);
            }
            EXPECT_NEAR(state.stops, end, 0.25f);
        }
        for (const float stops : after) EXPECT_NEAR(stops, after[0], 0.01f * std::fabs(after[0]) + 0.01f);
    }
}

struct LensGpu : testing::Test {
    void SetUp() override {
        renderer = renderer_or_skip();
        if (!renderer && !HasFailure()) GTEST_SKIP() << "no Vulkan device";
    }
    std::unique_ptr<Renderer> renderer;
};

TEST_F(LensGpu, KernelsDevelopAsTheHostDoes) {
    Frame frame = frame_of(on_ground());
    frame.materials[1].emissive = {30, 10, 2};
    frame.environment->intensity = 0.01f;  // luminances of all sizes
    frame.lights = {{.kind = Light::Kind::Point, .position = {0.6f, 0.4f, 0.9f}, .intensity = 4}};
    const Camera cameras[] = {
        {.tone_map = ToneMap::Agx},
        {.tone_map = ToneMap::Aces, .bloom = 0.2f},
        {.tone_map = ToneMap::Neutral, .auto_exposure = true, .bloom = 0.5f, .bloom_size = 0.3f},
        {.exposure = 0.5f, .bloom = 0.3f, .bloom_threshold = 1.5f, .bloom_kind = BloomKind::Gaussian}};
    for (const Camera& lens : cameras) {
        const Camera place = frame.camera;
        frame.camera = lens;
        frame.camera.position = place.position, frame.camera.target = place.target;
        const Picture drawn = rhi::must(renderer->render(frame, {.width = 150, .height = 101}));
        const float multiplier = renderer->stats().exposure;
        Picture again = drawn;
        const auto state = measured_exposure(drawn.rgba, frame.camera, 0, {});
        EXPECT_NEAR(multiplier / state.multiplier, 1, 1e-3);
        develop(again, frame.camera, state);
        int worst = 0;
        for (size_t i = 0; i < drawn.srgb.size(); ++i)
            worst = std::max(worst, std::abs(int(drawn.srgb[i]) - int(again.srgb[i])));
        EXPECT_LE(worst, 2) << "bloom " << lens.bloom << ", tone map " << int(lens.tone_map);
        frame.camera = place;
    }
}

TEST_F(LensGpu, ExposureIsKeptFromPictureToPicture) {
    Frame frame = frame_of(on_ground());
    frame.camera.auto_exposure = true;
    rhi::must(renderer->render(frame, {.width = 64, .height = 48}));
    const float first = renderer->stats().exposure;
    for (Light& light : frame.lights) light.illuminance *= 50;
    frame.environment->intensity *= 50;
    float before = first;
    for (int i = 0; i < 5; ++i) {
        rhi::must(renderer->render(frame, {.width = 64, .height = 48, .elapsed = 0.1f}));
        EXPECT_LT(renderer->stats().exposure, before);
        before = renderer->stats().exposure;
    }
    EXPECT_GT(before, first / 50);  // not there yet
    rhi::must(renderer->render(frame, {.width = 64, .height = 48}));
    EXPECT_LT(renderer->stats().exposure, before);
    EXPECT_GT(renderer->stats().exposure, first / 500);
}

}  // namespace
}  // namespace kiln::render
