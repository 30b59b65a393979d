// SPDX-License-Identifier: MIT
#include "render/shadow_cascades.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>

namespace kiln::render {

namespace {

double dotted(dvec3 a, dvec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
dvec3 crossed(dvec3 a, dvec3 b) { return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }
dvec3 scaled(dvec3 a, double by) { return {a.x * by, a.y * by, a.z * by}; }
dvec3 unit(dvec3 a) { return scaled(a, 1 / std::sqrt(dotted(a, a))); }

// Steps of a fourth of an octave: what moves a little keeps its maps.
double stepped_up(double x) { return std::exp2(std::ceil(4 * std::log2(x)) / 4); }
double snapped(double x, double step) { return std::floor(x / step) * step; }

}  // namespace

int shadow_map_side(int width, int height) {
    return int(std::clamp(std::bit_ceil(uint32_t(std::max(width, height))), 512u, 2048u));
}

ShadowCascades fit_cascades(std::span<const Box3> casters, vec3 towards, const Camera& camera, double aspect,
                            int side) {
    ShadowCascades c;
    c.side = side;
    c.w = unit(scaled(wide(towards), -1));
    const dvec3 aside = std::fabs(c.w.y) < 0.9 ? dvec3{0, 1, 0} : dvec3{1, 0, 0};
    c.u = unit(crossed(aside, c.w));
    c.v = crossed(c.w, c.u);
    double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
    for (const Box3& box : casters) {
        if (box.empty()) continue;
        for (int corner = 0; corner < 8; ++corner) {
            const dvec3 p{corner & 1 ? box.max.x : box.min.x, corner & 2 ? box.max.y : box.min.y,
                          corner & 4 ? box.max.z : box.min.z};
            const double at[3] = {dotted(p, c.u), dotted(p, c.v), dotted(p, c.w)};
            for (int i = 0; i < 3; ++i) low[i] = std::min(low[i], at[i]), high[i] = std::max(high[i], at[i]);
        }
    }
    // Four texels stay empty at the border of the widest: its middle is snapped, and what lies beyond is read off its edge.
    const double extent = std::max({high[0] - low[0], high[1] - low[1], 1e-3});
    c.half = stepped_up(0.5 * extent * (1 + 8.0 / side));
    const double widest_texel = 2 * c.half / side;
    c.middle_u = snapped(0.5 * (low[0] + high[0]) + 0.5 * widest_texel, widest_texel);
    c.middle_v = snapped(0.5 * (low[1] + high[1]) + 0.5 * widest_texel, widest_texel);
    c.range = stepped_up(std::max(high[2] - low[2], 1e-3) * 1.1);
    c.low = snapped(low[2] - 0.01 * c.range, c.range / 32);

    // The sphere through the eye and the far corners of what is seen up to a distance of 1: its radius, and how far ahead its middle is.
    const double tan_y = std::tan(0.5 * camera.fov_y_deg * std::numbers::pi / 180);
    const double tan2 = tan_y * tan_y * (1 + aspect * aspect);
    const double ahead = tan2 < 1 ? 0.5 * (1 + tan2) : 1, radius = tan2 < 1 ? ahead : std::sqrt(tan2);
    const dvec3 eye = wide(camera.position);
    const dvec3 look{double(camera.target.x) - eye.x, double(camera.target.y) - eye.y, double(camera.target.z) - eye.z};
    const double reach = std::sqrt(dotted(look, look));
    // The smallest shows what the camera looks at, and half as much beyond.
    const double octaves = std::log2(std::max(c.half / (1.5 * reach * radius), 1.0));
    const int most = int(kMostCascades) - 1;
    const int step = octaves <= 2 * most ? 2 : octaves <= 3 * most ? 3 : 4;
    const int finer = std::clamp(int(std::ceil(octaves / step)), 0, most);
    for (int k = finer; k >= 0; --k) {
        ShadowCascades::Square s{c.middle_u, c.middle_v, std::ldexp(c.half, -step * k)};
        if (k > 0) {
            const dvec3 middle = scaled(unit(look), s.half / radius * ahead);
            const dvec3 at{eye.x + middle.x, eye.y + middle.y, eye.z + middle.z};
            const double texel = 2 * s.half / side;
            s.u += snapped(dotted(at, c.u) - c.middle_u, texel);
            s.v += snapped(dotted(at, c.v) - c.middle_v, texel);
        }
        c.squares.push_back(s);
    }
    return c;
}

CascadesBlock cascades_block(const ShadowCascades& c, vec3 eye, uint32_t light) {
    const auto row = [](dvec3 a) { return vec4{float(a.x), float(a.y), float(a.z), 0}; };
    CascadesBlock b{};
    b.u = row(c.u), b.v = row(c.v), b.w = row(c.w);
    b.w.w = float(dotted(wide(eye), c.w) - c.low);
    b.range = float(c.range);
    b.light = light;
    b.count = uint32_t(c.squares.size());
    b.side = uint32_t(c.side);
    for (size_t k = 0; k < c.squares.size(); ++k) {
        const ShadowCascades::Square& s = c.squares[k];
        b.squares[k] = {float((dotted(wide(eye), c.u) - s.u) / s.half), float((dotted(wide(eye), c.v) - s.v) / s.half),
                        float(1 / s.half), float(c.texel(k))};
        b.casters[k] = {float((s.u - c.middle_u) / c.half), float((s.v - c.middle_v) / c.half), float(s.half / c.half),
                        0};
    }
    return b;
}

}  // namespace kiln::render
