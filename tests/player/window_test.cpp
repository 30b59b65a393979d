// SPDX-License-Identifier: MIT
// Pictures in a real window, on a display without a screen, with the driver's validation on.
#include "player/virtual_display.h"
#include "player/window.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>

namespace kiln::player {
namespace {

Picture plain(int width, int height, std::array<uint8_t, 3> rgb) {
    Picture out;
    out.width = width;
    out.height = height;
    for (int i = 0; i < width * height; ++i)
        for (const uint8_t c : {rgb[0], rgb[1], rgb[2], uint8_t{255}}) out.srgb.push_back(c);
    return out;
}

class WindowGpu : public testing::Test {
protected:
    void open(int width, int height) {
        auto window = Window::open("test", width, height);
        ASSERT_TRUE(window) << window.error().message;
        window_ = std::move(*window);
        auto renderer = Renderer::create({.device = "cpu-vulkan", .validation = true, .window = window_->surface()});
        ASSERT_TRUE(renderer) << renderer.error().message;
        renderer_.emplace(std::move(*renderer));
    }
    Shown show(const Picture& picture, bool wait = true) {
        auto shown = renderer_->show(picture, window_->width(), window_->height(), wait);
        EXPECT_TRUE(shown) << (shown ? "" : shown.error().message);
        return shown ? *shown : Shown::Later;
    }
    // The server draws when it gets to it: shows the picture until so many of its pixels are on the screen.
    bool seen(const Picture& picture, std::array<uint8_t, 3> rgb, int pixels) {
        for (int i = 0; i < 500; ++i) {
            (void)window_->poll();
            (void)show(picture);
            const auto screen = display_.screen();
            if (std::count(screen.rgb.begin(), screen.rgb.end(), rgb) == pixels) return true;
            window_->wait(0.01);
        }
        return false;
    }

    VirtualDisplay display_;
    std::unique_ptr<Window> window_;
    std::optional<Renderer> renderer_;
};

TEST_F(WindowGpu, TheScreenHasThePicturesPixels) {
    open(64, 48);
    for (const std::array<uint8_t, 3> rgb : {std::array<uint8_t, 3>{200, 40, 10}, {10, 90, 230}, {1, 2, 3}})
        EXPECT_TRUE(seen(plain(64, 48, rgb), rgb, 64 * 48));
}

TEST_F(WindowGpu, AWindowOfAnotherSizeIsFilledAgainAndAgain) {
    open(64, 48);
    const std::array<uint8_t, 3> rgb{20, 160, 60};
    const std::pair<int, int> sizes[] = {{96, 80}, {33, 77}, {200, 10}, {64, 48}};
    for (const auto& [w, h] : sizes) {
        window_->resize(w, h);
        EXPECT_TRUE(seen(plain(8, 8, rgb), rgb, w * h)) << w << " x " << h;
    }
}

TEST_F(WindowGpu, AHiddenWindowShowsNothingAndComesBack) {
    open(64, 48);
    const std::array<uint8_t, 3> rgb{20, 160, 60};
    EXPECT_TRUE(seen(plain(8, 8, rgb), rgb, 64 * 48));
    window_->resize(0, 0);
    EXPECT_EQ(window_->width(), 0);
    EXPECT_EQ(show(plain(8, 8, rgb)), Shown::Hidden);
    window_->resize(64, 48);
    EXPECT_TRUE(seen(plain(8, 8, {9, 9, 9}), {9, 9, 9}, 64 * 48));
}

TEST_F(WindowGpu, PicturesThatDoNotWaitForTheScreenAreShownToo) {
    open(64, 48);
    for (int i = 0; i < 20; ++i) (void)show(plain(4, 4, {uint8_t(i), 0, 0}), i % 2 == 0);  // from one way to the other
    EXPECT_TRUE(seen(plain(4, 4, {77, 0, 0}), {77, 0, 0}, 64 * 48));
}

TEST_F(WindowGpu, ASecondWindowComesAfterTheFirst) {
    for (int i = 0; i < 2; ++i) {
        open(32, 32);
        EXPECT_TRUE(seen(plain(4, 4, {0, uint8_t(50 + i), 0}), {0, uint8_t(50 + i), 0}, 32 * 32));
        renderer_.reset();
        window_.reset();
    }
}

TEST(Window, GpuWithoutADisplayThereIsNone) {
    for (const char* name : {"DISPLAY", "WAYLAND_DISPLAY", "SDL_VIDEODRIVER"}) ::unsetenv(name);
    EXPECT_FALSE(Window::has_display());
    ::setenv("DISPLAY", ":0", 1);
    EXPECT_TRUE(Window::has_display());
    for (const char* driver : {"dummy", "offscreen"}) {
        ::setenv("SDL_VIDEODRIVER", driver, 1);
        EXPECT_FALSE(Window::has_display()) << driver;
    }
    ::setenv("SDL_VIDEODRIVER", "x11", 1);
    ::setenv("DISPLAY", ":32123", 1);
    const auto window = Window::open("test", 8, 8);
    ASSERT_FALSE(window);
    EXPECT_EQ(window.error().kind, ErrorKind::NoDevice);
    EXPECT_NE(window.error().message.find("no display can be opened"), std::string::npos) << window.error().message;
}

TEST(Stretched, ASizeOfItsOwnChangesNothing) {
    Picture p = plain(3, 2, {10, 20, 30});
    for (size_t i = 0; i < p.srgb.size(); ++i) p.srgb[i] = uint8_t(11 * i);
    EXPECT_EQ(p.stretched(3, 2).srgb, p.srgb);
}

TEST(Stretched, BlendsBetweenNeighboursAndNeverBeyondThem) {
    Picture p = plain(2, 1, {0, 0, 0});
    p.srgb = {0, 100, 8, 255, 200, 100, 0, 255};
    const Picture wide = p.stretched(8, 3);
    ASSERT_EQ(wide.srgb.size(), 8u * 3 * 4);
    int before = -1;
    for (size_t x = 0; x < 8; ++x) {
        const int red = wide.srgb[4 * x], expected = int(std::clamp((double(x) + 0.5) / 4 - 0.5, 0.0, 1.0) * 200 + 0.5);
        EXPECT_NEAR(red, expected, 1) << x;
        EXPECT_GE(red, before);
        EXPECT_EQ(wide.srgb[4 * x + 1], 100) << x;
        before = red;
    }
    EXPECT_EQ(p.stretched(1, 1).srgb[0], 100);
}

}  // namespace
}  // namespace kiln::player
