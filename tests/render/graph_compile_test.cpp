// SPDX-License-Identifier: MIT
// Plans without a device: the golden plan, culling, levels, memory, and a fuzzer judged by graph_hazards.
#include "render/graph_hazards.h"
#include "render/graph_samples.h"

#include "golden.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <sstream>

namespace kiln::render::samples {
namespace {

Plan must_compile(const Graph& g, const CompileOptions& options = {}) {
    Result<Plan> plan = g.compile(options);
    EXPECT_TRUE(bool(plan)) << (plan ? "" : plan.error().message);
    return plan ? std::move(*plan) : Plan{};
}

void expect_golden(const std::string& name, const std::string& text) {
    const std::string path = std::string(KILN_SOURCE_DIR) + "/tests/golden/plans/" + name;
    std::stringstream golden;
    golden << std::ifstream(path).rdbuf();
    if (golden_accepted(name)) {
        std::ofstream(path) << text;
        return golden_renewed(name, "old -> new:\n" + golden.str() + "->\n" + text);
    }
    EXPECT_EQ(text, golden.str()) << "the plan is another one. If it should be, remake it and read the difference:\n"
                                  << "  ./test --accept " << name << " && git diff tests/golden/plans";
}

const rhi::TextureHandle kAtlas{1, 1};
const rhi::BufferHandle kExposure{1, 1};

void record_sample(Graph& g) { record_deferred_frame(g, kAtlas, kExposure, {640, 360}); }

TEST(GraphPlan, OfADeferredFrameIsTheGoldenOne) {
    Graph g;
    record_sample(g);
    expect_golden("deferred.txt", must_compile(g).text());
}

TEST(GraphPlan, OfADeferredFrameWithoutAliasingIsTheGoldenOne) {
    Graph g;
    record_sample(g);
    expect_golden("deferred_unaliased.txt", must_compile(g, {.aliasing = false}).text());
}

TEST(GraphPlan, IsTheSameForTheSameRecording) {
    Graph a, b;
    record_sample(a);
    record_sample(b);
    const Plan once = must_compile(a);
    EXPECT_EQ(once.text(), must_compile(b).text());
    EXPECT_EQ(once.text(), must_compile(a).text()) << "compile() changed the graph";
}

TEST(GraphPlan, OfADeferredFrameNeedsNoMoreThanSixTenthsOfItsTransients) {
    Graph g;
    record_sample(g);
    const Plan plan = must_compile(g);
    EXPECT_LE(plan.peak_bytes * 10, plan.unaliased_bytes * 6);
    const Plan apart = must_compile(g, {.aliasing = false});
    EXPECT_EQ(apart.peak_bytes, plan.unaliased_bytes);
}

TEST(GraphPlan, OfADeferredFrameHasNoHazards) {
    for (const bool poison : {false, true}) {
        Graph g;
        record_sample(g);
        const Plan plan = must_compile(g, {.poison = poison});
        EXPECT_EQ(joined(find_hazards({&plan, 1})), "");
        EXPECT_EQ(joined(find_cull_faults(g, plan)), "");
    }
}

// ---- barriers, one rule at a time

struct Small {
    Graph g;
    Image a = g.create("a", kSmall), b = g.create("b", kSmall), c = g.create("c", kSmall);
    void fill(Image& image) { g.dispatch(kFill, image.size, {g.write(image)}, FillPush{}); }
    void down(const Image& from, Image& to) { g.dispatch(kDown, to.size, {g.read(from), g.write(to)}); }
    std::vector<PlanBarrier> of(const Plan& plan, const Image& image) {
        std::vector<PlanBarrier> out;
        for (const PlanLevel& level : plan.levels)
            for (const PlanBarrier& x : level.barriers)
                if (x.resource == image.id) out.push_back(x);
        for (const PlanBarrier& x : plan.epilogue)
            if (x.resource == image.id) out.push_back(x);
        return out;
    }
};

TEST(GraphBarriers, ReadsBetweenTwoWritesShareOne) {
    Small s;
    s.fill(s.a);
    s.down(s.a, s.b);
    s.down(s.b, s.c);
    s.down(s.a, s.c);  // another level, the same state of a
    s.g.readback(s.a);
    s.g.readback(s.c);
    const Plan plan = must_compile(s.g);
    const auto barriers = s.of(plan, s.a);
    ASSERT_EQ(barriers.size(), 2u) << plan.text();
    EXPECT_EQ(barriers[0].before, rhi::Access::Undefined);
    EXPECT_EQ(barriers[1].before, rhi::Access::StorageWriteCompute);
    EXPECT_EQ(barriers[1].after, rhi::Access::SampledReadCompute | rhi::Access::CopyRead);
}

TEST(GraphBarriers, StandBetweenTwoWrites) {
    Small s;
    s.fill(s.a);
    s.fill(s.a);
    s.g.readback(s.a);
    const Plan plan = must_compile(s.g);
    EXPECT_EQ(s.of(plan, s.a).size(), 3u) << plan.text();
    EXPECT_EQ(plan.levels.size(), 3u);
}

TEST(GraphBarriers, OfOneMipLeaveTheOthersAlone) {
    Graph g;
    Image chain = g.create("chain", {.size = {64, 64}, .mips = 3});
    g.dispatch(kFill, chain.size, {g.write(chain, mip(0))}, FillPush{});
    g.dispatch(kDown, chain.size / 2, {g.read(chain, mip(0)), g.write(chain, mip(1))});
    g.dispatch(kDown, chain.size / 4, {g.read(chain, mip(1)), g.write(chain, mip(2))});
    g.readback(chain, 2);
    const Plan plan = must_compile(g);
    ASSERT_EQ(plan.levels.size(), 4u);
    const auto& second = plan.levels[1].barriers;
    ASSERT_EQ(second.size(), 2u) << plan.text();
    EXPECT_EQ(second[0].range, mip(0).base_mip == 0 ? (rhi::Subresources{0, 1, 0, 1}) : kAll);
    EXPECT_EQ(second[1].range, (rhi::Subresources{1, 1, 0, 1}));
}

TEST(GraphBarriers, OfEqualMipsAndLayersAreOne) {
    Graph g;
    Image array = g.create("array", {.size = {16, 16, 4}, .dimension = rhi::Dimension::D2Array, .mips = 3});
    g.clear(array);
    g.readback(array);
    const Plan plan = must_compile(g);
    ASSERT_EQ(plan.levels[0].barriers.size(), 1u) << plan.text();
    EXPECT_EQ(plan.levels[0].barriers[0].range, (rhi::Subresources{0, 3, 0, 4}));
}

TEST(GraphBarriers, OfIndependentPassesStandTogether) {
    Small s;
    s.fill(s.a);
    s.fill(s.b);
    s.fill(s.c);
    s.g.readback(s.a);
    s.g.readback(s.b);
    s.g.readback(s.c);
    const Plan plan = must_compile(s.g);
    EXPECT_EQ(plan.levels.size(), 2u) << plan.text();
}

TEST(GraphBarriers, OfAnImportStartFromItsAccessAndWidenReads) {
    Graph g;
    Image atlas = g.import("atlas", kAtlas, {.size = {64, 32}}, rhi::Access::CopyRead);
    Image out = g.create("out", kSmall);
    g.dispatch(kDown, out.size, {g.read(atlas), g.write(out)});
    g.readback(out);
    const Plan plan = must_compile(g);
    EXPECT_EQ(plan.levels[0].barriers[0].before, rhi::Access::CopyRead);
    EXPECT_EQ(plan.levels[0].barriers[0].after, rhi::Access::CopyRead | rhi::Access::SampledReadCompute);
    Graph h;
    atlas = h.import("atlas", kAtlas, {.size = {64, 32}}, plan.uses[0].leave[0]);
    out = h.create("out", kSmall);
    h.dispatch(kDown, out.size, {h.read(atlas), h.write(out)});
    h.readback(out);
    EXPECT_EQ(must_compile(h).levels[0].barriers.size(), 1u) << "a read after the same read needs nothing";
}

// ---- culling

TEST(GraphCulling, KeepsOnlyWhatComesOut) {
    Small s;
    s.fill(s.a);
    s.fill(s.b);
    s.down(s.a, s.c);
    s.g.readback(s.b);
    const Plan plan = must_compile(s.g);
    EXPECT_EQ(plan.passes.size(), 2u) << plan.text();
    EXPECT_EQ(plan.culled, (std::vector<std::string>{"fill", "down"}));
    EXPECT_FALSE(plan.uses[s.a.id].used);
}

TEST(GraphCulling, ForgetsWritesThatAClearWipesOut) {
    Small s;
    s.fill(s.a);
    s.g.clear(s.a);
    s.g.readback(s.a);
    EXPECT_EQ(must_compile(s.g).culled, (std::vector<std::string>{"fill"}));
}

TEST(GraphCulling, KeepsWritesUnderAPartialOne) {
    Small s;
    s.g.clear(s.a);
    s.fill(s.a);
    s.g.readback(s.a);
    EXPECT_TRUE(must_compile(s.g).culled.empty());
}

TEST(GraphCulling, KeepsWritersOfImportsAndHistories) {
    Graph g;
    Image atlas = g.import("atlas", kAtlas, kSmall, rhi::Access::Undefined);
    g.dispatch(kFill, atlas.size, {g.write(atlas)}, FillPush{});
    ImageHistory h = g.history("h", kSmall);
    g.dispatch(kFill, h.current.size, {g.write(h.current)}, FillPush{});
    const Plan plan = must_compile(g);
    EXPECT_EQ(plan.passes.size(), 2u) << plan.text();
    EXPECT_EQ(plan.culled, (std::vector<std::string>{"clear h (previous)"}));
}

// ---- memory

TEST(GraphMemory, IsSharedByTransientsThatNeverMeet) {
    Small s;
    s.fill(s.a);
    s.down(s.a, s.b);
    s.down(s.b, s.c);
    s.g.readback(s.c);
    const Plan plan = must_compile(s.g);
    EXPECT_EQ(plan.peak_bytes * 3, plan.unaliased_bytes * 2) << plan.text();
    ASSERT_EQ(plan.levels[2].barriers.back().resource, s.c.id);
    EXPECT_EQ(plan.levels[2].barriers.back().alias_before, rhi::Access::SampledReadCompute)
        << "c waits for the readers of a";
}

TEST(GraphMemory, OfAnOutputIsHeldToTheEnd) {
    Small s;
    s.fill(s.a);
    s.g.output(s.a);
    s.fill(s.b);
    s.down(s.b, s.c);
    s.g.readback(s.c);
    const Plan plan = must_compile(s.g);
    EXPECT_EQ(plan.peak_bytes, plan.unaliased_bytes) << plan.text();
}

TEST(GraphMemory, IsWaitedForAcrossFrames) {
    Small first, second;
    first.fill(first.a);
    first.g.readback(first.a);
    const Plan one = must_compile(first.g);
    second.fill(second.a);
    second.g.readback(second.a);
    const Plan two = must_compile(second.g, {.tail = one.tail});
    EXPECT_EQ(two.levels[0].barriers.at(0).alias_before, rhi::Access::CopyRead) << two.text();
    const Plan frames[] = {one, two};
    EXPECT_EQ(joined(find_hazards(frames)), "");
    const Plan forgetful[] = {one, must_compile(second.g)};
    EXPECT_NE(joined(find_hazards(forgetful)), "");
}

// ---- everything at once

TEST(GraphFuzz, PlansHaveNoHazards) {
    size_t passes = 0, barriers = 0, culled = 0, aliased = 0;
    for (uint32_t seed = 0; seed < 1000; ++seed) {
        std::mt19937 random(seed);
        World world;
        for (uint32_t i = 0; i < 3; ++i) {
            world.textures[i] = {i + 10, 1};
            if (seed % 3 == 0) {
                world.image_access[i] = rhi::Access::SampledReadCompute;
                world.written[i].assign(size_t{World::kImages[i].mips} * (i == 2 ? 3 : 1), true);
            }
        }
        for (uint32_t i = 0; i < 2; ++i) {
            world.buffers[i] = {i + 10, 1};
            world.buffer_access[i] = seed % 5 == 0 ? rhi::Access::StorageWriteCompute : rhi::Access::Undefined;
        }
        Graph g;
        record_random(g, random, world, {.passes = seed % 4 == 0 ? 60u : 25u});
        ASSERT_EQ(joined(g.errors()), "") << "seed " << seed;
        const Plan plan = must_compile(g, {.aliasing = seed % 7 != 0, .poison = seed % 5 == 1});
        ASSERT_EQ(joined(find_hazards({&plan, 1})), "") << "seed " << seed << "\n" << plan.text();
        ASSERT_EQ(joined(find_cull_faults(g, plan)), "") << "seed " << seed << "\n" << plan.text();
        passes += plan.passes.size();
        barriers += plan.barrier_count();
        culled += plan.culled.size();
        aliased += plan.peak_bytes < plan.unaliased_bytes;
    }
    // The fuzzer must exercise what it judges.
    EXPECT_GT(passes, 10000u);
    EXPECT_GT(barriers, 15000u);
    EXPECT_GT(culled, 1000u);
    EXPECT_GT(aliased, 300u);
}

}  // namespace
}  // namespace kiln::render::samples
