// SPDX-License-Identifier: MIT
// The bundled scenes from bricks against the same scenes from the exact program.

#include <kiln/world.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numbers>
#include <optional>
#include <string_view>

namespace kiln {
namespace {

// Depths of two pictures of one view.
struct Pair {
    const Picture& cached;
    const Picture& exact;

    double voxel;        // metres
    double pixel_angle;  // of a pixel's height, radians

    double at(const Picture& p, int x, int y) const { return double(p.depth[size_t(y * p.width + x)]); }
    // Do three pixels in a row, in either picture, lie on surfaces that do not go on into each other: a silhouette, a step of 2 % of the
    // distance, or one of two voxels and a pixel that the slope of neither side explains (a ledge)?
    bool breaks(const Picture& p, int x, int y, int dx, int dy) const {
        const double before = at(p, x - dx, y - dy), here = at(p, x, y), after = at(p, x + dx, y + dy);
        const double farthest = std::max({before, here, after}), nearest = std::min({before, here, after});
        return std::isinf(farthest) || farthest - nearest > 0.02 * nearest ||
               std::fabs(before - 2 * here + after) > 2 * voxel + here * pixel_angle;
    }
    // Is there an edge of depth within two pixels?
    bool at_edge(int x, int y) const {
        for (int j = std::max(y - 2, 0); j <= std::min(y + 2, cached.height - 1); ++j) {
            for (int i = std::max(x - 2, 0); i <= std::min(x + 2, cached.width - 1); ++i) {
                for (const Picture* p : {&cached, &exact}) {
                    if (i > 0 && i + 1 < p->width && breaks(*p, i, j, 1, 0)) return true;
                    if (j > 0 && j + 1 < p->height && breaks(*p, i, j, 0, 1)) return true;
                }
            }
        }
        return false;
    }
};

// None: the test is skipped, or has failed where a device is required.
std::optional<Renderer> renderer_or_skip() {
    auto made = Renderer::create({.validation = true});
    if (made) return std::move(*made);
    const char* required = std::getenv("REQUIRE_VULKAN");
    [&] {
        ASSERT_FALSE(required != nullptr && std::string_view(required) == "1") << made.error().message;
        GTEST_SKIP() << made.error().message;
    }();
    return {};
}

TEST(PicturesGpu, BricksShowWhatTheProgramSaysInEveryScene) {
    auto renderer = renderer_or_skip();
    if (!renderer) return;
    for (const auto& [name, what] : bundled_scenes()) {
        const auto world = World::load(name);
        ASSERT_TRUE(world) << world.error().message;
        if (world->field_settings.levels > 1) continue;  // not drawn analytically; see render/levels_test.cpp
        const auto frame = world->frame();
        ASSERT_TRUE(frame) << frame.error().message;
        RenderSettings settings{.width = 192, .height = 108, .view = View::Depth};
        const auto cached = renderer->render(*frame, settings);
        settings.analytic = true;
        const auto exact = renderer->render(*frame, settings);
        ASSERT_TRUE(cached && exact) << name;

        const double voxel = double(world->field_settings.voxel_size);
        const double pixel_angle =
            2 * std::tan(double(frame->camera.fov_y_deg) * std::numbers::pi / 360) / settings.height;
        const Pair pair{*cached, *exact, voxel, pixel_angle};
        int differ = 0, differ_inside = 0, judged = 0, off = 0;
        for (int y = 0; y < settings.height; ++y) {
            for (int x = 0; x < settings.width; ++x) {
                const float a = cached->depth[size_t(y * settings.width + x)];
                const float b = exact->depth[size_t(y * settings.width + x)];
                const bool edge = pair.at_edge(x, y);
                if (std::isinf(a) != std::isinf(b)) {
                    ++differ;
                    differ_inside += !edge;
                } else if (!std::isinf(a) && !edge) {
                    ++judged;
                    off += std::fabs(double(a) - double(b)) > 0.25 * voxel;
                }
            }
        }
        RecordProperty(name + " off by more than a quarter voxel, of " + std::to_string(judged), off);
        EXPECT_LE(differ, settings.width * settings.height / 1000) << name;
        EXPECT_EQ(differ_inside, 0) << name;
        EXPECT_GT(judged, 500) << name;
        // What is left: ledges lower than that, which the quarry has everywhere, and tangent rays. At four times the pixels 6 of 84,000.
        EXPECT_LE(off, judged / 2000) << name << " of " << judged;
    }
}

// The gate of the graph: what lives at one time is at most six tenths of all images and buffers of a picture.
TEST(PicturesSlowGpu, EverySceneSharesItsTransientsAtEveryQuality) {
    auto renderer = renderer_or_skip();
    if (!renderer) return;
    for (const auto& [name, what] : bundled_scenes()) {
        const auto world = World::load(name);
        ASSERT_TRUE(world) << world.error().message;
        const auto frame = world->frame();
        ASSERT_TRUE(frame) << frame.error().message;
        for (const Quality q : {Quality::Low, Quality::Medium, Quality::High, Quality::Ultra}) {
            RenderSettings settings{.width = 480, .height = 270, .cut = true};
            set_quality(settings, q);
            ASSERT_TRUE(renderer->render(*frame, settings)) << name;
            const RenderStats& s = renderer->stats();
            EXPECT_GT(s.transient_peak_bytes, 0u);
            EXPECT_LE(double(s.transient_peak_bytes), 0.6 * double(s.transient_sum_bytes)) << name << " at " << int(q);
        }
    }
}

}  // namespace
}  // namespace kiln
