// SPDX-License-Identifier: MIT
// Pictures of fewer rays, made whole over time: against supersampled ones, against what went away, against no scale at all.
#include "over_time.h"
#include "render/temporal.h"

#include <cmath>

namespace kiln::render {
namespace {

TEST(Upscale, RoundsOfTheJitterFillThePixelsThatAreShown) {
    EXPECT_EQ(jitter_round(1), kJitterRound);
    EXPECT_EQ(jitter_round(0.5f), 4 * kJitterRound);
    // A ray's pixel is four shown ones: each is looked through as often, but for one time.
    int in[4] = {};
    for (uint32_t i = 0; i < jitter_round(0.5f); ++i) {
        const vec2 j = jitter_of(i, jitter_round(0.5f));
        ++in[(j.x >= 0) + 2 * (j.y >= 0)];
    }
    for (const int n : in) EXPECT_NEAR(n, int(kJitterRound), 1);
    EXPECT_EQ(rays_of({.width = 101, .height = 33, .scale = 0.5f}), std::pair(51, 17));
    EXPECT_EQ(rays_of({.width = 1, .height = 3, .scale = 0.25f}), std::pair(1, 1));
}

struct UpscaleGpu : PicturesOverTime {
    // Of fewer rays, each in all the pixels that it covers.
    image::Rgb blocks(const Frame& frame, int by) {
        const Picture small = rhi::must(
            renderer->render(frame, {.width = kWidth / by, .height = kHeight / by, .ao = AmbientOcclusion::Off}));
        image::Rgb out;
        out.width = kWidth, out.height = kHeight;
        for (int y = 0; y < kHeight; ++y)
            for (int x = 0; x < kWidth; ++x)
                for (size_t k = 0; k < 3; ++k)
                    out.values.push_back(float(small.srgb[size_t((y / by * (kWidth / by) + x / by) * 4) + k]) / 255);
        return out;
    }
};

TEST_F(UpscaleGpu, AQuarterOfTheRaysComesNearSixtyFourAPixel) {
    const Frame frame = unlit();
    const image::Rgb truth = rgb(supersampled(frame));
    Picture p;
    const RenderSettings half{.taa = true, .scale = 0.5f};
    for (int i = 0; i < 32; ++i) p = picture(frame, half);
    EXPECT_EQ(p.width, kWidth);
    EXPECT_EQ(p.rgba.size(), size_t(kWidth * kHeight * 4));
    EXPECT_EQ(renderer->stats().rays_across, kWidth / 2);
    EXPECT_EQ(renderer->stats().rays_down, kHeight / 2);
    const double after_32 = image::flip(truth, rgb(p)), of_blocks = image::flip(truth, blocks(frame, 2));
    const double of_one = image::flip(truth, rgb(picture(frame, {})));  // ray a pixel
    RecordProperty("flip", std::to_string(after_32));
    RecordProperty("flip_of_blocks", std::to_string(of_blocks));
    RecordProperty("flip_of_one_ray", std::to_string(of_one));
    EXPECT_LE(after_32, 0.012);
    EXPECT_LT(after_32, 0.4 * of_blocks);
    EXPECT_LT(after_32, of_one);
    const RenderSettings most{.taa = true, .scale = 0.77f};
    for (int i = 0; i < 27; ++i) p = picture(frame, most);
    EXPECT_LE(image::flip(truth, rgb(p)), 0.012);
}

TEST_F(UpscaleGpu, AMovingCameraIsNearlyAsSharpAsWithAllRays) {
    Frame frame = unlit();
    Picture p;
    const Camera last = frame.camera;
    for (int i = 23; i >= 0; --i) {
        frame.camera.position = last.position + vec3{0.013f, 0.004f, -0.011f} * float(i);
        p = picture(frame, {.taa = true, .scale = 0.5f});
    }
    const image::Rgb truth = rgb(supersampled(frame));
    const double moving = image::flip(truth, rgb(p)), of_blocks = image::flip(truth, blocks(frame, 2));
    for (int i = 23; i >= 0; --i) {
        frame.camera.position = last.position + vec3{0.013f, 0.004f, -0.011f} * float(i);
        p = picture(frame, {.taa = true, .cut = i == 23});
    }
    const double of_all_rays = image::flip(truth, rgb(p));
    RecordProperty("flip", std::to_string(moving));
    RecordProperty("flip_of_all_rays", std::to_string(of_all_rays));
    EXPECT_LT(moving, of_blocks);
    EXPECT_LT(moving, 1.3 * of_all_rays);
}

// Gate: gone within three pictures.
TEST_F(UpscaleGpu, NothingOfWhatWentAwayStays) {
    const auto ball_at = [&](vec3 at) {
        Frame out = unlit();
        field::worlds::World world = on_ground();
        Edit ball = field::worlds::edit(Sphere{.radius = 0.25f}, at);
        ball.node.material = MaterialId{1, 0};
        world.edits.push_back(ball);
        world.options.bounds = {{-1.5f, -1, -1.5f}, {1.5f, 1.5f, 1.5f}};
        out.field = world.field();
        return out;
    };
    const Frame before = ball_at({0.7f, 0.4f, 0.8f}), after = ball_at({-0.1f, 0.5f, 1.0f});
    const RenderSettings half{.taa = true, .scale = 0.5f};
    for (int i = 0; i < 20; ++i) (void)picture(before, half);
    const Picture was = picture(before, {}), truth = picture(after, {});
    for (int i = 0; i < 20; ++i) (void)picture(before, half);
    Picture p;
    for (int i = 0; i < 3; ++i) p = picture(after, half);
    // Where the surface is another, away from its edges, radiance is what it would be, but for what edges of larger pixels blur.
    int looked = 0, ghosts = 0;
    for (int y = 2; y < kHeight - 2; ++y) {
        for (int x = 2; x < kWidth - 2; ++x) {
            bool other = true;
            float low = 1e9f, high = 0;
            for (int k = 0; k < 25; ++k) {
                const size_t i = size_t((y + k / 5 - 2) * kWidth + x + k % 5 - 2);
                other = other && std::fabs(was.depth[i] - truth.depth[i]) > 0.02f * truth.depth[i];
                low = std::min(low, truth.rgba[4 * i]);
                high = std::max(high, truth.rgba[4 * i]);
            }
            if (!other) continue;
            const float got = p.rgba[size_t(y * kWidth + x) * 4];
            ++looked;
            ghosts += got < low - 0.05f * high || got > 1.05f * high;
        }
    }
    EXPECT_GT(looked, 150);
    EXPECT_EQ(ghosts, 0);
}

TEST_F(UpscaleGpu, ScaleOneIsNoScaleAndAStrangeOneIsRefused) {
    const Frame frame = unlit();
    std::vector<Picture> with, without;
    for (int i = 0; i < 3; ++i) without.push_back(picture(frame, {.taa = true, .cut = i == 0}));
    for (int i = 0; i < 3; ++i) with.push_back(picture(frame, {.taa = true, .cut = i == 0, .scale = 1}));
    for (size_t i = 0; i < 3; ++i) EXPECT_EQ(with[i].rgba, without[i].rgba);
    const auto refused = [&](RenderSettings s) {
        s.width = s.height = 8;
        const auto p = renderer->render(frame, s);
        return !p && p.error().kind == ErrorKind::Usage && p.error().message.find("scale") == 0;
    };
    EXPECT_TRUE(refused({.taa = true, .scale = 0.1f}));
    EXPECT_TRUE(refused({.taa = true, .scale = 1.5f}));
    EXPECT_TRUE(refused({.taa = true, .scale = NAN}));
    EXPECT_TRUE(refused({.scale = 0.5f}));
    EXPECT_TRUE(refused({.view = View::Depth, .taa = true, .scale = 0.5f}));
    EXPECT_TRUE(refused({.taa = true, .outline_hulls = true, .scale = 0.5f}));
}

// What follows the upscaling has the size that is shown: lines, outlines and bloom, and the distances that the picture tells.
TEST_F(UpscaleGpu, LinesAndOutlinesAreDrawnAtTheSizeThatIsShown) {
    Frame frame = unlit();
    frame.camera.bloom = 0.1f;
    frame.lines = {{.a = {-0.8, 0.9, 0.2}, .b = {0.9, 0.7, 0.2}, .color = {1, 0, 0}, .width_px = 1.5f, .hidden = 0}};
    frame.outlines = {{.row = frame.field->program().rows()[1], .outline = {.color = {0, 1, 0}, .width_px = 3}}};
    Picture whole, p;
    for (int i = 0; i < 16; ++i) whole = picture(frame, {.taa = true});
    for (int i = 0; i < 32; ++i) p = picture(frame, {.taa = true, .scale = 0.5f});
    int red[2] = {}, green[2] = {};
    for (size_t i = 0; i < p.depth.size(); ++i) {
        for (const int k : {0, 1}) {
            const uint8_t* c = &(k == 0 ? whole : p).srgb[4 * i];
            red[k] += c[0] > 150 && c[1] < 90 && c[2] < 90;
            green[k] += c[1] > 150 && c[0] < 110 && c[2] < 110;
        }
    }
    EXPECT_GT(red[0], 20);
    EXPECT_NEAR(red[1], red[0], 0.1 * red[0]);
    EXPECT_GT(green[0], 60);
    EXPECT_NEAR(green[1], green[0], 0.25 * green[0]);
    // Distances are those of the rays.
    const Picture fewer =
        rhi::must(renderer->render(frame, {.width = kWidth / 2, .height = kHeight / 2, .ao = AmbientOcclusion::Off}));
    p = picture(frame, {.taa = true, .taa_jitter = false, .scale = 0.5f});
    for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < kWidth; ++x)
            EXPECT_EQ(p.depth[size_t(y * kWidth + x)], fewer.depth[size_t(y / 2 * (kWidth / 2) + x / 2)]);
}

}  // namespace
}  // namespace kiln::render
