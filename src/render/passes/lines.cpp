// SPDX-License-Identifier: MIT
#include "render/passes/forward.h"

#include "base/log.h"
#include "render/passes/lines.gpu.h"

#include "shaders/lines_frag.spv.h"
#include "shaders/lines_over.spv.h"
#include "shaders/lines_vert.spv.h"

#include <algorithm>

namespace kiln::render {

namespace {

constexpr rhi::ColorTarget kOver[] = {{.format = rhi::Format::Rgba16Float,
                                       .blend = true,
                                       .color = {rhi::BlendFactor::One, rhi::BlendFactor::OneMinusSrcAlpha},
                                       .alpha = {rhi::BlendFactor::One, rhi::BlendFactor::OneMinusSrcAlpha}}};

}  // namespace

const RasterKernel kLines{.name = "debug lines", .vertex = kLinesVertSpv, .fragment = kLinesFragSpv, .colors = kOver};
const Kernel kLinesOver{"debug lines over", kLinesOverSpv};

std::vector<LineRecord> line_records(std::span<const DebugLine> lines, vec3 eye) {
    constexpr size_t kMost = rhi::kMaxStorageBinding / sizeof(LineRecord);
    if (lines.size() > kMost) {
        log::warn("{} of {} debug lines are drawn: a buffer holds no more", kMost, lines.size());
        lines = lines.first(kMost);
    }
    std::vector<LineRecord> out;
    out.reserve(lines.size());
    for (const DebugLine& line : lines) {
        const auto from_eye = [&](dvec3 p) {
            return vec3{float(p.x - double(eye.x)), float(p.y - double(eye.y)), float(p.z - double(eye.z))};
        };
        const vec3 a = from_eye(line.a), b = from_eye(line.b);
        const float sum = dot(a, a) + dot(b, b);
        if (!(sum < 1e18f) || !(line.width_px > 0)) continue;  // not finite, or beyond what floats can square
        out.push_back({a.x, a.y, a.z, std::min(line.width_px, 64.0f), b.x, b.y, b.z,
                       std::clamp(line.hidden, 0.0f, 1.0f), line.color.x, line.color.y, line.color.z, 0});
    }
    return out;
}

Image draw_lines(Graph& g, const TileInputs& in, const Image& depth, const Image& shown) {
    if (in.lines.count == 0) return shown;
    Image drawn = g.create("debug lines", {.size = shown.size, .format = rhi::Format::Rgba16Float});
    const DrawCall call{.vertices = 6, .instances = in.lines.count};
    g.draw(kLines, {.colors = {{.image = &drawn, .load = rhi::Load::Clear}}},
           {g.uniform(in.lines.params), g.read(in.lines.lines), g.read(depth)}, {&call, 1});
    return lay_over(g, drawn, shown);
}

Image lay_over(Graph& g, const Image& drawn, const Image& shown) {
    Image out = g.create("shown with lines", {.size = shown.size, .format = rhi::Format::Rgba8Unorm});
    g.dispatch(kLinesOver, shown.size, {g.read(shown), g.read(drawn), g.write(out)},
               LinePush{int(shown.size.width), int(shown.size.height)});
    return out;
}

}  // namespace kiln::render
