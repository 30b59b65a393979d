// SPDX-License-Identifier: MIT
// Starts threads.
// Bricks that an update need not bake: none too many, and not so few that asking would be in vain.
#include "field/host_bricks.h"

#include "worlds.h"
#include "rounds.h"

#include <gtest/gtest.h>

#include <string>

namespace kiln::field {
namespace {

// Many small edits of one material, which blend or do not, in any order: what only_material() lets pass.
Edit small_edit(worlds::Random& r) {
    const Op ops[] = {Op::Union, Op::Union, Op::Union, Op::Subtract, Op::Subtract, Op::Intersect};
    const int kind = r.below(40);
    Edit out = worlds::edit(Sphere{.radius = r.in(0.02f, 0.15f)}, r.point(0.8f), ops[kind == 0 ? 5 : kind % 5],
                            r.below(2) == 0 ? r.in(0, 0.12f) : 0.0f);
    if (kind == 0) out.node.shape = Sphere{.radius = 1.5f};
    if (r.below(2) == 0 && kind != 0) out.node.shape = Box{.half_extents = {0.1f, r.in(0.01f, 0.1f), 0.05f}};
    if (r.below(4) == 0 && kind != 0) out.node.shape = Torus{.major_radius = r.in(0.05f, 0.1f), .minor_radius = 0.03f};
    return out;
}

TEST(StillTexels, WhatIsNotBakedIsWhatARebuildHas) {
    for (const uint32_t seed : {1u, 2u}) {
        worlds::Random r(seed);
        worlds::World world{"crowd", {}, {.voxel_size = 0.03f, .bounds = {{-0.9f, -0.9f, -0.9f}, {0.9f, 0.9f, 0.9f}}}};
        if (seed == 2) world.options.own_voxels = 4;
        for (int i = 0; i < 80; ++i) world.edits.push_back(small_edit(r));
        worlds::Live live(world.edits);
        HostBricks host = *HostBricks::build(live.program(), world.options);
        uint64_t baked = 0, without = 0;
        for (int step = 0; step < rounds(40); ++step) {
            std::vector<Edit>& edits = world.edits;
            for (int n = step % 7 == 0 ? 3 : 1; n-- > 0;) {
                const size_t at = size_t(r.below(int(edits.size())));
                switch (r.below(5)) {
                case 0:
                    edits.insert(edits.begin() + ptrdiff_t(at), small_edit(r));
                    break;
                case 1:
                    edits.erase(edits.begin() + ptrdiff_t(at));
                    break;
                case 2:
                    edits[at].node.transform.position = edits[at].node.transform.position + r.point(0.1f);
                    break;
                default:
                    edits.push_back(small_edit(r));
                    break;
                }
            }
            const std::vector<RowChange> changes = live.become(edits);
            without += (*Field::update(host.field(), live.program(), changes))->jobs().size();
            ASSERT_TRUE(host.update(live.program(), changes));
            baked += host.field().jobs().size();
            const HostBricks full = HostBricks::bake(world.field());
            ASSERT_EQ(host.hash(), full.hash()) << "seed " << seed << " step " << step;
        }
        EXPECT_LT(baked, without) << "seed " << seed;
    }
}

// Hollows just under a surface, and lumps just above: what comes and goes is near, in bricks that hold something else.
TEST(StillTexels, HollowsUnderASurfaceAreWhatARebuildHas) {
    worlds::Random r(9);
    worlds::World world{"ball", {}, {.voxel_size = 0.03f, .bounds = {{-0.8f, -0.8f, -0.8f}, {0.8f, 0.8f, 0.8f}}}};
    world.edits.push_back(worlds::edit(Sphere{.radius = 0.5f}, {}));
    worlds::Live live(world.edits);
    HostBricks host = *HostBricks::build(live.program(), world.options);
    for (int step = 0; step < 150; ++step) {
        std::vector<Edit>& edits = world.edits;
        if (edits.size() > 5) {
            edits.erase(edits.begin() + 1);
        } else {
            const bool cut = step % 3 != 0;
            const float radius = 0.03f * r.in(0.7f, 5), far = 0.03f * r.in(-1, 6) + radius;
            edits.push_back(worlds::edit(Sphere{.radius = radius},
                                         normalize(r.point(1)) * (cut ? 0.5f - far : 0.5f + 0.4f * far),
                                         cut ? Op::Subtract : Op::Union, step % 2 == 0 ? 0.04f : 0.0f));
        }
        const std::vector<RowChange> changes = live.become(edits);
        ASSERT_TRUE(host.update(live.program(), changes));
        ASSERT_EQ(host.hash(), HostBricks::bake(world.field()).hash()) << "step " << step;
    }
}

// Edits that blend with nothing come last, or before others: bricks are made of what they held where all later ones are of their kind.
TEST(StillTexels, WhatJoinsABrickIsWhatARebuildHas) {
    for (const float own : {1.0f, 4.0f}) {
        worlds::Random r(own > 1 ? 5 : 4);
        worlds::World world{
            "lumps",
            {},
            {.voxel_size = 0.03f, .bounds = {{-0.8f, -0.8f, -0.8f}, {0.8f, 0.8f, 0.8f}}, .own_voxels = own}};
        world.edits.push_back(worlds::edit(Sphere{.radius = 0.5f}, {}));
        worlds::Live live(world.edits);
        HostBricks host = *HostBricks::build(live.program(), world.options);
        uint64_t joined = 0;
        for (int step = 0; step < rounds(60); ++step) {
            std::vector<Edit>& edits = world.edits;
            if (edits.size() > 24) edits.erase(edits.begin() + 1, edits.begin() + 13);
            const Op op = r.below(2) == 0 ? Op::Union : Op::Subtract;
            Edit came = worlds::edit(Sphere{.radius = r.in(0.02f, 0.2f)}, normalize(r.point(1)) * r.in(0.3f, 0.6f), op,
                                     r.below(8) == 0 ? 0.05f : 0.0f);
            if (r.below(2) == 0) came.node.shape = Box{.half_extents = {0.1f, r.in(0.01f, 0.2f), 0.05f}};
            size_t at = edits.size();
            while (at > 1 && (r.below(3) != 0) && (edits[at - 1].op == op || r.below(4) == 0)) --at;
            edits.insert(edits.begin() + ptrdiff_t(at), came);
            const std::vector<RowChange> changes = live.become(edits);
            const BuildStats without = (*Field::update(host.field(), live.program(), changes))->stats();
            ASSERT_TRUE(host.update(live.program(), changes));
            const BuildStats& with = host.field().stats();
            const uint64_t stayed = without.bricks_baked - with.bricks_baked;
            joined += without.cells_evaluated - with.cells_evaluated - stayed;
            ASSERT_EQ(host.hash(), HostBricks::bake(world.field()).hash()) << "own " << own << " step " << step;
        }
        EXPECT_GT(joined, 0u) << "own " << own;
    }
}

// Between two balls that blend so widely that cells far from both become solid.
TEST(StillTexels, EmptyCellsThatABlendFillsAreNotPassedOver) {
    worlds::World world{"bridge", {}, {.voxel_size = 0.03f, .bounds = {{-0.9f, -0.5f, -0.5f}, {0.9f, 0.5f, 0.5f}}}};
    world.edits.push_back(worlds::edit(Sphere{.radius = 0.3f}, {-0.55f, 0, 0}));
    worlds::Live live(world.edits);
    HostBricks host = *HostBricks::build(live.program(), world.options);
    for (int step = 0; step < 24; ++step) {
        std::vector<Edit>& edits = world.edits;
        if (edits.size() > 1) {
            edits.pop_back();
        } else {
            edits.push_back(worlds::edit(Sphere{.radius = 0.3f},
                                         {0.45f + 0.015f * float(step / 2), 0.01f * float(step), 0}, Op::Union, 0.9f));
        }
        const std::vector<RowChange> changes = live.become(edits);
        ASSERT_TRUE(host.update(live.program(), changes));
        ASSERT_EQ(host.hash(), HostBricks::bake(world.field()).hash()) << "step " << step;
    }
}

}  // namespace
}  // namespace kiln::field
