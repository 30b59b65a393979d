// SPDX-License-Identifier: MIT
#include "render/light_rects.h"

#include "render/passes/frame.gpu.h"
#include "render/passes/cluster.gpu.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace kiln::render {

namespace {

struct Span {
    double low, high;
};

// Slopes across / ahead of the rays from the eye that meet a disc of radius r at (across, ahead) in front of it.
Span slopes(double across, double ahead, double r) {
    constexpr double kEverywhere = 1e9;
    const double far = std::hypot(across, ahead);
    if (far <= r) return {-kEverywhere, kEverywhere};
    const double middle = std::atan2(across, ahead), half = std::asin(r / far);
    constexpr double kSide = std::numbers::pi / 2;
    const double low = middle - half, high = middle + half;
    // From behind a disc may be seen past either side.
    const bool left = low<-kSide, right = high> kSide;
    if (left && right) return {-kEverywhere, kEverywhere};
    if (high <= -kSide || low >= kSide) return {1, -1};
    return {left ? -kEverywhere : std::tan(low), right ? kEverywhere : std::tan(high)};
}

// Tiles whose pixels lie in the slopes, with a pixel to spare; `scale` pixels a unit of slope, `middle` the pixel of slope 0.
uint32_t tiles_of(Span s, double scale, double middle, int first_pixel, int pixels) {
    if (s.low > s.high) return 0;
    const auto tile = [&](double at) {
        const double inside = std::clamp(at - first_pixel, 0.0, double(pixels));
        return uint32_t(inside) / uint32_t(kClusterSide);
    };
    const double low = middle + s.low * scale - 1, high = middle + s.high * scale + 1;
    if (high < first_pixel || low > first_pixel + pixels) return 0;
    const uint32_t end = uint32_t((pixels + kClusterSide - 1) / kClusterSide);
    return std::min(tile(low), end - 1) | std::min(tile(high) + 1, end) << 16;
}

}  // namespace

LightRects light_rects(std::span<const Light> lights, const shade::CameraParams& camera, int left, int top, int width,
                       int height) {
    LightRects out = all_light_rects(lights.size(), width, height);
    const vec3 eye{camera.eye.x, camera.eye.y, camera.eye.z};
    const vec3 right{camera.right.x, camera.right.y, camera.right.z}, up{camera.up.x, camera.up.y, camera.up.z};
    const vec3 forward{camera.forward.x, camera.forward.y, camera.forward.z};
    const double half_width = double(length(right)), half_height = double(length(up));
    const double all_x = 1.0 / double(camera.right.w), all_y = 1.0 / double(camera.up.w);  // pixels
    const int across = (width + kClusterSide - 1) / kClusterSide, down = (height + kClusterSide - 1) / kClusterSide;
    // Lights that begin at a tile, less those that end before it, in both directions; summed up below.
    std::vector<int32_t> change(size_t(across + 1) * size_t(down + 1));
    const auto at = [&](uint32_t x, uint32_t y) -> int32_t& { return change[y * size_t(across + 1) + x]; };
    for (size_t i = 0; i < lights.size(); ++i) {
        const Light& light = lights[i];
        LightRect& rect = out.rects[i];
        if (light.kind != Light::Kind::Directional && light.range > 0) {
            out.local = true;
            const vec3 to = light.position - eye;
            const double x = double(dot(to, right)) / half_width, y = double(dot(to, up)) / half_height;
            const double ahead = double(dot(to, forward));
            const double r = 1.0001 * double(light.range) + 1e-6 * (std::fabs(x) + std::fabs(y) + std::fabs(ahead));
            const Span sideways = slopes(x, ahead, r), upward = slopes(y, ahead, r);
            rect.x = tiles_of(sideways, 0.5 * all_x / half_width, 0.5 * all_x, left, width);
            rect.y = tiles_of({-upward.high, -upward.low}, 0.5 * all_y / half_height, 0.5 * all_y, top, height);
        }
        if (rect.x == 0 || rect.y == 0) {
            rect = {};
            continue;
        }
        const uint32_t x0 = rect.x & 0xffffu, x1 = rect.x >> 16, y0 = rect.y & 0xffffu, y1 = rect.y >> 16;
        ++at(x0, y0), --at(x1, y0), --at(x0, y1), ++at(x1, y1);
    }
    int32_t most = 0;
    for (uint32_t y = 0; y < uint32_t(down); ++y) {
        for (uint32_t x = 0; x < uint32_t(across); ++x) {
            at(x, y) +=
                (x > 0 ? at(x - 1, y) : 0) + (y > 0 ? at(x, y - 1) : 0) - (x > 0 && y > 0 ? at(x - 1, y - 1) : 0);
            most = std::max(most, at(x, y));
        }
    }
    out.most = uint32_t(most);
    return out;
}

LightRects all_light_rects(size_t lights, int width, int height) {
    const auto end = [](int pixels) { return uint32_t((pixels + kClusterSide - 1) / kClusterSide) << 16; };
    return {std::vector<LightRect>(lights, LightRect{end(width), end(height)}), uint32_t(lights), false};
}

}  // namespace kiln::render
