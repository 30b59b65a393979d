// SPDX-License-Identifier: MIT
// Points of bricks, moved to the exact surface: the kernel and its twin on the host, against the program.
#include "gpu_worlds.h"
#include "render/lib/octahedral.gpu.h"
#include "render/passes/refine.gpu.h"
#include "sdf/eval.h"

#include <bit>
#include <cmath>

namespace kiln::render {
namespace {

struct RefineGpu : GpuTest {
    struct Words {
        std::vector<uint32_t> seen, by_kernel, by_host;
    };
    Words refined(GpuField& gpu, const FrameParams& p) {
        Graph g(*runner_);
        TileInputs in;
        in.field = gpu.import(g);
        in.frame = g.block(p);
        const FrameRay no_ray{};
        in.rays = g.upload("rays", std::span<const FrameRay>(&no_ray, 1));
        in.size = {uint32_t(p.tile_width), uint32_t(p.tile_height)};
        in.use_of_bricks = gpu.use(false);
        const Visibility seen = march(g, in);
        const Readback words = g.readback(seen.words);
        const Readback kernel = g.readback(refine(g, in, seen.words));
        rhi::must(runner_->execute(g));
        Words out{rhi::must(words.get_as<uint32_t>()), rhi::must(kernel.get_as<uint32_t>()), {}};
        out.by_host = refine_on_host(gpu.code_of_bricks(), p, out.seen);
        return out;
    }
};

TEST_F(RefineGpu, PointsLieOnTheSurfaceAndHostAndDeviceAgree) {
    for (const auto& world : {field::worlds::blends(), field::worlds::boxes()}) {
        const auto f = world.field();
        GpuField gpu(*runner_);
        rhi::must(gpu.update(f, Baker::Host));
        FrameParams p = rhi::must(frame_params(frame_of(world), {.width = 64, .height = 48, .accelerate = true}, gpu));
        const Words words = refined(gpu, p);
        const float h = p.grid.voxel_size;
        int found = 0, moved = 0, apart = 0, off = 0, turned = 0, other = 0;
        for (size_t i = 0; i + 3 < words.seen.size(); i += 4) {
            const bool brick = words.seen[i + 1] >> 28 == kSeenBrick;
            const uint32_t* const host = &words.by_host[i];
            const uint32_t* const kernel = &words.by_kernel[i];
            if (!brick) {
                EXPECT_EQ(host[0], kNotRefined);
                EXPECT_EQ(kernel[0], kNotRefined);
                continue;
            }
            ++found;
            if (host[0] == kNotRefined || kernel[0] == kNotRefined) {
                apart += host[0] != kernel[0];
                continue;
            }
            ++moved;
            const float t = std::bit_cast<float>(host[0]);
            apart += std::fabs(t - std::bit_cast<float>(kernel[0])) > 0.02f;
            turned += dot(shade::unpack_unit(host[1]), shade::unpack_unit(kernel[1])) < 0.999f;
            other += (host[2] & 0xffffu) != (kernel[2] & 0xffffu);
            const int x = int(i / 4) % p.tile_width, y = int(i / 4) / p.tile_width;
            const vec3 d = shade::camera_direction_at(p.camera, float(x) + 0.5f, float(y) + 0.5f);
            const vec3 eye{p.camera.eye.x, p.camera.eye.y, p.camera.eye.z};
            const vec3 at = eye + d * (t * h);
            off += std::fabs(sdf::evaluate(sdf::view(f->program()), {at.x, at.y, at.z})) > 0.012 * double(h);
        }
        EXPECT_GT(found, 200) << world.name;
        EXPECT_GE(moved, found * 97 / 100) << world.name;
        EXPECT_EQ(off, 0) << world.name << ": not on the surface of the whole program";
        EXPECT_LE(apart, found / 200) << world.name;
        EXPECT_LE(turned, found / 100) << world.name;
        EXPECT_LE(other, found / 200) << world.name;
    }
}

// Whatever other points of its brick are asked, and whatever was asked before.
TEST_F(RefineGpu, APointIsRefinedAloneAsAmongOthers) {
    // So far off that the step of a gradient follows from the place.
    const field::worlds::World world{"far",
                                     {field::worlds::edit(Sphere{.radius = 0.5f}, {49.7f, 0, 0}),
                                      field::worlds::edit(Sphere{.radius = 0.4f}, {50.4f, 0.1f, 0}, Op::Union, 0.3f)},
                                     {.voxel_size = 0.04f, .bounds = {{48.6f, -1.4f, -1.4f}, {51.4f, 1.4f, 1.4f}}}};
    GpuField gpu(*runner_);
    rhi::must(gpu.update(world.field(), Baker::Host));
    Frame frame = frame_of(world, {50.9f, 0.7f, 1.1f});
    frame.camera.target = {50, 0, 0};
    const FrameParams p = rhi::must(frame_params(frame, {.width = 96, .height = 64, .accelerate = true}, gpu));
    const Words all = refined(gpu, p);
    int found = 0;
    for (const size_t every : {1, 5, 37, 301}) {
        std::vector<uint32_t> some = all.seen;
        for (size_t i = 0; i < some.size() / 4; ++i)
            if (i % every != 0) some[4 * i + 1] = kSeenNothing << 28;
        const std::vector<uint32_t> alone = refine_on_host(gpu.code_of_bricks(), p, some);
        for (size_t i = 0; i < some.size() / 4; i += every) {
            found += alone[4 * i] != kNotRefined;
            for (size_t word = 4 * i; word < 4 * i + 4; ++word)
                ASSERT_EQ(alone[word], all.by_host[word]) << "pixel " << i << " of every " << every;
        }
    }
    EXPECT_GT(found, 2000);
}

// Sand that dives into water: a point of the shore has the normal of what it is made of, however near the other is.
TEST_F(RefineGpu, WhereMaterialsMeetEachKeepsItsNormal) {
    field::worlds::World shore;
    shore.options.voxel_size = 0.05f;
    shore.options.bounds = {{-1.5f, -0.5f, -1.5f}, {1.5f, 1, 1.5f}};
    shore.edits = {field::worlds::of_material(field::worlds::edit(Ellipsoid{.radii = {1.2f, 0.5f, 0.7f}}), 3),
                   field::worlds::of_material(field::worlds::edit(Plane{}, {0, 0.05f, 0}), 2)};
    const auto f = shore.field();
    GpuField gpu(*runner_);
    rhi::must(gpu.update(f, Baker::Host));
    Frame frame = frame_of(shore, {0.4f, 1.2f, 2.6f});
    frame.camera.target = {0, 0.05f, 0.67f};
    frame.camera.fov_y_deg = 4;  // the shore alone
    FrameParams p = rhi::must(frame_params(frame, {.width = 96, .height = 96, .accelerate = true}, gpu));
    const Words words = refined(gpu, p);
    const float h = p.grid.voxel_size;
    for (const auto* refined : {&words.by_host, &words.by_kernel}) {
        int water = 0, sand = 0, near = 0;
        for (size_t i = 0; i + 3 < words.seen.size(); i += 4) {
            const uint32_t* const word = &(*refined)[i];
            if (words.seen[i + 1] >> 28 != kSeenBrick || word[0] == kNotRefined) continue;
            const vec3 n = shade::unpack_unit(word[1]);
            const vec3 d = shade::camera_direction_at(p.camera, float(i / 4 % 96) + 0.5f, float(i / 4 / 96) + 0.5f);
            const vec3 at =
                vec3{p.camera.eye.x, p.camera.eye.y, p.camera.eye.z} + d * (std::bit_cast<float>(word[0]) * h);
            const bool is_water = (word[2] & 0xffffu) == sdf::material_number(shore.edits[1].node.material);
            // Of the ellipsoid x²/a² + y²/b² + z²/c² = 1.
            const vec3 g{at.x / (1.2f * 1.2f), at.y / 0.25f, at.z / 0.49f};
            const vec3 expected = is_water ? vec3{0, 1, 0} : normalize(g);
            ASSERT_GT(dot(n, expected), 0.999f) << (is_water ? "water" : "sand") << " at " << at.x << " " << at.y << " "
                                                << at.z << " has " << n.x << " " << n.y << " " << n.z;
            ++(is_water ? water : sand);
            near += std::fabs(at.y - 0.05f) < 0.1f * h && std::fabs(dot(g, at) - 1) < 0.3f * h;
        }
        EXPECT_GT(water, 500);
        EXPECT_GT(sand, 500);
        EXPECT_GT(near, 50) << "nothing at the crease";
    }
}

TEST(Refine, StepsEndOnPlanesAndCreasesSeenAtAnyAngle) {
    // Distance along a ray to a plane, and to the corner of two of them.
    for (const float slope : {-1.0f, -0.5f, -0.1f, -0.03f}) {
        for (const float first : {-0.9f, -0.2f, 0.3f, 0.8f}) {
            const auto distance = [&](float t) { return std::max(slope * t, 0.8f * slope * (t - 0.1f)); };
            float t = first, t_before = t, d_before = 0;
            for (int i = 0; i < kRefineSteps; ++i) {
                const float d = distance(t), next = refine_next(i, t_before, d_before, t, d);
                t_before = t, d_before = d, t = next;
            }
            EXPECT_TRUE(refine_holds(first, t, distance(t))) << slope << " from " << first << ": " << distance(t);
        }
    }
    EXPECT_FALSE(refine_holds(0, 0, 0.02f));
    EXPECT_FALSE(refine_holds(0, 7, 0));
}

}  // namespace
}  // namespace kiln::render
