// SPDX-License-Identifier: MIT
// Hard shadows in pictures: a box over a slab, and one that stands on it. A pixel all of whose neighbourhood of half a pixel is on one side of the
// shadow's true edge shows that side; so the edge is within half a pixel of where it belongs, and no light leaks in where the box stands.
#include "gpu_worlds.h"
#include "render/lib/pack.h"

#include <cmath>

namespace kiln::render {
namespace {

struct HardShadowGpu : testing::Test {
    void SetUp() override {
        renderer = renderer_or_skip();
        if (!renderer && !HasFailure()) GTEST_SKIP() << "no Vulkan device";
    }
    std::unique_ptr<Renderer> renderer;
};

// Does the ray from p along d meet the box?
bool meets(vec3 p, vec3 d, vec3 low, vec3 high) {
    float first = 0, last = 1e9f;
    for (int axis = 0; axis < 3; ++axis) {
        const auto of = [axis](vec3 v) { return axis == 0 ? v.x : axis == 1 ? v.y : v.z; };
        const float a = (of(low) - of(p)) / of(d), b = (of(high) - of(p)) / of(d);
        first = std::max(first, std::min(a, b));
        last = std::min(last, std::max(a, b));
    }
    return first <= last;
}

TEST_F(HardShadowGpu, EndsWithinHalfAPixelAndLeaksNowhere) {
    const vec3 half{0.3f, 0.2f, 0.25f};
    for (const float bottom : {0.3f, 0.0f}) {
        const vec3 middle{0, bottom + half.y, 0};
        field::worlds::World world{"box over a slab",
                                   {field::worlds::edit(Box{.half_extents = {1.2f, 0.05f, 1.2f}}, {0, -0.05f, 0}),
                                    field::worlds::edit(Box{.half_extents = half}, middle)},
                                   {.voxel_size = 0.01f, .bounds = {{-1.3f, -0.2f, -1.3f}, {1.3f, 0.9f, 1.3f}}}};
        Frame frame = frame_of(world, {0.9f, 2.2f, 1.7f});
        frame.camera.target = {0.1f, 0, 0.1f};
        frame.camera.fov_y_deg = 50;
        frame.environment = Environment{.color = {0, 0, 0}};
        frame.materials.assign(8, Material{.base_color = {0.8f, 0.8f, 0.8f}, .roughness = 1});
        const vec3 from_sun = normalize(vec3{0.55f, -1, 0.35f});
        frame.lights = {{.kind = Light::Kind::Directional, .direction = from_sun, .angular_diameter_deg = 0}};
        const Picture p = rhi::must(renderer->render(frame, {.width = 96, .height = 72}));
        const shade::CameraParams camera = shade::camera_params(frame.camera, p.width, p.height);
        int lit = 0, shaded = 0, wrong = 0, near_edge = 0;
        for (int y = 0; y < p.height; ++y) {
            for (int x = 0; x < p.width; ++x) {
                int kind = -1;  // 0 lit, 1 in shadow, 2 something else
                bool sure = true;
                for (int k = 0; k < 9; ++k) {
                    const vec3 d = shade::camera_direction_at(camera, float(x) + 0.5f * float(k % 3),
                                                              float(y) + 0.5f * float(k / 3));
                    const vec3 eye = frame.camera.position, at = eye + d * (-eye.y / d.y);
                    const bool on_slab = d.y < 0 && std::fabs(at.x) < 1.19f && std::fabs(at.z) < 1.19f &&
                                         !meets(eye, d, middle - half, middle + half);
                    const int here = !on_slab ? 2 : meets(at, from_sun * -1.0f, middle - half, middle + half) ? 1 : 0;
                    sure = sure && (kind < 0 || kind == here);
                    kind = here;
                }
                near_edge += !sure;
                if (!sure || kind == 2) continue;
                const float light = p.rgba[4 * size_t(y * p.width + x)];
                wrong += kind == 1 ? light > 0.001f : light < 0.1f;
                (kind == 1 ? shaded : lit) += 1;
            }
        }
        EXPECT_GT(lit, 1000) << bottom;
        EXPECT_GT(shaded, 50) << bottom;
        EXPECT_GT(near_edge, 50) << bottom;
        EXPECT_EQ(wrong, 0) << bottom;
    }
}

}  // namespace
}  // namespace kiln::render
