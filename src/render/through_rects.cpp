// SPDX-License-Identifier: MIT
#include "render/through_rects.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <tuple>
#include <utility>

namespace kiln::render {

namespace {

constexpr size_t kMostApart = 6;  // as many pictures as this would cost more than the pixels between them

// Ends are exclusive.
struct Area {
    int x0, y0, x1, y1;
    bool empty() const { return x0 >= x1 || y0 >= y1; }
    int64_t pixels() const { return int64_t{x1 - x0} * (y1 - y0); }
};

Area both(const Area& a, const Area& b) {
    return {std::min(a.x0, b.x0), std::min(a.y0, b.y0), std::max(a.x1, b.x1), std::max(a.y1, b.y1)};
}

bool overlap(const Area& a, const Area& b) { return a.x0 < b.x1 && b.x0 < a.x1 && a.y0 < b.y1 && b.y0 < a.y1; }

// Where the camera sees the box within the tile.
Area area_of(const Box3& box, const shade::CameraParams& camera, const PixelRect& tile) {
    const vec3 forward{camera.forward.x, camera.forward.y, camera.forward.z};
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
    if (!before) return {0, 0, 0, 0};
    if (behind) low_x = low_y = -INFINITY, high_x = high_y = INFINITY;
    // A pixel more on every side, for rounding.
    const auto cut = [](float v, int first, int last) {
        return int(std::clamp(double(v), double(first), double(last)));
    };
    const int right = tile.x + tile.width, bottom = tile.y + tile.height;
    return {cut(std::floor(low_x) - 1, tile.x, right), cut(std::floor(low_y) - 1, tile.y, bottom),
            cut(std::ceil(high_x) + 1, tile.x, right), cut(std::ceil(high_y) + 1, tile.y, bottom)};
}

// Whether one rectangle round two costs no more than the two: they share pixels, or it has hardly any that neither has.
bool together(const Area& a, const Area& b, int64_t apart) {
    return overlap(a, b) || both(a, b).pixels() < a.pixels() + b.pixels() + apart;
}

// Adds a rectangle to some that share no pixel; with whichever it goes together, it becomes one, which may then reach others.
void join(std::vector<Area>& areas, Area area, int64_t apart) {
    for (size_t i = 0; i < areas.size();) {
        if (!together(areas[i], area, apart)) {
            ++i;
            continue;
        }
        area = both(areas[i], area);
        areas[i] = areas.back();
        areas.pop_back();
        i = 0;
    }
    areas.push_back(area);
}

}  // namespace

std::vector<PixelRect> through_rects(std::span<const Box3> boxes, const shade::CameraParams& camera,
                                     const PixelRect& tile, int most, int apart) {
    std::vector<Area> seen;
    for (const Box3& box : boxes)
        if (const Area area = area_of(box, camera, tile); !area.empty()) seen.push_back(area);
    const auto place = [](const Area& s) { return std::tie(s.y0, s.x0, s.y1, s.x1); };
    const auto upper_first = [&](const Area& a, const Area& b) { return place(a) < place(b); };
    std::sort(seen.begin(), seen.end(), upper_first);
    std::vector<Area> areas;
    int64_t apart_now = apart;
    for (const Area& area : seen) {
        join(areas, area, apart_now);
        while (areas.size() > kMostApart) {
            apart_now *= 2;
            for (const Area& again : std::exchange(areas, {})) join(areas, again, apart_now);
        }
    }
    std::sort(areas.begin(), areas.end(), upper_first);
    std::vector<PixelRect> out;
    for (const Area& s : areas) {
        const int width = s.x1 - s.x0, rows = std::max(most / width, 1);
        for (int y = s.y0; y < s.y1; y += rows) out.push_back({s.x0, y, width, std::min(rows, s.y1 - y)});
    }
    return out;
}

}  // namespace kiln::render
