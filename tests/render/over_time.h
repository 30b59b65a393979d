// SPDX-License-Identifier: MIT
// What tests of pictures over time share: small ones of a scene on the ground, and the same looked at with many rays a pixel.
#pragma once

#include "gpu_worlds.h"
#include "image/metrics.h"
#include "render/lib/color.gpu.h"

#include <algorithm>
#include <cmath>
#include <memory>

namespace kiln::render {

inline constexpr int kWidth = 96, kHeight = 72;

class PicturesOverTime : public testing::Test {
protected:
    void SetUp() override {
        renderer = renderer_or_skip();
        if (!renderer && !HasFailure()) GTEST_SKIP() << "no Vulkan device";
    }
    Picture picture(const Frame& frame, RenderSettings settings) {
        settings.ao = AmbientOcclusion::Off;  // a mean over four pixels: in a finer picture it is a finer one
        settings.width = kWidth;
        settings.height = kHeight;
        return rhi::must(renderer->render(frame, settings));
    }
    static Frame scene() {
        Frame frame = frame_of(on_ground());
        frame.camera.target.y = 0.4f;
        frame.camera.up = {0.15f, 1, 0};  // a horizon along a row of pixels would weigh as much as all else
        frame.camera.tone_map = ToneMap::None;
        frame.lights[0].illuminance = 2;
        return frame;
    }
    // Shadows begin a part of a pixel off the surface, so they are a little other ones in a finer picture: the sky alone.
    static Frame unlit() {
        Frame frame = scene();
        frame.lights.clear();
        return frame;
    }
    // 64 rays a pixel, their light's mean.
    Picture supersampled(const Frame& frame) {
        constexpr int kSide = 8;
        const Picture large = rhi::must(
            renderer->render(frame, {.width = kWidth * kSide, .height = kHeight * kSide, .ao = AmbientOcclusion::Off}));
        Picture out;
        out.width = kWidth, out.height = kHeight;
        for (int y = 0; y < kHeight; ++y) {
            for (int x = 0; x < kWidth; ++x) {
                for (size_t k = 0; k < 4; ++k) {
                    double sum = 0;
                    for (int j = 0; j < kSide; ++j)
                        for (int i = 0; i < kSide; ++i)
                            sum +=
                                double(large.rgba[size_t(((y * kSide + j) * kWidth * kSide + x * kSide + i) * 4) + k]);
                    out.rgba.push_back(float(sum / (kSide * kSide)));
                }
            }
        }
        for (size_t i = 0; i < out.rgba.size(); ++i) {
            const float v = i % 4 == 3 ? 1.0f : std::clamp(out.rgba[i], 0.0f, 1.0f);
            out.srgb.push_back(uint8_t(std::lround(255 * (i % 4 == 3 ? v : shade::srgb_from_linear(v)))));
        }
        return out;
    }
    static image::Rgb rgb(const Picture& p) {
        image::Rgb out;
        out.width = p.width, out.height = p.height;
        for (size_t i = 0; i < p.srgb.size(); ++i)
            if (i % 4 != 3) out.values.push_back(float(p.srgb[i]) / 255);
        return out;
    }
    std::unique_ptr<Renderer> renderer;
};

}  // namespace kiln::render
