// SPDX-License-Identifier: MIT
// Gates G1 and G4 on the GPU: rays of all kinds through the march kernel against the double-precision reference, and with and
// without jumps.
#include "field/reference_ray.h"
#include "gpu_worlds.h"

#include <bit>
#include <cmath>

namespace kiln::render {
namespace {

using field::ivec3;
using field::worlds::Random;

struct MarchGpu : GpuTest {
    struct Seen {
        float t;
        uint32_t state, slot, voxel;
        friend bool operator==(const Seen&, const Seen&) = default;
    };

    std::vector<Seen> march_rays(GpuField& gpu, const std::vector<FrameRay>& rays, bool accelerate) {
        const uint32_t width = 64, height = uint32_t(rays.size()) / width;
        FrameParams p{};
        p.grid = gpu.grid();
        p.distance_scale = gpu.distance_scale();
        p.width = p.tile_width = int(width);
        p.height = p.tile_height = int(height);
        p.flags = kFrameRays | (accelerate ? kFrameAccelerate : 0u);
        Graph g(*runner_);
        TileInputs in;
        in.field = gpu.import(g);
        in.frame = g.block(p);
        in.rays = g.upload("rays", std::span<const FrameRay>(rays));
        in.size = {width, height};
        const Visibility seen = march(g, in);
        const Readback words = g.readback(seen.words);
        rhi::must(runner_->execute(g));
        const auto all = rhi::must(words.get_as<uint32_t>());
        std::vector<Seen> out;
        for (size_t i = 0; i + 3 < all.size(); i += 4) {
            out.push_back({std::bit_cast<float>(all[i]), all[i + 1] >> 28, all[i + 1] & 0x0fffffffu, all[i + 2]});
        }
        return out;
    }
};

// From outside and within, parallel to axes, along planes and edges of the lattice.
FrameRay random_ray(Random& r, const field::GridParams& g, bool& special) {
    const auto inside = [&](int first, int size) { return float(first * 7) + r.in(0, float(size * 7)); };
    vec3 target{inside(g.cell_x, g.size_x), inside(g.cell_y, g.size_y), inside(g.cell_z, g.size_z)};
    vec3 d = r.direction();
    const int kind = r.below(8);
    special = kind < 3;
    if (kind == 0) d = {r.below(2) == 0 ? 1.0f : -1.0f, 0, 0};
    if (kind == 1) d = normalize(vec3{0, r.in(-1, 1), r.in(-1, 1)});
    if (kind <= 2) target = {std::round(target.x), r.below(2) == 0 ? std::round(target.y) : target.y, target.z};
    const float away = kind == 3 ? 0.0f : r.in(50, 400);
    const vec3 from = target - d * away;
    FrameRay ray{};
    ray.whole_x = int(std::floor(from.x)), ray.whole_y = int(std::floor(from.y)), ray.whole_z = int(std::floor(from.z));
    ray.part_x = from.x - float(ray.whole_x), ray.part_y = from.y - float(ray.whole_y),
    ray.part_z = from.z - float(ray.whole_z);
    ray.direction_x = d.x, ray.direction_y = d.y, ray.direction_z = d.z;
    return ray;
}

TEST_F(MarchGpu, HitsAreTheReferencesAndJumpsChangeNone) {
    using namespace field::worlds;
    for (const World& world : {sphere_of(10), boxes(), blends(), thin_walls()}) {
        const auto f = world.field();
        const field::HostBricks bricks = field::HostBricks::bake(f);
        GpuField gpu(*runner_);
        rhi::must(gpu.update(f, Baker::Host));
        Random r(3);
        std::vector<FrameRay> rays;
        std::vector<char> specials;
        for (int i = 0; i < 4096; ++i) {
            bool special = false;
            rays.push_back(random_ray(r, f->grid(), special));
            specials.push_back(special);
        }
        const auto fast = march_rays(gpu, rays, true);
        const auto slow = march_rays(gpu, rays, false);
        int mismatches = 0, hits = 0, tangent = 0, special_tangent = 0, far = 0, differ = 0;
        double worst = 0;
        for (size_t i = 0; i < rays.size(); ++i) {
            differ += !(fast[i] == slow[i]);
            const FrameRay& q = rays[i];
            const field::TexelRay ray =
                field::texel_ray(ivec3{q.whole_x, q.whole_y, q.whole_z}, vec3{q.part_x, q.part_y, q.part_z},
                                 vec3{q.direction_x, q.direction_y, q.direction_z});
            const field::ReferenceHit expected = field::reference_ray(bricks, ray, 1e5);
            if (expected.least < 1e-4) {
                (specials[i] ? special_tangent : tangent) += 1;
                continue;
            }
            const uint32_t state = expected.state == field::kMarchHit
                                       ? kSeenBrick
                                       : (expected.state == field::kMarchMiss ? kSeenNothing : kSeenInside);
            mismatches += fast[i].state != state;
            if (fast[i].state != state || state == kSeenNothing) continue;
            ++hits;
            const double off = std::fabs(double(fast[i].t) - expected.t);
            worst = std::max(worst, off);
            far += off > 1e-4;
        }
        EXPECT_EQ(mismatches, 0) << world.name;
        EXPECT_EQ(far, 0) << world.name << ": worst " << worst << " voxels";
        EXPECT_EQ(differ, 0) << world.name << ": with and without jumps";
        EXPECT_GT(hits, 100) << world.name;
        EXPECT_LE(tangent, 4) << world.name;
    }
}

}  // namespace
}  // namespace kiln::render
