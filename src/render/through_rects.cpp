// SPDX-License-Identifier: MIT
#include "render/through_rects.h"

#include <algorithm>
#include <cmath>

namespace kiln::render {

std::vector<PixelRect> through_rects(std::span<const Box3> boxes, const shade::CameraParams& camera,
                                     const PixelRect& tile, int most) {
    const vec3 forward{camera.forward.x, camera.forward.y, camera.forward.z};
    float x0 = INFINITY, y0 = INFINITY, x1 = -INFINITY, y1 = -INFINITY;
    for (const Box3& box : boxes) {
        float low_x = INFINITY, low_y = INFINITY, high_x = -INFINITY, high_y = -INFINITY;
        bool before = false, behind = false;
        for (int corner = 0; corner < 8; ++corner) {
            const vec3 p{(corner & 1) != 0 ? box.max.x : box.min.x, (corner & 2) != 0 ? box.max.y : box.min.y,
                         (corner & 4) != 0 ? box.max.z : box.min.z};
            const float ahead = dot(p, forward);
            // As near as this to the plane of the eye, corners are anywhere on the screen.
            (ahead > 1e-3f * length(p) ? before : behind) = true;
            if (behind) continue;
            const vec2 at = shade::camera_pixel(camera, p);
            low_x = std::min(low_x, at.x), high_x = std::max(high_x, at.x);
            low_y = std::min(low_y, at.y), high_y = std::max(high_y, at.y);
        }
        if (!before) continue;
        if (behind) low_x = low_y = -INFINITY, high_x = high_y = INFINITY;
        x0 = std::min(x0, low_x), x1 = std::max(x1, high_x);
        y0 = std::min(y0, low_y), y1 = std::max(y1, high_y);
    }
    // A pixel more on every side, for rounding.
    const auto cut = [](float v, int first, int last) {
        return int(std::clamp(double(v), double(first), double(last)));
    };
    const int left = cut(std::floor(x0) - 1, tile.x, tile.x + tile.width),
              right_end = cut(std::ceil(x1) + 1, tile.x, tile.x + tile.width),
              top = cut(std::floor(y0) - 1, tile.y, tile.y + tile.height),
              bottom = cut(std::ceil(y1) + 1, tile.y, tile.y + tile.height);
    std::vector<PixelRect> out;
    if (left >= right_end || top >= bottom) return out;
    const int width = right_end - left, rows = std::max(most / width, 1);
    for (int y = top; y < bottom; y += rows) out.push_back({left, y, width, std::min(rows, bottom - y)});
    return out;
}

}  // namespace kiln::render
