// SPDX-License-Identifier: MIT
#include "render/graph_queues.h"

#include "base/assert.h"
#include "render/graph_compile.h"

#include <algorithm>
#include <bit>

namespace kiln::render {

namespace {

using Passes = std::vector<uint32_t>;

// A set of passes.
class PassSet {
public:
    explicit PassSet(size_t passes) : words_((passes + 63) / 64) {}
    bool has(uint32_t pass) const { return (words_[pass / 64] >> (pass % 64) & 1) != 0; }
    void add(uint32_t pass) { words_[pass / 64] |= uint64_t{1} << (pass % 64); }
    void add(const PassSet& other) {
        for (size_t i = 0; i < words_.size(); ++i) words_[i] |= other.words_[i];
    }

    // The latest that is here and not in `other`; ~0: none.
    uint32_t last_without(const PassSet& other) const {
        for (size_t i = words_.size(); i-- > 0;)
            if (const uint64_t left = words_[i] & ~other.words_[i])
                return uint32_t(64 * i + 63 - size_t(std::countl_zero(left)));
        return ~0u;
    }

private:
    std::vector<uint64_t> words_;
};

// Passes that have a subresource at once, and those that had it just before.
struct Holders {
    rhi::Access access = rhi::Access::Undefined;
    Passes now, before;
};

// Earlier passes that have each pass's subresources before it, as far as the ones before them do not tell.
void add_by_contents(const Plan& plan, std::vector<PassSet>& out) {
    std::vector<std::vector<Holders>> held(plan.resources.size());
    for (uint32_t p = 0; p < plan.passes.size(); ++p) {
        for (const GraphAccess& a : plan.passes[p].accesses) {
            const GraphResource& r = plan.resources[a.resource];
            held[a.resource].resize(r.subresources());
            for (uint32_t layer = a.range.base_layer; layer < a.range.base_layer + a.range.layer_count; ++layer) {
                for (uint32_t mip = a.range.base_mip; mip < a.range.base_mip + a.range.mip_count; ++mip) {
                    Holders& h = held[a.resource][size_t{mip} + size_t{layer} * r.mips];
                    if (!h.now.empty() && !together(r, h.access, a.access)) {
                        h.before = std::move(h.now);
                        h.now.clear();
                        h.access = rhi::Access::Undefined;
                    }
                    h.access |= a.access;
                    if (h.now.empty() || h.now.back() != p) h.now.push_back(p);
                    for (const uint32_t on : h.before) out[p].add(on);
                }
            }
        }
    }
}

// … and those that had its resources' memory.
void add_by_memory(const Plan& plan, std::vector<PassSet>& out) {
    std::vector<PassSet> users(plan.resources.size(), PassSet(out.size()));
    for (uint32_t p = 0; p < plan.passes.size(); ++p)
        for (const GraphAccess& a : plan.passes[p].accesses) users[a.resource].add(p);
    std::vector<PassSet> owners(plan.resources.size(), PassSet(out.size()));
    for (const Placement& a : plan.placements) {
        for (const Placement& b : plan.placements) {
            if (a.last_level >= b.first_level) continue;
            if (a.offset >= b.offset + b.size || b.offset >= a.offset + a.size) continue;
            owners[b.resource].add(users[a.resource]);
        }
    }
    for (uint32_t p = 0; p < plan.passes.size(); ++p)
        for (const GraphAccess& a : plan.passes[p].accesses) out[p].add(owners[a.resource]);
}

}  // namespace

std::vector<Passes> dependencies(const Plan& plan) {
    const size_t passes = plan.passes.size();
    std::vector<PassSet> all(passes, PassSet(passes)), ancestors = all;
    add_by_contents(plan, all);
    add_by_memory(plan, all);
    std::vector<Passes> out(passes);
    for (uint32_t p = 0; p < passes; ++p) {
        // The latest first: it may come after the others.
        for (uint32_t on = all[p].last_without(ancestors[p]); on != ~0u; on = all[p].last_without(ancestors[p])) {
            KILN_ASSERT(on < p, "pass {} after {}", p, on);
            out[p].push_back(on);
            ancestors[p].add(on);
            ancestors[p].add(ancestors[on]);
        }
        std::ranges::reverse(out[p]);
    }
    return out;
}

std::vector<QueueWait> queue_waits(const Plan& plan, std::span<const uint32_t> queues) {
    KILN_ASSERT(queues.size() == plan.passes.size(), "{} queues for {} passes", queues.size(), plan.passes.size());
    const std::vector<Passes> needed = dependencies(plan);
    // What has ended once this pass starts.
    std::vector<PassSet> ended(needed.size(), PassSet(needed.size()));
    std::vector<uint32_t> last;  // of each queue
    std::vector<QueueWait> out;
    for (uint32_t p = 0; p < needed.size(); ++p) {
        const uint32_t queue = queues[p];
        if (queue >= last.size()) last.resize(queue + 1, ~0u);
        PassSet& done = ended[p];
        // One queue's order is as good as an end: barriers stand between its passes, and its signals tell of all of them.
        if (last[queue] != ~0u) {
            done.add(ended[last[queue]]);
            done.add(last[queue]);
        }
        for (size_t i = needed[p].size(); i-- > 0;) {
            const uint32_t on = needed[p][i];
            if (done.has(on)) continue;
            out.push_back({p, on});
            done.add(on);
            done.add(ended[on]);
        }
        last[queue] = p;
    }
    return out;
}

double critical_path(std::span<const Passes> dependencies, std::span<const double> lasts) {
    KILN_ASSERT(lasts.size() == dependencies.size(), "{} times for {} passes", lasts.size(), dependencies.size());
    std::vector<double> ends(lasts.size(), 0);
    double most = 0;
    for (size_t p = 0; p < lasts.size(); ++p) {
        for (const uint32_t on : dependencies[p]) ends[p] = std::max(ends[p], ends[on]);
        ends[p] += lasts[p];
        most = std::max(most, ends[p]);
    }
    return most;
}

}  // namespace kiln::render
