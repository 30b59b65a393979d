// SPDX-License-Identifier: MIT
#include "render/graph_plan.h"

#include "base/format.h"

namespace kiln::render {

using Origin = GraphResource::Origin;

rhi::TextureDesc texture_desc(const GraphResource& r, rhi::TextureUsage usage) {
    return {
        .dimension = r.dimension, .format = r.format, .size = r.size, .mips = r.mips, .usage = usage, .label = r.name};
}

rhi::BufferDesc buffer_desc(const GraphResource& r, rhi::BufferUsage usage) {
    return {.size = r.bytes, .usage = usage, .label = r.name};
}

bool same_shape(const GraphResource& a, const GraphResource& b) {
    return a.is_image == b.is_image && a.size == b.size && a.format == b.format && a.dimension == b.dimension &&
           a.mips == b.mips && a.bytes == b.bytes;
}

uint64_t frame_bytes(const Plan& plan, const GraphPass& pass) {
    uint64_t sum = 0;
    for (const GraphAccess& a : pass.accesses) {
        const GraphResource& r = plan.resources[a.resource];
        if (r.origin == Origin::Imported) continue;
        uint64_t bytes = r.bytes;
        if (r.is_image) {
            uint64_t texels = 0;
            for (uint32_t m = a.range.base_mip; m < a.range.base_mip + a.range.mip_count; ++m) {
                const rhi::Extent e = mip_size(r.size, m);
                texels +=
                    uint64_t{e.width} * e.height * (r.dimension == rhi::Dimension::D3 ? e.depth : a.range.layer_count);
            }
            bytes = texels * rhi::bytes_per_texel(r.format);
        }
        const bool writes = rhi::writes(a.access);
        sum += bytes * (uint64_t{writes} + uint64_t{!writes || a.reads_old});
    }
    return sum;
}

size_t Plan::barrier_count() const {
    size_t n = epilogue.size();
    for (const PlanLevel& level : levels) n += level.barriers.size();
    return n;
}

namespace {

std::string range_text(const GraphResource& r, const rhi::Subresources& range) {
    if (!r.is_image) return {};
    std::string out;
    const auto part = [&](std::string_view what, uint32_t base, uint32_t count, uint32_t all) {
        if (count == all) return;
        out += count == 1 ? formatted(" {} {}", what, base) : formatted(" {}s {}-{}", what, base, base + count - 1);
    };
    part("mip", range.base_mip, range.mip_count, r.mips);
    part("layer", range.base_layer, range.layer_count, r.layers());
    return out;
}

std::string resource_text(const GraphResource& r) {
    static constexpr std::string_view kOrigins[] = {"transient", "imported", "history", "upload", "read-back"};
    std::string out = formatted("'{}' {}", r.name, kOrigins[size_t(r.origin)]);
    if (!r.is_image) return out + formatted(" buffer {} B", r.bytes);
    static constexpr std::string_view kDimensions[] = {"1D", "2D", "2D array", "3D"};
    out += formatted(" {} {}x{}", kDimensions[size_t(r.dimension)], r.size.width, r.size.height);
    if (r.size.depth > 1) out += formatted("x{}", r.size.depth);
    if (r.mips > 1) out += formatted(" {} mips", r.mips);
    return out + formatted(" {}", rhi::name(r.format));
}

}  // namespace

std::string Plan::text() const {
    const auto barrier_text = [&](const PlanBarrier& b) {
        const GraphResource& r = resources[b.resource];
        std::string out = formatted("  barrier '{}'{}: {} -> {}", r.name, range_text(r, b.range), rhi::name(b.before),
                                    rhi::name(b.after));
        if (rhi::any(b.alias_before)) out += formatted(", its memory after {}", rhi::name(b.alias_before));
        return out + "\n";
    };
    std::string out = formatted("{} passes, {} culled, {} levels, {} barriers\n", passes.size(), culled.size(),
                                levels.size(), barrier_count());
    out += "resources\n";
    for (size_t i = 0; i < resources.size(); ++i)
        out += formatted("  {}{}\n", resource_text(resources[i]), uses[i].used ? "" : ", unused");
    for (size_t l = 0; l < levels.size(); ++l) {
        out += formatted("level {}\n", l);
        for (const PlanBarrier& b : levels[l].barriers) out += barrier_text(b);
        for (const uint32_t p : levels[l].passes) {
            out += formatted("  pass '{}'\n", passes[p].name);
            for (const GraphAccess& a : passes[p].accesses) {
                const GraphResource& r = resources[a.resource];
                out += formatted("    {} '{}'{}\n", rhi::name(a.access), r.name, range_text(r, a.range));
            }
        }
    }
    if (!epilogue.empty()) out += "end\n";
    for (const PlanBarrier& b : epilogue) out += barrier_text(b);
    out += formatted("memory: {} B for {} B of transients ({} %){}\n", peak_bytes, unaliased_bytes,
                     unaliased_bytes ? peak_bytes * 100 / unaliased_bytes : 100, aliasing ? "" : ", aliasing off");
    for (const Placement& p : placements)
        out += formatted("  '{}' bytes {}+{}, levels {}-{}\n", resources[p.resource].name, p.offset, p.size,
                         p.first_level, p.last_level);
    for (const std::string& name : culled) out += formatted("culled '{}'\n", name);
    return out;
}

}  // namespace kiln::render
