// SPDX-License-Identifier: MIT
// Clipmaps on the GPU: the same rays as on the CPU, the same texels after any history, and the picture of one level.

#include "gpu_worlds.h"
#include "rgb_of.h"

#include "field/brick_set.h"
#include "field/clipmap.h"
#include "image/metrics.h"
#include "render/lib/pack.h"
#include "render/lib/shading.gpu.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

namespace kiln::render {
namespace {

using field::BrickSet;
using field::Clipmap;
using field::worlds::Random;

struct LevelsGpu : GpuTest {};

std::vector<Edit> hills(uint32_t seed = 4) {
    Random r(seed);
    std::vector<Edit> edits{field::worlds::edit(Plane{}, {0, -0.4f, 0})};
    for (int i = 0; i < 90; ++i) {
        const float spread = i % 3 == 0 ? 5.0f : 30.0f;
        Edit e = i % 4 == 0 ? field::worlds::edit(Box{.half_extents = {r.in(0.1f, 1), r.in(0.2f, 2), r.in(0.1f, 1)}})
                            : field::worlds::edit(Sphere{.radius = r.in(0.3f, 2)}, {},
                                                  i % 5 == 1 ? Op::Subtract : Op::Union, i % 2 == 0 ? 0.2f : 0.0f);
        e.node.transform.position = {r.in(-spread, spread), r.in(-0.8f, 0.2f), r.in(-spread, spread)};
        e.node.transform.rotation = axis_angle(r.direction(), r.in(-3, 3));
        e.node.material = MaterialId{uint32_t(r.below(5)), 0};
        edits.push_back(e);
    }
    return edits;
}

Clipmap made(std::shared_ptr<const sdf::Program> program, dvec3 focus, float h = 0.05f, int levels = 4) {
    auto out = Clipmap::make(std::move(program), {.voxel_size = h, .levels = levels, .cells = 32}, focus);
    EXPECT_TRUE(out);
    return std::move(*out);
}

TEST_F(LevelsGpu, RaysMeetWhatTheyMeetOnTheCpuWhileCellsAreMissingToo) {
    Clipmap map = made(field::worlds::compiled(hills()), {0, 1.5, 0});
    GpuField gpu(*runner_);
    for (const int step : {0, 1, 2, 3}) {
        if (step == 0) map.work({.bricks = 0});
        if (step == 1) map.work({.bricks = 2500});
        if (step == 2) map.work();
        if (step == 3) map.move({1.4, 1.6, -0.9});
        rhi::must(gpu.update(map));
        Random r(uint32_t(11 + step));
        std::vector<FrameRay> rays;
        for (int i = 0; i < 4096; ++i) {
            vec3 d = r.direction();
            d.y = -std::fabs(d.y) * (i % 2 == 0 ? 1.0f : 0.15f);
            d = normalize(d);
            FrameRay ray{};
            ray.whole_x = int(r.in(-40, 40)), ray.whole_y = 60, ray.whole_z = int(r.in(-40, 40));
            ray.part_x = ray.part_z = 0.25f;
            ray.direction_x = d.x, ray.direction_y = d.y, ray.direction_z = d.z;
            rays.push_back(ray);
        }
        for (const bool accelerate : {true, false}) {
            FrameParams p{};
            p.grid = gpu.grid();
            p.distance_scale = gpu.distance_scale();
            p.width = p.tile_width = p.height = p.tile_height = 64;
            p.flags = kFrameRays | (accelerate ? kFrameAccelerate : 0u);
            Graph g(*runner_);
            TileInputs in;
            in.field = gpu.import(g);
            in.frame = g.block(p);
            in.levels = true;
            in.levels_block = g.block(gpu.levels());
            in.rays = g.upload("rays", std::span<const FrameRay>(rays));
            in.size = {64, 64};
            const Readback words = g.readback(march(g, in).words);
            rhi::must(runner_->execute(g));
            const auto all = rhi::must(words.get_as<uint32_t>());
            int hits = 0, wrong = 0, far = 0, by_level[field::kMostLevels] = {};
            for (size_t i = 0; i < rays.size(); ++i) {
                const FrameRay& q = rays[i];
                const double h = double(map.options().voxel_size);
                const Clipmap::Hit want = map.cast(
                    {h * (q.whole_x + double(q.part_x)), h * double(q.whole_y), h * (q.whole_z + double(q.part_z))},
                    {q.direction_x, q.direction_y, q.direction_z}, 1e30, accelerate);
                const uint32_t state = all[4 * i + 1] >> 28;
                const uint32_t expected = want.state == field::kMarchHit    ? kSeenBrick
                                          : want.state == field::kMarchMiss ? kSeenNothing
                                                                            : kSeenInside;
                // A ray that grazes may go either way by rounding; it is counted.
                if (state != expected) {
                    ++wrong;
                    continue;
                }
                if (state != kSeenBrick) continue;
                ++hits;
                const int level = int(all[4 * i + 2] >> kSeenLevelShift);
                const double off = std::fabs(double(std::bit_cast<float>(all[4 * i])) - want.t / h) / (1 << level);
                far += level != want.level || off > 1e-2;
                ++by_level[level];
            }
            EXPECT_LE(wrong, 2) << "step " << step;
            EXPECT_LE(far, 4) << "step " << step;
            EXPECT_GT(hits, 2500) << "step " << step;
            EXPECT_GT(by_level[step == 0 ? map.all_levels() - 1 : 3], 50);
            if (step >= 2) {
                EXPECT_GT(by_level[0], 200);
            }
        }
    }
}

TEST_F(LevelsGpu, TexelsAreTheClipmapsAfterMovesAndChanges) {
    std::vector<Edit> edits = hills();
    field::worlds::Live live(edits);
    Clipmap map = made(live.program(), {0, 1, 0});
    map.work();
    GpuField gpu(*runner_);
    rhi::must(gpu.update(map));
    const uint32_t all = gpu.bricks_baked();
    EXPECT_EQ(all, map.bricks());
    for (int step = 0; step < 4; ++step) {
        map.move({0.8 * step, 1, 0.3 * step});
        edits.push_back(field::worlds::edit(Sphere{.radius = 0.4f}, {0.5f * float(step), -0.3f, 0.6f}, Op::Subtract));
        map.edit(live.program(), live.become(edits));
        map.work();
        rhi::must(gpu.update(map));
        EXPECT_GT(gpu.bricks_baked(), 0u);
        EXPECT_LT(gpu.bricks_baked(), all / 2) << "only what changed is written";
    }
    rhi::must(gpu.update(map));
    EXPECT_EQ(gpu.bricks_baked(), 0u);
    std::vector<uint32_t> slots;
    for (uint32_t slot = 0; slot < map.slot_count(); ++slot) {
        if (map.content(slot)) slots.push_back(slot);
    }
    const auto texels = rhi::must(gpu.read_back(slots));
    int wrong = 0;
    for (size_t i = 0; i < slots.size(); ++i) {
        const field::BrickContent& brick = map.content(slots[i]);
        for (size_t t = 0; t < 512; ++t)
            wrong +=
                texels[i].distance_codes[t] != brick.half->codes[t] || texels[i].material_words[t] != brick.word(t);
        for (size_t k = 0; k < 16; ++k) wrong += texels[i].palette[k] != brick.palette(k);
    }
    EXPECT_EQ(wrong, 0);
}

Frame seen_from(const Clipmap& map, vec3 eye, vec3 target) {
    Frame frame = frame_of(field::worlds::sphere_of(4));
    frame.field = nullptr;
    frame.levels = std::make_shared<const Clipmap>(map);
    frame.camera.position = eye;
    frame.camera.target = target;
    return frame;
}

TEST(LevelPicturesGpu, DrawWhatOneLevelDraws) {
    auto renderer = renderer_or_skip();
    if (!renderer) GTEST_SKIP();
    const field::worlds::World world = on_ground();
    Frame one = frame_of(world);
    // So small that the world reaches into the third level.
    Clipmap map = made(field::worlds::compiled(world.source()), {2.2, 1.5, 2.6}, 0.02f, 5);
    map.work();
    Frame levels = seen_from(map, one.camera.position, one.camera.target);
    for (const bool refine : {true, false}) {
        const RenderSettings settings{.width = 160, .height = 120, .refine = refine};
        auto a = renderer->render(one, settings);
        auto b = renderer->render(levels, settings);
        ASSERT_TRUE(a && b) << (a ? "" : a.error().message) << (b ? "" : b.error().message);
        int off = 0;
        for (size_t i = 0; i < a->depth.size(); ++i) {
            if (std::isinf(a->depth[i]) && std::isinf(b->depth[i])) continue;
            off += !(std::fabs(a->depth[i] - b->depth[i]) < (refine ? 0.005f : 0.05f) * a->depth[i]);
        }
        EXPECT_LE(off, 160) << "of " << a->depth.size() << ", refine " << refine;
        EXPECT_LE(image::flip(rgb_of(*a), rgb_of(*b)), refine ? 0.01 : 0.05) << "refine " << refine;
    }
    EXPECT_EQ(renderer->stats().levels.size(), 5u);
    EXPECT_FALSE(renderer->render(levels, {.width = 16, .height = 16, .analytic = true}));
}

// Rays for shadows start a voxel of their level off the surface: no stripes on a plane that crosses voxels, bricks and levels at a slant, wherever
// the sun is. It is a slab's top: nothing else is there to shade it.
TEST(LevelPicturesGpu, APlaneAcrossLevelsDoesNotShadeItself) {
    auto renderer = renderer_or_skip();
    if (!renderer) GTEST_SKIP();
    Edit slab = field::worlds::edit(Box{.half_extents = {30, 1, 30}}, {0, -1, 0});
    slab.node.transform.rotation = axis_angle(normalize(vec3{1, 0, 0.4f}), 0.037f);
    const vec3 up = rotate(slab.node.transform.rotation, {0, 1, 0});
    const vec3 top = slab.node.transform.position + up;
    const vec3 eye{0.1f, 0.5f, 0.2f};
    Clipmap map = made(field::worlds::compiled({slab}), {0.1, 0.5, 0.2}, 0.02f, 5);
    map.work();
    Frame frame = seen_from(map, eye, {0.5f, 0.2f, -1});
    frame.materials.assign(8, Material{.base_color = {0.8f, 0.8f, 0.8f}, .roughness = 1});
    frame.environment = Environment{.color = {0, 0, 0}};
    const vec3 across = normalize(cross(up, vec3{0.3f, 0, 1})), along = cross(across, up);
    for (const bool refine : {true, false}) {
        const RenderSettings settings{.width = 64, .height = 36, .refine = refine};
        RenderSettings levels = settings;
        levels.view = View::Levels;
        const Picture colors = rhi::must(renderer->render(frame, levels));
        std::vector<std::array<uint8_t, 3>> seen;
        for (size_t i = 0; i < colors.depth.size(); ++i) {
            const std::array<uint8_t, 3> c{colors.srgb[4 * i], colors.srgb[4 * i + 1], colors.srgb[4 * i + 2]};
            if (std::isfinite(colors.depth[i]) && std::find(seen.begin(), seen.end(), c) == seen.end())
                seen.push_back(c);
        }
        EXPECT_GE(seen.size(), 3u) << "levels";
        for (const float degrees : {45.0f, 80.0f, 89.0f}) {
            for (const float turn : {0.3f, 2.0f}) {
                const float a = degrees * 0.017453293f;
                const vec3 to_sun = up * std::cos(a) + (across * std::cos(turn) + along * std::sin(turn)) * std::sin(a);
                frame.lights = {
                    {.kind = Light::Kind::Directional, .direction = to_sun * -1.0f, .angular_diameter_deg = 0.53f}};
                const Picture p = rhi::must(renderer->render(frame, settings));
                const shade::LightRecord record = shade::light_record(frame.lights[0]);
                const shade::CameraParams camera = shade::camera_params(frame.camera, p.width, p.height);
                const shade::SurfaceOptics white = shade::surface_optics({0.8f, 0.8f, 0.8f}, 0, 1);
                int judged = 0;
                float least = 1;
                for (int i = 0; i < p.width * p.height; ++i) {
                    const float far = p.depth[size_t(i)];
                    if (!std::isfinite(far)) continue;
                    const vec3 d =
                        shade::camera_direction_at(camera, float(i % p.width) + 0.5f, float(i / p.width) + 0.5f);
                    const vec3 at = eye + d * far;
                    if (std::fabs(dot(at - top, up)) > 0.01f || far > 12) continue;
                    ++judged;
                    const shade::LightSample light = shade::sample_light(record, at);
                    const float open = shade::shade_light(shade::surface_view(white, up, d * -1.0f), light, 1).x;
                    least = std::min(least, p.rgba[4 * size_t(i)] / open);
                }
                EXPECT_GT(judged, 600);
                // At 89 degrees a hundredth of a degree of the normal that bricks have is a hundredth of the light.
                EXPECT_GE(least, refine || degrees < 85 ? 0.99f : 0.98f)
                    << degrees << " degrees, " << turn << ", refine " << refine;
            }
        }
    }
}

// A camera that goes a centimetre a frame. Levels snap to new places under it and bake within a budget; what it sees is what a world
// made for that place alone shows, at every pixel.
TEST(LevelPicturesGpu, NothingPopsOnADolly) {
    auto renderer = renderer_or_skip();
    if (!renderer) GTEST_SKIP();
    const auto program = field::worlds::compiled(hills());
    const auto eye = [](int frame) { return vec3{0, 0.9f, 3 - 0.01f * float(frame)}; };
    const auto at = [](vec3 p) { return dvec3{double(p.x), double(p.y), double(p.z)}; };
    Clipmap map = made(program, at(eye(0)), 0.02f, 4);
    map.work();
    float worst = 0;
    double mean = 0;
    int snaps = 0;
    const RenderSettings settings{.width = 80, .height = 45};
    for (int frame = 1; frame <= 45; ++frame) {
        const field::ivec3 first = map.first_cell(0);
        map.move(at(eye(frame)));
        map.work({.bricks = 120});
        const bool snapped = !(map.first_cell(0) == first);
        snaps += snapped;
        if (!snapped && frame != 10) continue;
        const vec3 target{0.4f, 0.2f, eye(frame).z - 4};
        auto moving = renderer->render(seen_from(map, eye(frame), target), settings);
        Clipmap fresh = made(program, at(eye(frame)), 0.02f, 4);
        fresh.work();
        auto settled = renderer->render(seen_from(fresh, eye(frame), target), settings);
        ASSERT_TRUE(moving && settled);
        for (const float e : image::flip_map(rgb_of(*settled), rgb_of(*moving))) worst = std::max(worst, e);
        mean = std::max(mean, image::flip(rgb_of(*settled), rgb_of(*moving)));
    }
    EXPECT_GE(snaps, 1);
    EXPECT_LE(mean, 0.02);
    EXPECT_LE(worst, 0.02f) << "of any pixel";
}

// Gate G25 of a world that changes: two renderers, two clipmaps, the same flight among things that move and edits that come: the same bits, whatever
// is still missing.
TEST(LevelPicturesGpu, TwoRunsOfAFlightThroughAWorldThatChangesAreTheSameBits) {
    const float h = 0.02f;
    const auto stone = BrickSet::make(field::worlds::compiled({field::worlds::edit(Sphere{.radius = 0.15f})}), h);
    ASSERT_TRUE(stone);
    std::vector<std::vector<uint8_t>> first;
    for (const int run : {0, 1}) {
        auto renderer = renderer_or_skip();
        if (!renderer) GTEST_SKIP();
        std::vector<Edit> edits = hills();
        field::worlds::Live live(edits);
        Clipmap map = made(live.program(), {0, 0.9, 3}, h, 4);
        map.work({.bricks = 2000});
        Pose before[3];
        for (int frame = 0; frame < 5; ++frame) {
            const vec3 eye{0.3f * float(frame), 0.9f, 3 - 0.4f * float(frame)};
            map.move({double(eye.x), double(eye.y), double(eye.z)});
            edits.push_back(field::worlds::edit(Sphere{.radius = 0.2f}, {0.3f * float(frame) - 0.4f, -0.1f, 0.8f},
                                                frame % 2 == 0 ? Op::Union : Op::Subtract));
            map.edit(live.program(), live.become(edits));
            map.work({.bricks = 400});
            Frame seen = seen_from(map, eye, {0.4f, 0.2f, -1});
            for (int i = 0; i < 3; ++i) {
                const Pose pose{{0.4f * float(i) - 0.3f + 0.05f * float(frame), 0.5f, 0.6f}};
                seen.instances.push_back({.bricks = *stone, .pose = pose, .before = frame == 0 ? pose : before[i]});
                before[i] = pose;
            }
            auto picture = renderer->render(seen, {.width = 64, .height = 36});
            ASSERT_TRUE(picture) << picture.error().message;
            if (run == 0) {
                EXPECT_TRUE(first.empty() || picture->srgb != first.back()) << "nothing changed in frame " << frame;
                first.push_back(picture->srgb);
            } else {
                EXPECT_EQ(picture->srgb, first[size_t(frame)]) << "frame " << frame;
            }
        }
    }
}

// The view `levels` tells where a pool too small shows a coarser level.
TEST(LevelPicturesGpu, WhatAPoolGaveBackIsSeenInTheViewOfLevels) {
    auto renderer = renderer_or_skip();
    if (!renderer) GTEST_SKIP();
    const auto program = field::worlds::compiled(hills());
    const dvec3 focus{0, 0.9, 3};
    auto whole = Clipmap::make(program, {.voxel_size = 0.02f, .levels = 4, .cells = 32}, focus);
    ASSERT_TRUE(whole);
    whole->work();
    auto small = Clipmap::make(
        program,
        {.voxel_size = 0.02f, .levels = 4, .cells = 32, .max_bricks = whole->bricks() - whole->counts(0).bricks / 2},
        focus);
    ASSERT_TRUE(small);
    small->work();
    const RenderSettings settings{.width = 96, .height = 54, .view = View::Levels};
    auto a = renderer->render(seen_from(*whole, {0, 0.9f, 3}, {0.4f, 0.2f, 1}), settings);
    ASSERT_TRUE(a);
    EXPECT_EQ(renderer->stats().levels[0].refused, 0u);
    auto b = renderer->render(seen_from(*small, {0, 0.9f, 3}, {0.4f, 0.2f, 1}), settings);
    ASSERT_TRUE(b);
    EXPECT_GT(renderer->stats().levels[0].refused, 0u);
    int other = 0, holes = 0;
    for (size_t i = 0; i < a->depth.size(); ++i) {
        const float* const p = &a->rgba[4 * i];
        const float* const q = &b->rgba[4 * i];
        other += std::fabs(p[0] - q[0]) + std::fabs(p[1] - q[1]) + std::fabs(p[2] - q[2]) > 0.1f;
        holes += std::isfinite(a->depth[i]) != std::isfinite(b->depth[i]) ||
                 (std::isfinite(a->depth[i]) && std::fabs(a->depth[i] - b->depth[i]) > 0.1f * a->depth[i]);
    }
    EXPECT_GT(other, 100) << "another colour where the next level is seen";
    EXPECT_LE(holes, 40) << "the same surfaces";
}

}  // namespace
}  // namespace kiln::render
