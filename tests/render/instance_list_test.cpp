// SPDX-License-Identifier: MIT
// The lists of instances that rays of a workgroup share, against each ray's own walk of the tree: the same hits to the bit, for no more work.
#include "gpu_worlds.h"

#include "field/brick_set.h"
#include "render/gpu_instances.h"
#include "render/passes/passes.h"

#include <algorithm>

namespace kiln::render {
namespace {

using field::BrickSet;
using field::worlds::edit;
using field::worlds::Random;

struct Marched {
    std::vector<uint32_t> words;  // what was seen, without what it cost
    uint64_t voxels = 0;
    int on_instances = 0, tiles_by_tree = 0, tiles = 0;
};

class InstanceListGpu : public GpuTest {
protected:
    void SetUp() override {
        GpuTest::SetUp();
        if (!runner_) return;
        const Edit kinds[] = {edit(Sphere{.radius = 0.09f}), edit(Box{.half_extents = {0.1f, 0.06f, 0.08f}}),
                              edit(Torus{.major_radius = 0.08f, .minor_radius = 0.03f})};
        for (const Edit& kind : kinds) sets_.push_back(*BrickSet::make(field::worlds::compiled({kind}), 0.03f));
        field::worlds::World ground;
        ground.options.voxel_size = 0.05f;
        ground.options.bounds = {{-3, -0.5f, -3}, {3, 1, 3}};
        ground.edits = {edit(Plane{}), edit(Sphere{.radius = 0.5f}, {0.4f, 0, -0.5f})};
        frame_ = frame_of(ground, {0.2f, 0.6f, 2.5f});
        frame_.camera.target = {0, 0.2f, 0};
        gpu_ = std::make_unique<GpuField>(*runner_);
        instances_ = std::make_unique<GpuInstances>(*runner_, *gpu_);
    }
    void TearDown() override {
        instances_.reset();
        gpu_.reset();
        GpuTest::TearDown();
    }

    void add(Random& r, int count, vec3 low, vec3 high) {
        for (int i = 0; i < count; ++i) {
            const Pose pose{{r.in(low.x, high.x), r.in(low.y, high.y), r.in(low.z, high.z)},
                            axis_angle(r.direction(), r.in(-3, 3))};
            frame_.instances.push_back({.bricks = sets_[size_t(i % 3)], .pose = pose, .before = pose});
        }
    }

    Marched marched(int width, int height, bool by_tree, const std::vector<FrameRay>& rays = {}) {
        instances_->reserve(frame_.instances);
        rhi::must(gpu_->update(frame_.field, Baker::Host));
        rhi::must(instances_->update(frame_.instances));
        FrameParams p = rhi::must(frame_params(frame_, {.width = width, .height = height}, *gpu_));
        if (!rays.empty()) p.flags |= kFrameRays;
        instances_->place(frame_.instances, p);
        Graph g(*runner_);
        TileInputs in;
        in.field = gpu_->import(g);
        in.instances = instances_->import(g);
        in.instances.by_tree = by_tree;
        in.frame = g.block(p);
        const std::vector<FrameRay> none(1);
        in.rays = g.upload("rays", std::span<const FrameRay>(rays.empty() ? none : rays));
        in.size = {uint32_t(width), uint32_t(height)};
        in.use_of_bricks = gpu_->use(false);
        in.has_instances = !instances_->nodes().empty();
        const Visibility seen = march(g, in);
        const Readback words = g.readback(seen.words), counted = g.readback(seen.evaluations.front());
        rhi::must(runner_->execute(g));
        Marched out;
        out.words = rhi::must(words.get_as<uint32_t>());
        for (size_t i = 0; i < out.words.size(); i += 4) {
            out.voxels += out.words[i + 3] >> 16;
            out.on_instances += out.words[i + 1] >> 28 == kSeenInstance;
            out.words[i + 3] = 0;
        }
        for (const uint32_t n : rhi::must(counted.get_as<uint32_t>())) {
            ++out.tiles;
            out.tiles_by_tree += (n & kWalkedTree) != 0;
        }
        return out;
    }

    // The picture by lists and by the tree: equal.
    Marched both_ways(int width, int height, const std::vector<FrameRay>& rays = {}) {
        const Marched list = marched(width, height, false, rays), tree = marched(width, height, true, rays);
        int other = 0;
        for (size_t i = 0; i < list.words.size(); ++i) other += list.words[i] != tree.words[i];
        EXPECT_EQ(other, 0) << "of " << list.words.size() << " words";
        EXPECT_LE(list.voxels, tree.voxels);
        if (!frame_.instances.empty()) {
            EXPECT_EQ(tree.tiles_by_tree, tree.tiles);
        }
        return list;
    }

    std::vector<std::shared_ptr<const BrickSet>> sets_;
    Frame frame_;
    std::unique_ptr<GpuField> gpu_;
    std::unique_ptr<GpuInstances> instances_;
};

TEST_F(InstanceListGpu, FindsWhatTheTreeFindsAtAnyResolution) {
    Random r(3);
    add(r, 400, {-1.5f, 0, -2}, {1.5f, 1, 2});
    for (const auto& [width, height] : {std::pair{96, 72}, {33, 17}, {9, 7}, {1, 1}}) {
        const Marched seen = both_ways(width, height);
        if (width == 96) {
            EXPECT_GT(seen.on_instances, 1000);
            EXPECT_EQ(seen.tiles_by_tree, 0);
        }
    }
}

TEST_F(InstanceListGpu, FindsWhatIsAroundTheEye) {
    Random r(4);
    const vec3 eye = frame_.camera.position;
    add(r, 40, eye - vec3{0.15f, 0.15f, 0.15f}, eye + vec3{0.15f, 0.15f, 0.15f});
    add(r, 60, {-1, 0, -2}, {1, 1, 2});
    both_ways(64, 48);
    // Within one of them, and nothing else of it is seen.
    frame_.instances.front().pose.position = eye;
    frame_.instances.front().bricks = sets_[0];
    const Marched inside = both_ways(64, 48);
    for (size_t i = 0; i < inside.words.size(); i += 4) ASSERT_EQ(inside.words[i], 0u) << "at once";
}

TEST_F(InstanceListGpu, NeverLosesOneWhereATileMeetsTooMany) {
    Random r(5);
    add(r, 3000, {-0.2f, 0.1f, -1}, {0.2f, 0.5f, 0.5f});
    add(r, 100, {-2, 0, -2}, {2, 1, 1});
    const Marched seen = both_ways(64, 48);
    EXPECT_GT(seen.tiles_by_tree, 0);
    EXPECT_LT(seen.tiles_by_tree, seen.tiles) << "only where they are";
}

TEST_F(InstanceListGpu, NoInstanceIsNoList) {
    const Marched seen = both_ways(40, 30);
    EXPECT_EQ(seen.on_instances, 0);
    EXPECT_EQ(seen.tiles_by_tree, 0);
}

// As through mirrors and glass: each ray begins elsewhere and goes its own way.
TEST_F(InstanceListGpu, FindsWhatTheTreeFindsForRaysOfAnyKind) {
    Random r(6);
    add(r, 400, {-1.5f, 0, -2}, {1.5f, 1, 2});
    constexpr int kWidth = 40, kHeight = 24;
    std::vector<FrameRay> rays;
    for (int i = 0; i < kWidth * kHeight; ++i) {
        const float tilt = 0.02f * float(i / 64 % 9);  // tiles differ in how far their rays go apart
        const vec3 d = normalize(vec3{r.in(-tilt, tilt), -0.3f + r.in(-tilt, tilt), -1});
        FrameRay ray{};
        ray.whole_x = int(r.in(-20, 20)), ray.whole_y = 10 + int(r.in(-tilt, tilt) * 10), ray.whole_z = 45;
        ray.part_x = r.in(0, 1), ray.part_y = 0.5f;
        ray.direction_x = d.x, ray.direction_y = d.y, ray.direction_z = d.z;
        rays.push_back(ray);
    }
    EXPECT_GT(both_ways(kWidth, kHeight, rays).on_instances, 200);
}

}  // namespace
}  // namespace kiln::render
