// SPDX-License-Identifier: MIT
// Instances against the same solids in the world's list, against rays through their host bricks, and what moving them costs.
#include "gpu_worlds.h"
#include "rgb_of.h"
#include "render/temporal.h"

#include "field/brick_set.h"
#include "field/clipmap.h"
#include "image/metrics.h"
#include "render/gpu_instances.h"
#include "render/lib/octahedral.gpu.h"
#include "render/lib/pack.h"
#include "render/passes/forward.h"
#include "render/passes/instances.h"
#include "render/passes/refine.gpu.h"
#include "render/picture.h"
#include "sdf/eval.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace kiln::render {
namespace {

using field::BrickSet;
using field::worlds::edit;
using field::worlds::of_material;
using field::worlds::Random;

std::shared_ptr<const BrickSet> set_of(const std::vector<Edit>& edits, float field_voxel) {
    auto program = field::worlds::compiled(edits);
    auto made = BrickSet::make(program, BrickSet::voxel_size_for(*program, field_voxel));
    EXPECT_TRUE(made) << (made ? "" : made.error().message);
    return *made;
}

Edit at(Edit e, const Pose& pose) {
    e.node.transform.position = pose.position;
    e.node.transform.rotation = pose.rotation;
    return e;
}

// Six objects of three kinds about the blends on their ground, as edits and as instances.
struct Pair {
    Frame edits, instances;
};
std::vector<std::pair<Edit, Pose>> things() {
    const Edit box = of_material(edit(Box{.half_extents = {0.16f, 0.1f, 0.22f}}), 2);
    const Edit ring = of_material(edit(Torus{.major_radius = 0.2f, .minor_radius = 0.06f}), 4);
    const Edit ball = edit(Sphere{.radius = 0.17f});
    return {{box, {{0.9f, -0.2f, 0.7f}, axis_angle(normalize(vec3{1, 2, 0.5f}), 0.7f)}},
            {box, {{-0.8f, 0.75f, 0.6f}, axis_angle(normalize(vec3{-1, 0.4f, 0.5f}), 2.2f)}},
            {ring, {{0.1f, 0.95f, 0.6f}, axis_angle({1, 0, 0}, 1.1f)}},
            {ring, {{1.0f, 0.3f, -0.5f}, axis_angle(normalize(vec3{0.2f, 0.1f, 1}), 0.9f)}},
            {ball, {{0.5f, -0.3f, 1.0f}, {}}},
            {ball, {{-0.45f, 0.3f, 0.95f}, axis_angle({0, 1, 0}, 0.3f)}}};
}
Pair pair_of(const field::worlds::World& base) {
    field::worlds::World all = base;
    std::vector<std::pair<Edit, std::shared_ptr<const BrickSet>>> sets;
    Pair out;
    out.instances = frame_of(base);
    for (const auto& [thing, pose] : things()) {
        all.edits.push_back(at(thing, pose));
        auto same = std::find_if(sets.begin(), sets.end(), [&](const auto& s) { return s.first == thing; });
        if (same == sets.end()) same = sets.emplace(sets.end(), thing, set_of({thing}, base.options.voxel_size));
        out.instances.instances.push_back({.bricks = same->second, .pose = pose, .before = pose, .material = 0});
    }
    out.edits = frame_of(all);
    return out;
}

struct InstancesGpu : GpuTest {};

TEST(InstancePicturesGpu, DrawWhatTheSameEditsInTheWorldDraw) {
    auto renderer = renderer_or_skip();
    if (!renderer) GTEST_SKIP();
    // The world's voxels near those of the objects: what differs is then how they are drawn, not how finely they are stored.
    field::worlds::World base = on_ground();
    base.options.voxel_size = 0.012f;
    Pair pair = pair_of(base);
    struct Case {
        float disc_deg;
        bool refine;
        int most_off;
        double most_flip;
        AmbientOcclusion ao = AmbientOcclusion::Off;
    };
    // Half shadows of several things are multiplied, so a wide disc behind two of them is a little darker. Without refining, each shows
    // the rounding of its own voxels. Beside silhouettes ambient occlusion is the mean of fewer points, and they differ by a pixel.
    for (const Case c : {Case{0.53f, true, 20, 0.003},
                         {0, true, 20, 0.003},
                         {12, true, 20, 0.01},
                         {0.53f, false, 60, 0.006},
                         {0.53f, true, 20, 0.004, AmbientOcclusion::Full}}) {
        for (Frame* f : {&pair.edits, &pair.instances}) f->lights[0].angular_diameter_deg = c.disc_deg;
        const RenderSettings settings{.width = 160, .height = 120, .refine = c.refine, .ao = c.ao};
        auto a = renderer->render(pair.edits, settings);
        ASSERT_TRUE(a) << a.error().message;
        auto b = renderer->render(pair.instances, settings);
        ASSERT_TRUE(b) << b.error().message;
        EXPECT_EQ(renderer->stats().instances, 6);
        const float h = pair.edits.field->options().voxel_size;
        int off = 0, compared = 0;
        for (size_t i = 0; i < a->depth.size(); ++i) {
            if (std::isinf(a->depth[i]) && std::isinf(b->depth[i])) continue;
            ++compared;
            off += !(std::fabs(a->depth[i] - b->depth[i]) <= 0.25f * h);
        }
        EXPECT_GT(compared, 12000);
        // Silhouettes fall to either side of a pixel's middle.
        EXPECT_LE(off, c.most_off) << "disc " << c.disc_deg << ", refine " << c.refine;
        EXPECT_LE(image::flip(rgb_of(*a), rgb_of(*b)), c.most_flip) << "disc " << c.disc_deg << ", refine " << c.refine;
    }
}

TEST(InstancePicturesGpu, RaysMeetWhatRaysThroughHostBricksMeet) {
    auto renderer = renderer_or_skip();
    if (!renderer) GTEST_SKIP();
    Pair pair = pair_of(field::worlds::blends());
    Frame& frame = pair.instances;
    // Some before the world, and before each other, whatever their order in the list.
    const vec3 eye = frame.camera.position;
    for (const float share : {0.5f, 0.35f, 0.6f}) {
        Instance i = frame.instances[size_t(share * 8)];
        i.pose.position = eye * share + vec3{0.05f, 0.04f, 0} * share;
        frame.instances.push_back(i);
    }
    const RenderSettings settings{.width = 96, .height = 72, .view = View::Depth, .refine = false};
    for (const bool accelerate : {true, false}) {
        RenderSettings s = settings;
        s.accelerate = accelerate;
        auto picture = renderer->render(frame, s);
        ASSERT_TRUE(picture) << picture.error().message;
        const shade::CameraParams camera = shade::camera_params(frame.camera, s.width, s.height);
        const field::HostBricks world = field::HostBricks::bake(frame.field);
        int hits = 0, own = 0, wrong = 0;
        for (int y = 0; y < s.height; ++y) {
            for (int x = 0; x < s.width; ++x) {
                const vec3 d = shade::camera_direction_at(camera, float(x) + 0.5f, float(y) + 0.5f);
                const auto cast = [&](const field::HostBricks& bricks, vec3 o, vec3 way) {
                    const auto hit = bricks.cast({double(o.x), double(o.y), double(o.z)}, way, 1e9);
                    return hit.state == field::kMarchMiss ? 1e30 : hit.t;
                };
                double nearest = cast(world, eye, d);
                bool instance = false;
                for (const Instance& i : frame.instances) {
                    const Pose local = inverse(i.pose);
                    const double t = cast(i.bricks->bricks(), local * eye, rotate(local.rotation, d));
                    instance = instance || t < nearest;
                    nearest = std::min(nearest, t);
                }
                const double t = double(picture->depth[size_t(y * s.width + x)]);
                if (nearest >= 1e30 && std::isinf(t)) continue;
                ++hits;
                own += instance;
                wrong += !(std::fabs(t - nearest) < 2e-4);
            }
        }
        EXPECT_GT(hits, 1200);
        EXPECT_GT(own, 300);
        EXPECT_LE(wrong, 6) << "of " << hits;  // rays that graze
    }
}

TEST(InstancePicturesGpu, MovingBakesNothingAndWhatIsBehindIsSeenAgain) {
    auto renderer = renderer_or_skip();
    if (!renderer) GTEST_SKIP();
    Pair pair = pair_of(on_ground());
    Frame frame = pair.instances;
    const RenderSettings settings{.width = 80, .height = 60};
    auto first = renderer->render(frame, settings);
    ASSERT_TRUE(first) << first.error().message;
    EXPECT_GT(renderer->stats().instance_bricks_new, 0u);
    const uint32_t bricks = renderer->stats().instance_bricks;
    const uint64_t pipelines = renderer->stats().pipelines_created;
    for (int step = 1; step < 6; ++step) {
        for (Instance& i : frame.instances) {
            i.before = i.pose;
            i.pose.position = i.pose.position + vec3{0.07f, 0.03f, -0.05f};
            i.pose.rotation = axis_angle({0, 1, 0}, 0.3f) * i.pose.rotation;
        }
        ASSERT_TRUE(renderer->render(frame, settings));
        EXPECT_EQ(renderer->stats().instance_bricks_new, 0u);
        EXPECT_EQ(renderer->stats().instance_bricks, bricks);
        for (const auto& [name, ms] : renderer->stats().passes) EXPECT_NE(name, "bake");
    }
    EXPECT_EQ(renderer->stats().pipelines_created, pipelines);
    auto back = renderer->render(pair.instances, settings);
    ASSERT_TRUE(back);
    EXPECT_EQ(back->srgb, first->srgb) << "the same poses give the same picture";
    // None at all, then a set that has not been here, then all of them, with another field and so another atlas.
    frame.instances.clear();
    ASSERT_TRUE(renderer->render(frame, settings));
    EXPECT_EQ(renderer->stats().instances, 0);
    frame.instances = {
        {.bricks = set_of({edit(Sphere{.radius = 0.3f})}, 0.04f), .pose = {{0, 1, 1}, {}}, .before = {}}};
    ASSERT_TRUE(renderer->render(frame, settings));
    EXPECT_GT(renderer->stats().instance_bricks_new, 0u);
    field::worlds::World fine = on_ground();
    fine.options.voxel_size = 0.012f;
    const uint64_t atlas = renderer->stats().atlas_bytes;
    ASSERT_TRUE(renderer->render(frame_of(fine), settings));
    EXPECT_GT(renderer->stats().atlas_bytes, atlas);
    back = renderer->render(pair.instances, settings);
    ASSERT_TRUE(back);
    EXPECT_EQ(back->srgb, first->srgb);
}

// A thousand things that stand apart cost rays what they cost as edits of the world: neither the ground behind them nor they behind a hill
// are looked at.
TEST(InstancePicturesGpu, AThousandCostRaysNoMoreThanTheSameSurfacesInTheWorld) {
    auto renderer = renderer_or_skip();
    if (!renderer) GTEST_SKIP();
    field::worlds::World ground;
    ground.options.voxel_size = 0.03f;
    ground.options.bounds = {{-4, -0.5f, -4}, {4, 1.5f, 4}};
    ground.edits = {edit(Plane{})};
    for (int i = 0; i < 9; ++i)
        ground.edits.push_back(
            edit(Ellipsoid{.radii = {0.5f, 0.4f, 0.9f}}, {-3.2f + 0.8f * float(i), 0, i % 2 == 0 ? 0.6f : -0.8f}));
    const Edit kinds[] = {edit(Sphere{.radius = 0.09f}), edit(Box{.half_extents = {0.1f, 0.06f, 0.08f}}),
                          edit(Torus{.major_radius = 0.08f, .minor_radius = 0.03f})};
    std::vector<std::shared_ptr<const BrickSet>> sets;
    for (const Edit& kind : kinds) {
        // As finely as the world: what differs then is how rays find them.
        auto made = BrickSet::make(field::worlds::compiled({kind}), ground.options.voxel_size);
        ASSERT_TRUE(made);
        sets.push_back(*made);
    }
    for (const bool high : {false, true}) {
        Frame moving = frame_of(ground, high ? vec3{0, 5, 4.5f} : vec3{0.3f, 0.7f, 3.9f});
        moving.camera.target = {0, 0.2f, 0};
        field::worlds::World all = ground;
        Random r(11);
        for (int i = 0; i < 1000; ++i) {
            const Pose pose{{r.in(-3.8f, 3.8f), r.in(0.05f, 0.8f), r.in(-3.8f, 3.8f)},
                            axis_angle(r.direction(), r.in(-3, 3))};
            moving.instances.push_back({.bricks = sets[size_t(i % 3)], .pose = pose, .before = pose});
            all.edits.push_back(at(kinds[i % 3], pose));
        }
        Frame still = frame_of(all);
        still.camera = moving.camera;
        const RenderSettings settings{.width = 150, .height = 90, .view = View::Depth, .refine = false};
        auto a = renderer->render(still, settings);
        ASSERT_TRUE(a) << a.error().message;
        const double evaluations = double(renderer->stats().evaluations);
        auto b = renderer->render(moving, settings);
        ASSERT_TRUE(b) << b.error().message;
        const double ratio = double(renderer->stats().evaluations) / evaluations;
        EXPECT_LE(ratio, 1.3) << (high ? "from above" : "from the ground");
        EXPECT_GE(ratio, 0.5);
        int off = 0;
        for (size_t i = 0; i < a->depth.size(); ++i)
            off += std::isinf(a->depth[i]) != std::isinf(b->depth[i]) || std::fabs(a->depth[i] - b->depth[i]) > 0.05f;
        EXPECT_LE(off, int(a->depth.size()) / 16) << "the same surfaces, but for silhouettes";
    }
}

TEST(InstancePicturesGpu, TheExactPathDrawsTheSameAndIsTheHardUnionOfMovedPrograms) {
    auto renderer = renderer_or_skip();
    if (!renderer) GTEST_SKIP();
    Pair pair = pair_of(on_ground());
    const RenderSettings exact{.width = 48, .height = 36, .analytic = true};
    auto b = renderer->render(pair.instances, exact);
    ASSERT_TRUE(b) << b.error().message;
    EXPECT_EQ(renderer->stats().instances, 6);
    auto a = renderer->render(pair.edits, exact);
    ASSERT_TRUE(a) << a.error().message;
    // One solid by two ways through floats.
    int off = 0;
    for (size_t i = 0; i < a->depth.size(); ++i)
        off += std::isinf(a->depth[i]) != std::isinf(b->depth[i]) ||
               (!std::isinf(a->depth[i]) && std::fabs(a->depth[i] - b->depth[i]) > 1e-4f * a->depth[i]);
    EXPECT_LE(off, 2);
    EXPECT_LE(image::flip(rgb_of(*a), rgb_of(*b)), 0.002);
}

TEST(InstancePicturesGpu, StandAmongTheLevelsOfAClipmap) {
    auto renderer = renderer_or_skip();
    if (!renderer) GTEST_SKIP();
    field::worlds::World base = on_ground();
    const Pair pair = pair_of(base);
    const vec3 eye = pair.edits.camera.position;
    const auto levels_of = [&](const std::vector<Edit>& edits) {
        auto map =
            field::Clipmap::make(field::worlds::compiled(edits), {.voxel_size = 0.012f, .levels = 4, .cells = 64},
                                 {double(eye.x), double(eye.y), double(eye.z)});
        EXPECT_TRUE(map);
        map->work();
        return std::make_shared<const field::Clipmap>(std::move(*map));
    };
    Frame edits = pair.edits, instances = pair.instances;
    edits.field = instances.field = nullptr;
    instances.levels = levels_of(base.edits);
    for (const auto& [thing, pose] : things()) base.edits.push_back(at(thing, pose));
    edits.levels = levels_of(base.edits);
    const RenderSettings settings{.width = 160, .height = 120};
    auto a = renderer->render(edits, settings);
    ASSERT_TRUE(a) << a.error().message;
    auto b = renderer->render(instances, settings);
    ASSERT_TRUE(b) << b.error().message;
    int off = 0;
    for (size_t i = 0; i < a->depth.size(); ++i)
        off += !(a->depth[i] == b->depth[i] || std::fabs(a->depth[i] - b->depth[i]) <= 0.003f);
    EXPECT_LE(off, 60);
    EXPECT_LE(image::flip(rgb_of(*a), rgb_of(*b)), 0.006);
}

TEST_F(InstancesGpu, RefinedPointsAreTheSameOnHostAndDevice) {
    Pair pair = pair_of(field::worlds::blends());
    for (Instance& i : pair.instances.instances) i.pose.position = i.pose.position + vec3{0.3f, 0.2f, 0.5f};
    GpuField gpu(*runner_);
    GpuInstances instances(*runner_, gpu);
    instances.reserve(pair.instances.instances);
    rhi::must(gpu.update(pair.instances.field, Baker::Host));
    rhi::must(instances.update(pair.instances.instances));
    const FrameParams p = rhi::must(frame_params(pair.instances, {.width = 96, .height = 72}, gpu));
    instances.place(pair.instances.instances, p);
    Graph g(*runner_);
    TileInputs in;
    in.field = gpu.import(g);
    in.instances = instances.import(g);
    in.frame = g.block(p);
    const FrameRay no_ray{};
    in.rays = g.upload("rays", std::span<const FrameRay>(&no_ray, 1));
    in.size = {96, 72};
    in.use_of_bricks = gpu.use(false);
    in.has_instances = true;
    const Visibility seen = march(g, in);
    Image refined = refine(g, in, seen.words);
    refine_instances(g, in, seen.words, refined);
    const Readback words = g.readback(seen.words), kernel = g.readback(refined);
    rhi::must(runner_->execute(g));
    const auto visible = rhi::must(words.get_as<uint32_t>()), by_kernel = rhi::must(kernel.get_as<uint32_t>());
    std::vector<uint32_t> by_host(visible.size(), kNotRefined);
    refine_instances_on_host(instances, p, visible, by_host);
    int found = 0, moved = 0, apart = 0, off = 0;
    const vec3 eye{p.camera.eye.x, p.camera.eye.y, p.camera.eye.z};
    for (size_t i = 0; i + 3 < visible.size(); i += 4) {
        if (visible[i + 1] >> 28 != kSeenInstance) continue;
        ++found;
        apart += (by_host[i] == kNotRefined) != (by_kernel[i] == kNotRefined);
        if (by_host[i] == kNotRefined || by_kernel[i] == kNotRefined) continue;
        ++moved;
        const float t = std::bit_cast<float>(by_host[i]);
        apart += std::fabs(t - std::bit_cast<float>(by_kernel[i])) > 0.005f ||
                 dot(shade::unpack_unit(by_host[i + 1]), shade::unpack_unit(by_kernel[i + 1])) < 0.999f ||
                 by_host[i + 2] != by_kernel[i + 2];
        const int x = int(i / 4) % p.tile_width, y = int(i / 4) / p.tile_width;
        const vec3 d = shade::camera_direction_at(p.camera, float(x) + 0.5f, float(y) + 0.5f);
        const Instance& instance = pair.instances.instances[visible[i + 1] & 0x0fffffffu];
        const vec3 local = inverse(instance.pose) * (eye + d * (t * p.grid.voxel_size));
        const auto tape = sdf::view(instance.bricks->program());
        off += std::fabs(sdf::evaluate(tape, {double(local.x), double(local.y), double(local.z)})) >
               0.02 * double(instance.bricks->voxel_size());
    }
    EXPECT_GT(found, 400);
    EXPECT_GE(moved, found * 97 / 100);
    EXPECT_LE(apart, found / 100);
    EXPECT_EQ(off, 0);
}

// Rays that start inside glass meet its surface from inside, where the distance grows along them: on the device, whatever it would do in a frame.
TEST_F(InstancesGpu, RaysInsideGlassAreRefinedToWhereTheyLeaveIt) {
    const float radius = 0.4f;
    Frame frame = frame_of(field::worlds::sphere_of(10));
    frame.materials[1].opacity = 0.1f;
    Instance ball;
    ball.bricks = rhi::must(
        field::BrickSet::make(field::worlds::compiled({field::worlds::edit(Sphere{.radius = radius})}), 0.05f));
    ball.pose = ball.before = {{1.6f, 0.7f, 0.3f}, axis_angle(normalize(vec3{1, 2, 0.5f}), 0.8f)};
    ball.material = ball.glass = 1;
    frame.instances = {ball};
    GpuField gpu(*runner_);
    GpuInstances instances(*runner_, gpu);
    instances.reserve(frame.instances);
    rhi::must(gpu.update(frame.field, Baker::Host));
    rhi::must(instances.update(frame.instances));
    FrameParams p = rhi::must(frame_params(frame, {.width = 24, .height = 16}, gpu));
    p.flags |= kFrameRays;
    instances.place(frame.instances, p, frame.materials);
    field::worlds::Random random(3);
    std::vector<FrameRay> rays;
    std::vector<vec3> from, to;
    const float h = p.grid.voxel_size;
    for (int i = 0; i < p.width * p.height; ++i) {
        const vec3 at = ball.pose.position + random.direction() * (radius * random.in(0, 0.9f)), d = random.direction();
        FrameRay r{};
        r.within = 1;
        r.whole_x = int(std::floor(at.x / h)), r.part_x = at.x / h - float(r.whole_x);
        r.whole_y = int(std::floor(at.y / h)), r.part_y = at.y / h - float(r.whole_y);
        r.whole_z = int(std::floor(at.z / h)), r.part_z = at.z / h - float(r.whole_z);
        r.direction_x = d.x, r.direction_y = d.y, r.direction_z = d.z;
        rays.push_back(r);
        from.push_back(at - ball.pose.position);
        to.push_back(d);
    }
    Graph g(*runner_);
    TileInputs in;
    in.field = gpu.import(g);
    in.instances = instances.import(g).of_glass();
    in.frame = g.block(p);
    in.rays = g.upload("rays", std::span<const FrameRay>(rays));
    in.size = {uint32_t(p.width), uint32_t(p.height)};
    // Nothing solid: the words of rays that met nothing.
    std::vector<uint32_t> nothing;
    for (size_t i = 0; i < rays.size(); ++i)
        nothing.insert(nothing.end(), {std::bit_cast<uint32_t>(field::kFarVoxels), kSeenNothing << 28, 0u, 0u});
    Image solid = g.create("solid", {.size = in.size, .format = rhi::Format::Rgba32Uint});
    std::vector<uint32_t> rows(size_t(p.height) * 128);  // rows of whole 256 bytes
    for (size_t i = 0; i < nothing.size(); ++i) rows[i / 96 * 128 + i % 96] = nothing[i];
    const CopyRegion all{.bytes_per_row = 512, .rows_per_layer = in.size.height, .size = in.size};
    g.copy(g.upload("solid", std::span<const uint32_t>(rows)), solid, std::span(&all, 1));
    const Image seen = march_glass(g, in, solid);
    Image refined = g.create("refined", {.size = in.size, .format = rhi::Format::Rgba32Uint});
    refine_instances(g, in, seen, refined);
    const Readback words = g.readback(seen), kernel = g.readback(refined);
    rhi::must(runner_->execute(g));
    const auto visible = rhi::must(words.get_as<uint32_t>()), by_kernel = rhi::must(kernel.get_as<uint32_t>());
    double worst_before = 0, worst = 0;
    int refused = 0;
    for (size_t i = 0; i < rays.size(); ++i) {
        ASSERT_EQ(visible[4 * i + 1] >> 28, kSeenInstance) << i;
        if (by_kernel[4 * i] == kNotRefined) {
            ++refused;
            continue;
        }
        const double b = double(dot(from[i], to[i])), c = double(dot(from[i], from[i])) - double(radius * radius);
        const double exact = std::sqrt(b * b - c) - b;
        const auto off = [&](uint32_t word) {
            return std::fabs(double(std::bit_cast<float>(word)) * double(h) - exact);
        };
        worst_before = std::max(worst_before, off(visible[4 * i]));
        worst = std::max(worst, off(by_kernel[4 * i]));
        const vec3 n = (from[i] + to[i] * float(exact)) * (1 / radius);
        EXPECT_GT(dot(shade::unpack_unit(by_kernel[4 * i + 1]), n), 0.9999f) << "outwards, whoever looks";
    }
    EXPECT_LE(refused, int(rays.size() / 100));
    EXPECT_GT(worst_before, 1e-4) << "bricks alone must be worse";
    EXPECT_LT(worst, 2e-5);
}

TEST_F(InstancesGpu, AMaterialFillsInWhereTheObjectHasNone) {
    auto renderer = renderer_or_skip();
    if (!renderer) GTEST_SKIP();
    Frame frame = frame_of(field::worlds::sphere_of(4));
    const auto set = set_of({edit(Sphere{.radius = 0.3f})}, 0.05f);
    for (const bool refine : {true, false}) {
        frame.instances = {{.bricks = set, .pose = {frame.camera.position * 0.5f, {}}, .before = {}, .material = 4}};
        auto seen = renderer->render(frame, {.width = 16, .height = 16, .view = View::Albedo, .refine = refine});
        ASSERT_TRUE(seen);
        const size_t middle = 4 * (8 * 16 + 8);
        EXPECT_NEAR(seen->rgba[middle], 0.3f, 0.01f);
        EXPECT_NEAR(seen->rgba[middle + 1], 0.7f, 0.01f);
    }
}

// One frame before, everything was where `before` says: what the motion pass of a frame asks.
TEST_F(InstancesGpu, RecordsTakeAPointToWhereItWas) {
    Random r(9);
    const auto set = set_of({edit(Box{.half_extents = {0.3f, 0.2f, 0.1f}})}, 0.05f);
    GpuField gpu(*runner_);
    GpuInstances instances(*runner_, gpu);
    FrameParams frame{};
    frame.grid.voxel_size = 0.05f;
    frame.eye_x = 2000000, frame.eye_y = -30, frame.eye_z = 7;  // 100 km out
    frame.eye_part_x = 0.25f;
    const double voxel_of_frame = double(frame.grid.voxel_size);
    const dvec3 eye{(2000000 + 0.25) * voxel_of_frame, -30 * voxel_of_frame, 7 * voxel_of_frame};
    for (int n = 0; n < 50; ++n) {
        const vec3 near{float(eye.x) + r.in(-9, 9), r.in(-9, 9), r.in(-9, 9)};
        const Instance i{.bricks = set,
                         .pose = {near, axis_angle(r.direction(), r.in(-3, 3))},
                         .before = {near + r.point(0.5f), axis_angle(r.direction(), r.in(-3, 3))}};
        const std::vector<Instance> list{i};
        instances.reserve(list);
        instances.place(list, frame);
        const InstanceRecord& record = instances.records().front();
        const vec3 local = r.point(0.3f);
        const double h = voxel_of_frame;
        const auto from_eye = [&](const Pose& pose) {
            const vec3 turned = rotate(pose.rotation, local);
            return dvec3{(double(pose.position.x) + double(turned.x) - eye.x) / h,
                         (double(pose.position.y) + double(turned.y) - eye.y) / h,
                         (double(pose.position.z) + double(turned.z) - eye.z) / h};
        };
        const dvec3 now = from_eye(i.pose), was = from_eye(i.before);
        const auto moved = [&](vec4 row) {
            return double(row.x) * now.x + double(row.y) * now.y + double(row.z) * now.z + double(row.w);
        };
        EXPECT_NEAR(moved(record.before_x), was.x, 1e-3);
        EXPECT_NEAR(moved(record.before_y), was.y, 1e-3);
        EXPECT_NEAR(moved(record.before_z), was.z, 1e-3);
        // And into the object's voxels, which does not suffer from being far out.
        const auto inside = [&](int whole, vec4 row) {
            return double(whole) + double(row.w) +
                   double(record.voxels) * (double(row.x) * now.x + double(row.y) * now.y + double(row.z) * now.z);
        };
        const double voxel = double(set->voxel_size());
        EXPECT_NEAR(inside(record.eye_x, record.x), double(local.x) / voxel, 2e-2 * 0.05 / voxel);
        EXPECT_NEAR(inside(record.eye_y, record.y), double(local.y) / voxel, 2e-2 * 0.05 / voxel);
        EXPECT_NEAR(inside(record.eye_z, record.z), double(local.z) / voxel, 2e-2 * 0.05 / voxel);
    }
}

// The same from the screen: what the motion pass makes of an object that turned and went while the camera stood still.
TEST_F(InstancesGpu, MotionIsWhereTheSurfaceWasOnTheScreen) {
    Frame frame = frame_of(on_ground());
    const Pose now{{0.2f, 0.9f, 0.7f}, axis_angle(normalize(vec3{1, 2, 0.5f}), 0.7f)};
    const Pose was{{0.05f, 0.85f, 0.6f}, axis_angle(normalize(vec3{1, 2, 0.5f}), 0.4f)};
    frame.instances = {
        {.bricks = set_of({edit(Box{.half_extents = {0.5f, 0.3f, 0.4f}})}, 0.04f), .pose = now, .before = was}};
    GpuField gpu(*runner_);
    GpuInstances instances(*runner_, gpu);
    instances.reserve(frame.instances);
    rhi::must(gpu.update(frame.field, Baker::Host));
    rhi::must(instances.update(frame.instances));
    const FrameParams p = rhi::must(frame_params(frame, {.width = 64, .height = 48, .refine = false}, gpu));
    instances.place(frame.instances, p);
    Graph g(*runner_);
    TileInputs in;
    in.field = gpu.import(g);
    in.instances = instances.import(g);
    in.frame = g.block(p);
    const FrameRay no_ray{};
    in.rays = g.upload("rays", std::span<const FrameRay>(&no_ray, 1));
    in.size = {64, 48};
    in.motion = g.block(motion_params(frame.camera, frame.camera, 64, 48));
    in.has_instances = true;
    const Visibility seen = march(g, in);
    const Readback words = g.readback(seen.words), moved = g.readback(motion(g, in, seen.words));
    rhi::must(runner_->execute(g));
    const auto visible = rhi::must(words.get_as<uint32_t>());
    const auto halves = rhi::must(moved.get_as<uint16_t>());
    int found = 0;
    double largest = 0;
    for (size_t i = 0; i < visible.size(); i += 4) {
        const double mx = double(float_from_half(halves[i])), my = double(float_from_half(halves[i + 1]));
        if (visible[i + 1] >> 28 != kSeenInstance) {
            EXPECT_EQ(std::hypot(mx, my), 0) << "the world stood still";
            continue;
        }
        ++found;
        const float x = float(i / 4 % 64) + 0.5f, y = float(i / 4 / 64) + 0.5f;
        const float t = std::bit_cast<float>(visible[i]) * p.grid.voxel_size;
        const vec3 to = shade::camera_direction_at(p.camera, x, y) * t;
        const vec3 then = was * (inverse(now) * (frame.camera.position + to)) - frame.camera.position;
        const vec2 at = shade::camera_pixel(p.camera, then);
        largest = std::max(largest, std::hypot(mx, my));
        EXPECT_NEAR(mx, double(at.x - x), 0.01);
        EXPECT_NEAR(my, double(at.y - y), 0.01);
    }
    EXPECT_GT(found, 100);
    EXPECT_GT(largest, 2);
}

}  // namespace
}  // namespace kiln::render
