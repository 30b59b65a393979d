// SPDX-License-Identifier: MIT
// Passes on several queues: whatever is waited for keeps every two passes in order that must not meet, and nothing is waited for twice. What must
// not meet is found here from the accesses alone, pair by pair.
#include "render/graph_samples.h"
#include "render/graph_plan.h"
#include "render/graph_queues.h"
#include "rhi/rhi_test.h"

#include <algorithm>
#include <numeric>

namespace kiln::render::samples {
namespace {

using Matrix = std::vector<std::vector<char>>;  // [from][to]

bool overlap(uint32_t a, uint32_t a_count, uint32_t b, uint32_t b_count) { return a < b + b_count && b < a + a_count; }

// Of every two passes: may they not change places, or meet?
Matrix conflicts(const Plan& plan) {
    const auto place = [&](uint32_t resource) {
        return std::ranges::find(plan.placements, resource, &Placement::resource);
    };
    const auto collide = [&](const GraphAccess& a, const GraphAccess& b) {
        if (a.resource != b.resource) {
            const auto p = place(a.resource), q = place(b.resource);
            return p != plan.placements.end() && q != plan.placements.end() && p->offset < q->offset + q->size &&
                   q->offset < p->offset + p->size;
        }
        const GraphResource& r = plan.resources[a.resource];
        if (r.is_image && (!overlap(a.range.base_mip, a.range.mip_count, b.range.base_mip, b.range.mip_count) ||
                           !overlap(a.range.base_layer, a.range.layer_count, b.range.base_layer, b.range.layer_count)))
            return false;
        if (rhi::writes(a.access) || rhi::writes(b.access)) return true;
        // A copy reads depth in another layout than a shader does.
        return r.is_image && rhi::is_depth(r.format) &&
               rhi::any(a.access & rhi::Access::CopyRead) != rhi::any(b.access & rhi::Access::CopyRead);
    };
    Matrix out(plan.passes.size(), std::vector<char>(plan.passes.size()));
    for (size_t i = 0; i < out.size(); ++i)
        for (size_t j = i + 1; j < out.size(); ++j)
            for (const GraphAccess& a : plan.passes[i].accesses)
                for (const GraphAccess& b : plan.passes[j].accesses) out[i][j] = out[i][j] || collide(a, b);
    return out;
}

// Who comes before whom, from who comes right before whom; passes are in an order that agrees.
Matrix closed(Matrix m) {
    for (size_t k = 0; k < m.size(); ++k)
        for (size_t i = 0; i < k; ++i)
            for (size_t j = k + 1; m[i][k] != 0 && j < m.size(); ++j) m[i][j] = m[i][j] || m[k][j];
    return m;
}

Matrix order_on(std::span<const uint32_t> queues, std::span<const QueueWait> waits) {
    Matrix out(queues.size(), std::vector<char>(queues.size()));
    for (size_t i = 0; i < queues.size(); ++i)
        for (size_t j = i + 1; j < queues.size(); ++j) out[i][j] = queues[i] == queues[j];
    for (const QueueWait& w : waits) out[w.on][w.pass] = 1;
    return closed(out);
}

Plan random_plan(uint32_t seed) {
    std::mt19937 random(seed);
    World world;
    for (uint32_t i = 0; i < 3; ++i) world.textures[i] = {i + 10, 1};
    for (uint32_t i = 0; i < 2; ++i) world.buffers[i] = {i + 10, 1};
    Graph g;
    record_random(g, random, world, {.passes = seed % 4 == 0 ? 60u : 25u});
    return rhi::must(g.compile({.aliasing = seed % 3 != 0}));
}

TEST(GraphQueues, WaitsKeepEveryTwoPassesInOrderThatMustNotMeet) {
    size_t waits_made = 0, free_pairs = 0;
    for (uint32_t seed = 0; seed < 150; ++seed) {
        const Plan plan = random_plan(seed);
        const Matrix must = conflicts(plan);
        std::mt19937 random(seed + 1000);
        for (const uint32_t queue_count : {1u, 2u, 3u}) {
            std::vector<uint32_t> queues;
            for (size_t i = 0; i < plan.passes.size(); ++i) queues.push_back(uint32_t(random()) % queue_count);
            const std::vector<QueueWait> waits = queue_waits(plan, queues);
            EXPECT_TRUE(queue_count > 1 || waits.empty());
            waits_made += waits.size();
            const Matrix order = order_on(queues, waits);
            for (size_t i = 0; i < must.size(); ++i) {
                for (size_t j = i + 1; j < must.size(); ++j) {
                    ASSERT_TRUE(must[i][j] == 0 || order[i][j] != 0)
                        << "seed " << seed << ": '" << plan.passes[i].name << "' and '" << plan.passes[j].name << "'";
                    free_pairs += order[i][j] == 0;
                }
            }
            for (size_t w = 0; w < waits.size(); ++w) {
                EXPECT_NE(queues[waits[w].pass], queues[waits[w].on]);
                EXPECT_NE(must[waits[w].on][waits[w].pass], 0) << "waits for what it does not need";
                std::vector<QueueWait> others = waits;
                others.erase(others.begin() + ptrdiff_t(w));
                ASSERT_EQ(order_on(queues, others)[waits[w].on][waits[w].pass], 0) << "follows from the others";
            }
        }
    }
    EXPECT_GT(waits_made, 1500u);
    EXPECT_GT(free_pairs, 10000u) << "some passes must run side by side";
}

TEST(GraphQueues, DependenciesAreWhatMustNotMeetAndNoMore) {
    for (uint32_t seed = 0; seed < 100; ++seed) {
        const Plan plan = random_plan(seed);
        const Matrix must = conflicts(plan);
        Matrix direct(must.size(), std::vector<char>(must.size()));
        const auto needed = dependencies(plan);
        for (uint32_t p = 0; p < needed.size(); ++p) {
            for (const uint32_t on : needed[p]) {
                direct[on][p] = 1;
                EXPECT_NE(must[on][p], 0);
            }
        }
        EXPECT_EQ(closed(direct), closed(must)) << seed;
        std::vector<double> lasts(needed.size()), ends(needed.size());
        std::iota(lasts.begin(), lasts.end(), 1);
        for (size_t p = 0; p < ends.size(); ++p) {
            for (size_t on = 0; on < p; ++on)
                if (must[on][p] != 0) ends[p] = std::max(ends[p], ends[on]);
            ends[p] += lasts[p];
        }
        EXPECT_EQ(critical_path(needed, lasts), ends.empty() ? 0 : *std::ranges::max_element(ends));
    }
}

// What a second queue could take from a frame: passes of compute beside those that the rasteriser draws.
TEST(GraphQueues, ADeferredFrameHasComputeToRunBesideItsRaster) {
    Graph g;
    (void)record_deferred_frame(g, {1, 1}, {1, 1}, {640, 360});
    const Plan plan = rhi::must(g.compile({}));
    const Matrix order = closed(conflicts(plan));
    std::vector<uint32_t> queues(plan.passes.size(), 0);
    std::vector<std::string> moved;
    for (uint32_t p = 0; p < plan.passes.size(); ++p) {
        if (!std::holds_alternative<DispatchCommand>(plan.passes[p].command)) continue;
        for (uint32_t r = 0; r < plan.passes.size(); ++r) {
            if (!std::holds_alternative<DrawCommand>(plan.passes[r].command)) continue;
            if (order[std::min(p, r)][std::max(p, r)] == 0) queues[p] = 1;
        }
        if (queues[p] == 1) moved.push_back(plan.passes[p].name);
    }
    EXPECT_FALSE(moved.empty());
    const std::vector<QueueWait> waits = queue_waits(plan, queues);
    EXPECT_FALSE(waits.empty());
    EXPECT_LE(waits.size(), 2 * moved.size() + 2);
    for (const std::string& name : moved) RecordProperty(name, "beside the rasteriser");
}

}  // namespace
}  // namespace kiln::render::samples
