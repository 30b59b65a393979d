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
