// SPDX-License-Identifier: MIT
// What leaves the grid: half-spaces, which kernels are told as planes where they are few, against the same as code; and rows without end,
// which rays look for only in the box around them, against the same in a box without end.
#include "gpu_worlds.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace kiln::render {
namespace {

using field::worlds::edit;

Edit plane(vec3 at, vec3 axis, float angle, uint16_t material) {
    Edit out = edit(Plane{}, at);
    out.node.transform.rotation = axis_angle(normalize(axis), angle);
    out.node.material = MaterialId{material};
    return out;
}

// Two slopes that meet, a level ground below the one, and a ball.
field::worlds::World slopes() {
    field::worlds::World w{"slopes", {}, {.voxel_size = 0.05f, .bounds = {{-1, -1, -1}, {1, 1, 1}}}};
    w.edits = {plane({0, -0.3f, 0}, {0, 0, 1}, 0.35f, 1), plane({0, -0.35f, 0.2f}, {1, 0, 0.3f}, -0.3f, 2),
               plane({0, -0.5f, 0}, {0, 1, 0}, 0, 0), edit(Sphere{.radius = 0.3f}, {0, 0.2f, 0})};
    return w;
}

TEST(HorizonGpu, PlanesAreWhatTheirCodeSays) {
    auto renderer = renderer_or_skip();
    if (!renderer) {
        if (!HasFailure()) GTEST_SKIP() << "no Vulkan device";
        return;
    }
    const field::worlds::World as_planes = slopes();
    field::worlds::World as_code = as_planes;  // more than a kernel takes; far below all that is seen
    for (int i = 0; i < kMostPlanes; ++i) as_code.edits.push_back(plane({0, -1e6f, 0}, {0, 1, 0}, 0, 0));
    for (const vec3 eye : {vec3{0.9f, 1.1f, 3}, vec3{40, 12, -30}}) {
        for (const View view : {View::Shaded, View::Albedo, View::Normal, View::Ao}) {
            Frame frame = frame_of(as_planes, eye), other = frame_of(as_code, eye);
            for (Frame* f : {&frame, &other}) {
                f->materials.assign(3, Material{.base_color = {0.2f, 0.5f, 0.3f}});
                f->materials[1].base_color = {0.7f, 0.2f, 0.1f};
                f->materials[2].base_color = {0.1f, 0.2f, 0.7f};
            }
            const RenderSettings settings{.width = 96, .height = 72, .view = view};
            const Picture a = rhi::must(renderer->render(frame, settings));
            const Picture b = rhi::must(renderer->render(other, settings));
            // The root is bracketed by other ends.
            double worst = 0;
            for (size_t i = 0; i < a.depth.size(); ++i) {
                ASSERT_EQ(std::isinf(a.depth[i]), std::isinf(b.depth[i])) << i;
                if (!std::isinf(a.depth[i]))
                    worst = std::max(worst, std::fabs(double(a.depth[i]) / double(b.depth[i]) - 1));
            }
            EXPECT_LE(worst, 2e-6) << int(view) << " from " << eye.x;
            // Normals of code are differences: at a crease those of one pixel may be of the other slope.
            int apart = 0;
            for (size_t i = 0; i < a.depth.size(); ++i) {
                bool same = true;
                for (size_t c = 0; c < 3; ++c) same = same && std::fabs(a.rgba[4 * i + c] - b.rgba[4 * i + c]) < 4e-3f;
                apart += !same;
            }
            EXPECT_LE(apart, 20) << int(view) << " from " << eye.x;
        }
    }
}

// Balls without end on two axes, and below them bars along one.
field::worlds::World rows() {
    field::worlds::World w{"rows", {}, {.voxel_size = 0.05f, .bounds = {{-1, -1, -1}, {1, 1, 1}}}};
    w.edits = {edit(Sphere{.radius = 0.3f}, {0, 0, 0}), edit(Box{.half_extents = {3, 0.1f, 0.1f}}, {0, -0.6f, 0})};
    w.edits[0].node.domain = {Repeat{.spacing = {1, 0, 1}}};
    w.edits[1].node.domain = {Repeat{.spacing = {0, 0, 1.5f}}};
    w.edits[1].blend_radius = 0.1f;
    return w;
}

TEST(HorizonGpu, RowsAreWhatTheyAreInABoxWithoutEnd) {
    auto renderer = renderer_or_skip();
    if (!renderer) {
        if (!HasFailure()) GTEST_SKIP() << "no Vulkan device";
        return;
    }
    const field::worlds::World boxed = rows();
    field::worlds::World endless = boxed;  // a row that leans, far below all that is seen
    endless.edits.push_back(edit(Sphere{.radius = 0.3f}, {0, -1e5f, 0}));
    endless.edits.back().node.domain = {Repeat{.spacing = {1, 0, 1}}};
    endless.edits.back().node.transform.rotation = axis_angle(normalize(vec3{1, 0, 1}), 1e-3f);
    constexpr float kSeen = 20;  // metres; beyond, steps skip what is less than half a pixel
    for (const vec3 eye : {vec3{0.9f, 1.1f, 3}, vec3{0.45f, -2, 2}, vec3{0.5f, 0.1f, 5}}) {
        for (const auto& [view, analytic] :
             {std::pair{View::Normal, false}, std::pair{View::Normal, true}, std::pair{View::Ao, false}}) {
            const RenderSettings settings{.width = 48, .height = 36, .view = view, .analytic = analytic};
            const Picture a = rhi::must(renderer->render(frame_of(boxed, eye), settings));
            const Picture b = rhi::must(renderer->render(frame_of(endless, eye), settings));
            int near = 0, far_apart = 0, unlike = 0;
            for (size_t i = 0; i < a.depth.size(); ++i) {
                if (std::min(a.depth[i], b.depth[i]) > kSeen) continue;
                ++near;
                far_apart += !(std::fabs(double(a.depth[i]) / double(b.depth[i]) - 1) < 1e-4);
                for (size_t c = 0; c < 3; ++c) unlike += std::fabs(a.rgba[4 * i + c] - b.rgba[4 * i + c]) > 0.02f;
            }
            // Rays that graze a ball end at another place where their steps were others.
            EXPECT_GT(near, 300) << int(view) << (analytic ? ", analytic," : "") << " from " << eye.y;
            EXPECT_LE(far_apart, near / 100) << int(view) << (analytic ? ", analytic," : "") << " from " << eye.y;
            EXPECT_LE(unlike, near / 30) << int(view) << (analytic ? ", analytic," : "") << " from " << eye.y;
        }
    }
}

}  // namespace
}  // namespace kiln::render
