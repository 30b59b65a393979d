// SPDX-License-Identifier: MIT
// Debug lines: shares of pixels against exact distances to the projected segments, before and behind things and the eye.
#include "gpu_worlds.h"
#include "render/lib/color.gpu.h"
#include "render/lib/pack.h"

#include <cmath>

namespace kiln::render {
namespace {

constexpr int kLinesWidth = 96, kLinesHeight = 72;

struct LinesGpu : testing::Test {
    void SetUp() override {
        renderer = renderer_or_skip();
        if (!renderer && !HasFailure()) GTEST_SKIP() << "no Vulkan device";
        // A ball in the dark.
        field::worlds::World world{"ball",
                                   {field::worlds::edit(Sphere{0.5f})},
                                   {.voxel_size = 0.05f, .bounds = {{-0.7f, -0.7f, -0.7f}, {0.7f, 0.7f, 0.7f}}}};
        frame.field = world.field();
        frame.materials.resize(1);
        frame.materials[0].base_color = {0, 0, 0};
        frame.environment = Environment{.color = {0, 0, 0}};
        frame.camera.position = {0.3f, 0.2f, 4};
        frame.camera.tone_map = ToneMap::None;
    }
    // What lines cover of each pixel, as linear light.
    std::vector<float> drawn() {
        const Picture p = rhi::must(renderer->render(frame, {.width = kLinesWidth, .height = kLinesHeight}));
        std::vector<float> out;
        for (size_t i = 0; i < p.srgb.size(); i += 4) out.push_back(shade::linear_from_srgb(float(p.srgb[i]) / 255));
        return out;
    }
    struct Point {
        double x, y;
    };
    // In pixels; the point is before the eye.
    Point seen(dvec3 p) const {
        const shade::CameraParams c = shade::camera_params(frame.camera, kLinesWidth, kLinesHeight);
        const double d[3] = {p.x - double(c.eye.x), p.y - double(c.eye.y), p.z - double(c.eye.z)};
        const auto along = [&](const vec4& v) {
            return (d[0] * v.x + d[1] * v.y + d[2] * v.z) / (double(v.x) * v.x + double(v.y) * v.y + double(v.z) * v.z);
        };
        const double ahead = along(c.forward);
        return {(along(c.right) / ahead + 1) * kLinesWidth / 2, (1 - along(c.up) / ahead) * kLinesHeight / 2};
    }
    static double share(Point pixel, Point a, Point b, double width) {
        const double x = b.x - a.x, y = b.y - a.y, square = x * x + y * y;
        const double at = square > 0 ? std::clamp(((pixel.x - a.x) * x + (pixel.y - a.y) * y) / square, 0.0, 1.0) : 0;
        const double away = std::hypot(pixel.x - a.x - at * x, pixel.y - a.y - at * y);
        return std::clamp(std::min(away + 0.5, width / 2) - std::max(away - 0.5, -width / 2), 0.0, 1.0);
    }
    // `b_seen`: where the line ends on the screen, if not at b.
    void expect_line(const DebugLine& line, Point a, Point b) {
        frame.lines = {line};
        const std::vector<float> got = drawn();
        double sum = 0;
        for (int y = 0; y < kLinesHeight; ++y) {
            for (int x = 0; x < kLinesWidth; ++x) {
                const double wanted = share({x + 0.5, y + 0.5}, a, b, double(line.width_px));
                // Eight bits of sRGB.
                EXPECT_NEAR(double(got[size_t(y * kLinesWidth + x)]), wanted, 0.008) << x << ", " << y;
                sum += wanted;
            }
        }
        EXPECT_GT(sum, 5);
    }
    std::unique_ptr<Renderer> renderer;
    Frame frame;
};

TEST_F(LinesGpu, CoverTheirShareOfEachPixelAtAnyWidthAndSlope) {
    for (const float width : {0.4f, 1.0f, 1.5f, 5.0f}) {
        const DebugLine line{.a = {-1.2, -0.9, 1}, .b = {1.3, 0.35, 1.5}, .width_px = width};
        expect_line(line, seen(line.a), seen(line.b));
    }
    const DebugLine dot{.a = {1, 1, 0}, .b = {1, 1, 0}, .width_px = 6};
    expect_line(dot, seen(dot.a), seen(dot.b));
}

TEST_F(LinesGpu, ThatBeginBehindTheEyeOrFarOutsideAreDrawnWhereTheyAreSeen) {
    // From behind the eye: towards the side that it comes from, as far as one can see.
    const DebugLine behind{.a = {4, 3, 9}, .b = {0.9, 0.8, 0}, .width_px = 2};
    dvec3 at = behind.b;
    const vec4 forward = shade::camera_params(frame.camera, kLinesWidth, kLinesHeight).forward;
    const auto ahead = [&](dvec3 p) {
        return (p.x - double(frame.camera.position.x)) * double(forward.x) +
               (p.y - double(frame.camera.position.y)) * double(forward.y) +
               (p.z - double(frame.camera.position.z)) * double(forward.z);
    };
    const double s = (ahead(at) - 1e-3) / (ahead(at) - ahead(behind.a));
    at = {at.x + s * (behind.a.x - at.x), at.y + s * (behind.a.y - at.y), at.z + s * (behind.a.z - at.z)};
    expect_line(behind, seen(at), seen(behind.b));
    const DebugLine far_out{.a = {-4e5, 1e5, -3e5}, .b = {4e5, -1.001e5, -3e5}, .width_px = 3, .hidden = 1};
    expect_line(far_out, seen(far_out.a), seen(far_out.b));
    // Not at all: behind the eye; not a number.
    frame.lines = {{.a = {0, 0, 9}, .b = {1, 1, 5}}, {.a = {0, std::nan(""), 0}, .b = {1, 1, 1}}};
    for (const float share : drawn()) EXPECT_EQ(share, 0.0f);
}

TEST_F(LinesGpu, BehindThingsShowTheShareTheyAskFor) {
    frame.camera.position = {0, 0, 4};
    const size_t middle = size_t(kLinesHeight / 2 * kLinesWidth + kLinesWidth / 2), beside = middle + 25;
    const auto at = [&](double z, float hidden) {
        frame.lines = {{.a = {-3, 0, z}, .b = {3, 0, z}, .width_px = 4, .hidden = hidden}};
        return drawn();
    };
    for (const float hidden : {0.0f, 0.25f, 1.0f}) {
        const std::vector<float> behind = at(-1, hidden);
        EXPECT_NEAR(behind[middle], hidden, 0.01f);
        EXPECT_NEAR(behind[beside], 1.0f, 1e-6f);
    }
    EXPECT_NEAR(at(0.6, 0)[middle], 1.0f, 1e-6f);
    EXPECT_NEAR(at(0.4, 0)[middle], 0.0f, 1e-6f);
    EXPECT_NEAR(at(0.5, 0)[middle], 1.0f, 1e-6f) << "on the surface";
}

TEST_F(LinesGpu, LaterOnesLieOverEarlierOnes) {
    const DebugLine white{.a = {-3, 0.2, 1}, .b = {3, 0.2, 1}, .width_px = 8};
    DebugLine black = white;
    black.color = {0, 0, 0};
    frame.lines = {white, black};
    float brightest = 0;
    for (const float share : drawn()) brightest = std::max(brightest, share);
    EXPECT_LT(brightest, 0.26f) << "only where both cover half a pixel";
    frame.lines = {black, white};
    for (const float share : drawn()) brightest = std::max(brightest, share);
    EXPECT_EQ(brightest, 1.0f);
}

}  // namespace
}  // namespace kiln::render
