// SPDX-License-Identifier: MIT
// From a recording to a plan: cull, poison, level, pack, synchronise. Pure.
// States are kept one a subresource ("cell"): mip + layer * mips of an image; a buffer is one cell.
#include "render/graph_compile.h"

#include "base/assert.h"

#include <algorithm>
#include <limits>

namespace kiln::render {

using rhi::Access;
using Origin = GraphResource::Origin;

namespace {

template <typename F>
void each_cell(const GraphResource& r, const rhi::Subresources& range, F&& f) {
    for (uint32_t l = range.base_layer; l < range.base_layer + range.layer_count; ++l)
        for (uint32_t m = range.base_mip; m < range.base_mip + range.mip_count; ++m) f(size_t{m} + size_t{l} * r.mips);
}

// One value a cell of every resource.
template <typename T>
class Cells {
public:
    Cells(const std::vector<GraphResource>& resources, T value) {
        uint32_t n = 0;
        for (const GraphResource& r : resources) {
            start_.push_back(n);
            n += r.subresources();
        }
        start_.push_back(n);
        values_.assign(n, value);
    }
    T& at(uint32_t resource, size_t cell) { return values_[start_[resource] + cell]; }
    std::span<T> of(uint32_t resource) {
        return std::span(values_).subspan(start_[resource], start_[resource + 1] - start_[resource]);
    }

private:
    std::vector<uint32_t> start_;
    std::vector<T> values_;
};
using Flags = Cells<uint8_t>;

// Reads of different classes can't be one state: they need the image in different layouts.
int read_class(const GraphResource& r, Access access) {
    if (rhi::any(access & Access::Present)) return 2;
    return r.is_image && rhi::is_depth(r.format) && rhi::any(access & Access::CopyRead) ? 1 : 0;
}

}  // namespace

bool together(const GraphResource& r, Access a, Access b) {
    return !rhi::writes(a) && !rhi::writes(b) && read_class(r, a) == read_class(r, b);
}

namespace {

Access entry_access(const GraphResource& r, size_t cell) { return r.entry.empty() ? Access::Undefined : r.entry[cell]; }

// A resource whose contents somebody sees after the frame.
bool is_sink(const GraphResource& r) {
    return r.output || r.origin == Origin::Imported || r.origin == Origin::Readback || r.history_current;
}

bool has_contents_at_start(const GraphResource& r, size_t cell) {
    switch (r.origin) {
    case Origin::Transient:
    case Origin::Readback:
        return false;
    case Origin::Upload:
        return true;
    // A buffer may have been filled by write_buffer, which leaves no access behind.
    case Origin::Imported:
        return !r.is_image || entry_access(r, cell) != Access::Undefined;
    case Origin::History:
        return !r.history_current && entry_access(r, cell) != Access::Undefined;
    }
    return false;
}

std::string check_contents(const std::vector<GraphResource>& resources, const std::vector<GraphPass>& passes) {
    Flags written(resources, 0);
    for (uint32_t i = 0; i < resources.size(); ++i)
        for (size_t cell = 0; cell < resources[i].subresources(); ++cell)
            written.at(i, cell) = has_contents_at_start(resources[i], cell);
    std::string wrong;
    for (const GraphPass& pass : passes) {
        for (const GraphAccess& a : pass.accesses) {
            if (!a.reads_old || !wrong.empty()) continue;
            const GraphResource& r = resources[a.resource];
            each_cell(r, a.range, [&](size_t cell) {
                if (written.at(a.resource, cell) || !wrong.empty()) return;
                wrong = formatted("pass '{}' reads '{}' (mip {}, layer {}), which nothing has written", pass.name,
                                  r.name, cell % r.mips, cell / r.mips);
            });
        }
        for (const GraphAccess& a : pass.accesses) {
            if (!rhi::writes(a.access)) continue;
            each_cell(resources[a.resource], a.range, [&](size_t cell) { written.at(a.resource, cell) = 1; });
        }
    }
    for (uint32_t i = 0; i < resources.size() && wrong.empty(); ++i) {
        const auto cells = written.of(i);
        if (resources[i].output && std::find(cells.begin(), cells.end(), uint8_t{1}) == cells.end())
            wrong = formatted("output '{}': nothing has written it", resources[i].name);
    }
    return wrong;
}

// Backwards from what must come out. A write that is not a whole overwrite leaves earlier writes needed.
std::vector<uint8_t> find_live(const std::vector<GraphResource>& resources, const std::vector<GraphPass>& passes) {
    Flags needed(resources, 0);
    for (uint32_t i = 0; i < resources.size(); ++i)
        if (is_sink(resources[i])) std::ranges::fill(needed.of(i), uint8_t{1});
    std::vector<uint8_t> live(passes.size(), 0);
    for (size_t p = passes.size(); p-- > 0;) {
        bool lives = false;
        for (const GraphAccess& a : passes[p].accesses)
            if (rhi::writes(a.access))
                each_cell(resources[a.resource], a.range,
                          [&](size_t cell) { lives = lives || needed.at(a.resource, cell); });
        if (!lives) continue;
        live[p] = 1;
        for (const GraphAccess& a : passes[p].accesses)
            if (a.overwrites)
                each_cell(resources[a.resource], a.range, [&](size_t cell) { needed.at(a.resource, cell) = 0; });
        for (const GraphAccess& a : passes[p].accesses)
            if (a.reads_old)
                each_cell(resources[a.resource], a.range, [&](size_t cell) { needed.at(a.resource, cell) = 1; });
    }
    return live;
}

// Not a number, or the nearest that the format has.
ClearCommand poison_of(const GraphResource& r, uint32_t id) {
    ClearCommand c{.resource = id, .word = 0xCDCDCDCDu};
    if (!r.is_image) {
        c.size = r.bytes;
        return c;
    }
    c.range = {0, r.mips, 0, r.layers()};
    float value = std::numeric_limits<float>::quiet_NaN();
    if (rhi::info(r.format).sample_type == rhi::SampleType::Uint)
        value = r.format == rhi::Format::R16Uint ? 52685.0f : 3452816896.0f;
    if (rhi::is_depth(r.format)) value = 0.8f;
    if (r.format == rhi::Format::Rgba8Unorm) value = 0.8f;
    if (r.format == rhi::Format::R8Snorm) value = -0.4f;
    c.value = {value, value, value, value};
    return c;
}

void insert_poison(Plan& plan) {
    std::vector<GraphPass> passes;
    std::vector<uint32_t> recorded;
    std::vector<uint8_t> seen(plan.resources.size(), 0);
    for (size_t p = 0; p < plan.passes.size(); ++p) {
        for (const GraphAccess& a : plan.passes[p].accesses) {
            const GraphResource& r = plan.resources[a.resource];
            if (!r.transient() || seen[a.resource]) continue;
            seen[a.resource] = 1;
            GraphPass poison{.name = formatted("poison {}", r.name)};
            poison.accesses = {{a.resource, {0, r.mips, 0, r.layers()}, Access::CopyWrite, false, true}};
            poison.command = poison_of(r, a.resource);
            passes.push_back(std::move(poison));
            recorded.push_back(~0u);
        }
        passes.push_back(std::move(plan.passes[p]));
        recorded.push_back(plan.recorded[p]);
    }
    plan.passes = std::move(passes);
    plan.recorded = std::move(recorded);
}

// Level of every pass: the level of the pass before it, or one more if it touches what a pass of that level writes,
// or writes what one of them touches.
std::vector<uint32_t> find_levels(const std::vector<GraphResource>& resources, const std::vector<GraphPass>& passes) {
    struct Touched {
        uint32_t level = ~0u;
        Access access = Access::Undefined;
    };
    Cells<Touched> cells(resources, {});
    std::vector<uint32_t> levels;
    uint32_t level = 0;
    for (const GraphPass& pass : passes) {
        bool conflict = false;
        for (const GraphAccess& a : pass.accesses) {
            const GraphResource& r = resources[a.resource];
            each_cell(r, a.range, [&](size_t cell) {
                const Touched& t = cells.at(a.resource, cell);
                conflict = conflict || (t.level == level && !together(r, t.access, a.access));
            });
        }
        level += conflict;
        levels.push_back(level);
        for (const GraphAccess& a : pass.accesses) {
            each_cell(resources[a.resource], a.range, [&](size_t cell) {
                Touched& t = cells.at(a.resource, cell);
                t.access = t.level == level ? t.access | a.access : a.access;
                t.level = level;
            });
        }
    }
    return levels;
}

// A stretch of levels in which a cell stays in one state: one write, or reads between two writes.
struct Segment {
    uint32_t first_level = 0;
    uint32_t last_level = 0;
    Access access = Access::Undefined;
};
using Segments = std::vector<std::vector<Segment>>;  // one list a cell of one resource

void extend(const GraphResource& r, std::vector<Segment>& segments, uint32_t level, Access access) {
    if (!segments.empty()) {
        Segment& last = segments.back();
        if (together(r, last.access, access)) {
            last.access |= access;
            last.last_level = level;
            return;
        }
        KILN_ASSERT(last.last_level < level, "'{}': two states in level {}", r.name, level);
    }
    segments.push_back({level, level, access});
}

std::vector<Segments> find_segments(const Plan& plan, const std::vector<uint32_t>& levels) {
    std::vector<Segments> out(plan.resources.size());
    for (size_t i = 0; i < out.size(); ++i) out[i].resize(plan.resources[i].subresources());
    for (size_t p = 0; p < plan.passes.size(); ++p) {
        for (const GraphAccess& a : plan.passes[p].accesses) {
            const GraphResource& r = plan.resources[a.resource];
            each_cell(r, a.range, [&](size_t cell) { extend(r, out[a.resource][cell], levels[p], a.access); });
        }
    }
    for (size_t i = 0; i < out.size(); ++i) {
        const GraphResource& r = plan.resources[i];
        if (r.leave == Access::Undefined || !plan.uses[i].used) continue;
        for (auto& segments : out[i])
            if (!segments.empty()) extend(r, segments, uint32_t(plan.levels.size()), r.leave);
    }
    return out;
}

rhi::TextureUsage texture_usage(Access a) {
    using U = rhi::TextureUsage;
    U out = U::None;
    if (any(a & (Access::SampledReadCompute | Access::SampledReadGraphics))) out |= U::Sampled;
    if (any(a & (Access::StorageReadCompute | Access::StorageReadGraphics | Access::StorageWriteCompute |
                 Access::StorageWriteGraphics)))
        out |= U::Storage;
    if (any(a & Access::ColorWrite)) out |= U::Color;
    if (any(a & (Access::DepthRead | Access::DepthWrite))) out |= U::Depth;
    if (any(a & Access::CopyRead)) out |= U::CopySrc;
    if (any(a & Access::CopyWrite)) out |= U::CopyDst;
    return out;
}

rhi::BufferUsage buffer_usage(Access a) {
    using U = rhi::BufferUsage;
    U out = U::None;
    if (any(a & (Access::StorageReadCompute | Access::StorageReadGraphics | Access::StorageWriteCompute |
                 Access::StorageWriteGraphics)))
        out |= U::Storage;
    if (any(a & Access::UniformRead)) out |= U::Uniform;
    if (any(a & Access::IndirectRead)) out |= U::Indirect;
    if (any(a & Access::IndexRead)) out |= U::Index;
    if (any(a & Access::VertexRead)) out |= U::Vertex;
    if (any(a & Access::CopyRead)) out |= U::CopySrc;
    if (any(a & Access::CopyWrite)) out |= U::CopyDst;
    if (any(a & Access::BoxesRead)) out |= U::Boxes;
    if (any(a & (Access::BoxTreeRead | Access::BoxTreeWrite))) out |= U::BoxTree;
    return out;
}

void find_uses(Plan& plan) {
    plan.uses.resize(plan.resources.size());
    for (const GraphPass& pass : plan.passes) {
        for (const GraphAccess& a : pass.accesses) {
            PlanResource& use = plan.uses[a.resource];
            use.used = true;
            use.written = use.written || rhi::writes(a.access);
            use.texture_usage |= texture_usage(a.access);
            use.buffer_usage |= buffer_usage(a.access);
        }
    }
    for (size_t i = 0; i < plan.resources.size(); ++i) {
        plan.uses[i].texture_usage |= texture_usage(plan.resources[i].leave);
        plan.uses[i].buffer_usage |= buffer_usage(plan.resources[i].leave);
    }
}

// Levels in which transients must keep their memory, and the accesses after which it is free.
std::vector<Placement> find_lifetimes(const Plan& plan, const std::vector<Segments>& segments,
                                      const CompileOptions& options) {
    const uint32_t end = uint32_t(plan.levels.size());
    std::vector<Placement> out;
    for (uint32_t i = 0; i < plan.resources.size(); ++i) {
        const GraphResource& r = plan.resources[i];
        if (!r.transient() || !plan.uses[i].used) continue;
        rhi::MemoryNeed need{r.is_image ? nominal_bytes(r) : r.bytes, 256};
        if (r.is_image && options.texture_need)
            need = options.texture_need(texture_desc(r, plan.uses[i].texture_usage));
        if (!r.is_image && options.buffer_need) need = options.buffer_need(buffer_desc(r, plan.uses[i].buffer_usage));
        Placement p{
            .resource = i, .size = need.size, .alignment = std::max<uint64_t>(1, need.alignment), .first_level = end};
        for (const auto& cell : segments[i]) {
            if (cell.empty()) continue;
            p.first_level = std::min(p.first_level, cell.front().first_level);
            p.last_level = std::max(p.last_level, cell.back().last_level);
            p.last_access |= cell.back().access;
        }
        if (r.output) p.last_level = end;
        out.push_back(p);
    }
    return out;
}

// Rectangles of cells with the same transition: mips side by side, then layers with the same mips.
void add_barriers(std::vector<PlanBarrier>& out, const GraphResource& r, uint32_t resource,
                  std::vector<PlanBarrier> cells) {
    if (cells.empty()) return;
    const auto same = [](const PlanBarrier& a, const PlanBarrier& b) {
        return a.before == b.before && a.after == b.after && a.alias_before == b.alias_before;
    };
    std::vector<PlanBarrier> rows;
    for (const PlanBarrier& c : cells) {  // in order of layer, then mip
        if (!rows.empty()) {
            PlanBarrier& last = rows.back();
            if (same(last, c) && last.range.base_layer == c.range.base_layer &&
                last.range.base_mip + last.range.mip_count == c.range.base_mip) {
                ++last.range.mip_count;
                continue;
            }
        }
        rows.push_back(c);
    }
    std::vector<PlanBarrier> merged;
    for (const PlanBarrier& row : rows) {
        const auto above = std::find_if(merged.begin(), merged.end(), [&](const PlanBarrier& m) {
            return same(m, row) && m.range.base_mip == row.range.base_mip && m.range.mip_count == row.range.mip_count &&
                   m.range.base_layer + m.range.layer_count == row.range.base_layer;
        });
        if (above != merged.end()) {
            ++above->range.layer_count;
        } else {
            merged.push_back(row);
        }
    }
    for (PlanBarrier& m : merged) {
        m.resource = resource;
        if (!r.is_image) m.range = {};
        out.push_back(m);
    }
}

void synchronise(Plan& plan, const std::vector<Segments>& segments) {
    const auto alias_of = [&](uint32_t resource) {
        Access before = Access::Undefined;
        const auto own = std::ranges::find(plan.placements, resource, &Placement::resource);
        if (own == plan.placements.end()) return before;
        const auto shares = [&](uint64_t offset, uint64_t size) {
            return offset < own->offset + own->size && own->offset < offset + size;
        };
        for (const Placement& p : plan.placements)
            if (p.last_level < own->first_level && shares(p.offset, p.size)) before |= p.last_access;
        for (const MemoryTail& t : plan.tail_before)
            if (shares(t.offset, t.size)) before |= t.access;
        return before;
    };
    const size_t end = plan.levels.size();
    for (uint32_t i = 0; i < plan.resources.size(); ++i) {
        const GraphResource& r = plan.resources[i];
        PlanResource& use = plan.uses[i];
        use.leave.resize(r.subresources());
        std::vector<std::vector<PlanBarrier>> at(end + 1);
        const Access alias = r.transient() && use.used ? alias_of(i) : Access::Undefined;
        for (size_t cell = 0; cell < r.subresources(); ++cell) {
            Access state = entry_access(r, cell);
            const rhi::Subresources place{uint32_t(cell % r.mips), 1, uint32_t(cell / r.mips), 1};
            bool first = true;
            for (const Segment& s : segments[i][cell]) {
                const bool inherits = first && state != Access::Undefined && together(r, state, s.access);
                Access after = s.access;
                bool needed = true;
                if (inherits) {
                    // Reads of this frame beside reads of the last: the union, so that frames which differ don't take turns.
                    after |= state;
                    needed = after != state;
                } else if (first && state == Access::Undefined) {
                    // A buffer in memory of its own, new or filled by write_buffer, can be used at once.
                    needed = r.is_image || r.transient();
                }
                if (needed)
                    at[s.first_level].push_back({.resource = i,
                                                 .range = place,
                                                 .before = state,
                                                 .after = after,
                                                 .alias_before = first ? alias : Access::Undefined});
                state = after;
                first = false;
            }
            use.leave[cell] = state;
        }
        for (size_t level = 0; level <= end; ++level)
            add_barriers(level == end ? plan.epilogue : plan.levels[level].barriers, r, i, std::move(at[level]));
    }
}

GraphResource without_payload(const GraphResource& r) {
    GraphResource out{.name = r.name, .is_image = r.is_image, .origin = r.origin, .size = r.size, .format = r.format};
    out.dimension = r.dimension;
    out.mips = r.mips;
    out.bytes = r.bytes;
    out.version = r.version;
    out.entry = r.entry;
    out.leave = r.leave;
    out.output = r.output;
    out.history = r.history;
    out.history_current = r.history_current;
    out.texture = r.texture;
    out.buffer = r.buffer;
    return out;
}

}  // namespace

Result<Plan> Graph::compile(const CompileOptions& options) const {
    std::string wrong;
    for (const std::string& e : errors_) wrong += (wrong.empty() ? "" : "; ") + e;
    if (wrong.empty()) wrong = check_contents(resources_, passes_);
    if (!wrong.empty()) return Error{"render graph: " + wrong};

    Plan plan;
    plan.aliasing = options.aliasing;
    plan.tail_before = options.tail;
    for (const GraphResource& r : resources_) plan.resources.push_back(without_payload(r));
    const std::vector<uint8_t> live = find_live(resources_, passes_);
    for (size_t p = 0; p < passes_.size(); ++p) {
        if (live[p]) {
            plan.passes.push_back(passes_[p]);
            plan.recorded.push_back(uint32_t(p));
        } else {
            plan.culled.push_back(passes_[p].name);
        }
    }
    if (options.poison) insert_poison(plan);
    find_uses(plan);
    const std::vector<uint32_t> levels = find_levels(plan.resources, plan.passes);
    plan.levels.resize(levels.empty() ? 0 : levels.back() + 1);
    for (uint32_t p = 0; p < levels.size(); ++p) plan.levels[levels[p]].passes.push_back(p);
    const std::vector<Segments> segments = find_segments(plan, levels);
    plan.placements = find_lifetimes(plan, segments, options);
    pack(plan);
    synchronise(plan, segments);
    plan.tail = tail_after(plan.placements, options.tail);
    return plan;
}

}  // namespace kiln::render
