// SPDX-License-Identifier: MIT
// Where surfaces of meshes were in the frame before: where their own transform had them, and the camera of that frame.
#include "drawables.h"
#include "field/brick_content.h"
#include "gpu_worlds.h"
#include "render/lib/pack.h"
#include "render/temporal.h"

#include <bit>
#include <cmath>

namespace kiln::render {
namespace {

constexpr int kMotionWidth = 64, kMotionHeight = 48;

struct MeshMotionGpu : GpuTest {};

vec3 placed(const Transform& t, vec3 p) { return t.position + rotate(t.rotation, p * t.scale); }

TEST_F(MeshMotionGpu, IsThatOfItsTransformAndOfTheCamera) {
    field::worlds::World far = field::worlds::sphere_of(4);
    Frame frame = frame_of(far, {0.4f, 0.9f, 3});
    frame.camera.target = {0.9f, 0.1f, 0};
    frame.meshes = {meshes::at(meshes::sphere(0.6f, 48, meshes::matte({0.5f, 0.5f, 0.5f})))};
    MeshInstance& mesh = frame.meshes[0];
    mesh.transform = {
        .position = {1.1f, 0.1f, 0.3f}, .rotation = axis_angle({0, 1, 0}, 0.4f), .scale = {1, 0.8f, 1.1f}};
    mesh.before = {.position = {1.0f, 0.16f, 0.25f},
                   .rotation = axis_angle(normalize(vec3{0.2f, 1, 0}), 0.2f),
                   .scale = {0.9f, 0.85f, 1.1f}};
    Camera before = frame.camera;
    before.position = before.position + vec3{0.05f, -0.03f, 0.04f};
    GpuField gpu(*runner_);
    GpuMeshes meshes(*runner_);
    rhi::must(gpu.update(frame.field, Baker::Host));
    const FrameParams p =
        rhi::must(frame_params(frame, {.width = kMotionWidth, .height = kMotionHeight, .refine = false}, gpu));
    rhi::must(meshes.update(frame, p.camera));
    Graph g(*runner_);
    TileInputs in;
    in.field = gpu.import(g);
    in.meshes = meshes.import(g);
    in.has_meshes = true;
    in.frame = g.block(p);
    const FrameRay no_ray{};
    in.rays = g.upload("rays", std::span<const FrameRay>(&no_ray, 1));
    in.size = {kMotionWidth, kMotionHeight};
    in.motion = g.block(motion_params(frame.camera, before, kMotionWidth, kMotionHeight));
    const Visibility field = march(g, in);
    const Image seen = see_meshes(g, in, draw_clusters(g, in).ids, field.words, field.words);
    const Readback moved = g.readback(motion(g, in, seen)), words = g.readback(seen);
    rhi::must(runner_->execute(g));
    const auto halves = rhi::must(moved.get_as<uint16_t>());
    const auto visible = rhi::must(words.get_as<uint32_t>());
    const shade::CameraParams now = shade::camera_params(frame.camera, kMotionWidth, kMotionHeight),
                              then = shade::camera_params(before, kMotionWidth, kMotionHeight);
    const Transform& t = mesh.transform;
    const quat back{-t.rotation.x, -t.rotation.y, -t.rotation.z, t.rotation.w};
    int judged = 0;
    float largest = 0;
    for (size_t i = 0; i < size_t{kMotionWidth} * kMotionHeight; ++i) {
        if (visible[4 * i + 1] >> 28 != kSeenMesh) continue;
        ++judged;
        const vec3 d = shade::camera_direction_at(now, float(i % kMotionWidth) + 0.5f, float(i / kMotionWidth) + 0.5f);
        const vec3 at = frame.camera.position + d * (std::bit_cast<float>(visible[4 * i]) * p.grid.voxel_size);
        const vec3 local = rotate(back, at - t.position) * vec3{1 / t.scale.x, 1 / t.scale.y, 1 / t.scale.z};
        const vec3 was = placed(mesh.before, local);
        const vec2 here = shade::camera_pixel(now, at - frame.camera.position),
                   there = shade::camera_pixel(then, was - before.position);
        EXPECT_NEAR(field::half_value(halves[4 * i]), there.x - here.x, 0.02f) << i;
        EXPECT_NEAR(field::half_value(halves[4 * i + 1]), there.y - here.y, 0.02f) << i;
        largest = std::max(largest, std::hypot(there.x - here.x, there.y - here.y));
    }
    EXPECT_GT(judged, 150);
    EXPECT_GT(largest, 1);
}

}  // namespace
}  // namespace kiln::render
