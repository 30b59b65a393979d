// SPDX-License-Identifier: MIT
// Interval first-fit: largest first, each at the lowest offset where nothing lies that lives at the same time.
#include "render/graph_compile.h"

#include <algorithm>
#include <numeric>
#include <tuple>

namespace kiln::render {

namespace {

uint64_t align(uint64_t n, uint64_t to) { return (n + to - 1) / to * to; }

bool same_time(const Placement& a, const Placement& b) {
    return a.first_level <= b.last_level && b.first_level <= a.last_level;
}

}  // namespace

uint64_t nominal_bytes(const GraphResource& image) {
    uint64_t texels = 0;
    for (uint32_t m = 0; m < image.mips; ++m) {
        const rhi::Extent e = mip_size(image.size, m);
        texels += uint64_t{e.width} * e.height * (image.dimension == rhi::Dimension::D3 ? e.depth : image.size.depth);
    }
    return align(texels * rhi::bytes_per_texel(image.format), 1024);
}

void pack(Plan& plan) {
    std::vector<size_t> order(plan.placements.size());
    for (size_t i = 0; i < order.size(); ++i) order[i] = i;
    std::stable_sort(order.begin(), order.end(),
                     [&](size_t a, size_t b) { return plan.placements[a].size > plan.placements[b].size; });
    std::vector<uint64_t> need(plan.resources.size(), 0);
    for (const Placement& p : plan.placements) need[p.resource] = p.size;
    for (const GraphPass& pass : plan.passes) {
        std::vector<uint32_t> touched;
        for (const GraphAccess& a : pass.accesses) touched.push_back(a.resource);
        std::ranges::sort(touched);
        const auto last = std::ranges::unique(touched).begin();
        const auto sum = [&](uint64_t before, uint32_t resource) { return before + need[resource]; };
        plan.most_of_a_pass = std::max(plan.most_of_a_pass, std::accumulate(touched.begin(), last, uint64_t{0}, sum));
    }
    std::vector<Placement*> placed;  // by offset
    for (const size_t i : order) {
        Placement& p = plan.placements[i];
        p.offset = 0;
        for (const Placement* other : placed) {
            if (plan.aliasing && !same_time(*other, p)) continue;
            if (p.offset + p.size <= other->offset) break;
            p.offset = std::max(p.offset, align(other->offset + other->size, p.alignment));
        }
        plan.unaliased_bytes = align(plan.unaliased_bytes, p.alignment) + p.size;
        plan.peak_bytes = std::max(plan.peak_bytes, p.offset + p.size);
        placed.insert(std::upper_bound(placed.begin(), placed.end(), &p,
                                       [](const Placement* a, const Placement* b) { return a->offset < b->offset; }),
                      &p);
    }
}

std::vector<MemoryTail> tail_after(std::span<const Placement> placements, std::span<const MemoryTail> before) {
    std::vector<MemoryTail> out;
    for (const Placement& p : placements) out.push_back({p.offset, p.size, p.last_access});
    std::sort(out.begin(), out.end(), [](const MemoryTail& a, const MemoryTail& b) { return a.offset < b.offset; });
    std::vector<MemoryTail> rest;
    for (MemoryTail t : before) {
        // Whoever owns these bytes now has waited for the older access itself.
        for (const MemoryTail& now : std::span(out)) {
            if (t.size == 0 || now.offset >= t.offset + t.size) break;
            const uint64_t now_end = now.offset + now.size;
            if (now_end <= t.offset) continue;
            if (now.offset > t.offset) rest.push_back({t.offset, now.offset - t.offset, t.access});
            const uint64_t end = t.offset + t.size;
            t.offset = std::min(end, now_end);
            t.size = end - t.offset;
        }
        if (t.size > 0) rest.push_back(t);
    }
    out.insert(out.end(), rest.begin(), rest.end());
    std::sort(out.begin(), out.end(), [](const MemoryTail& a, const MemoryTail& b) {
        return std::tuple(a.offset, a.size, uint32_t(a.access)) < std::tuple(b.offset, b.size, uint32_t(b.access));
    });
    out.erase(std::unique(out.begin(), out.end()), out.end());
    // Far more pieces than transients: hold everything against the next frame instead of growing.
    if (out.size() > 256) {
        MemoryTail all;
        for (const MemoryTail& t : out) {
            all.size = std::max(all.size, t.offset + t.size);
            all.access |= t.access;
        }
        out = {all};
    }
    return out;
}

}  // namespace kiln::render
