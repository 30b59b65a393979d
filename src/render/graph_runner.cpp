// SPDX-License-Identifier: MIT
#include "render/graph_runner.h"

#include "base/assert.h"
#include "render/graph_objects.h"
#include "render/graph_queues.h"
#include "render/graph_readback.h"

#include <algorithm>
#include <cstring>

namespace kiln::render {

using rhi::Access;
using Origin = GraphResource::Origin;

// ---- read-backs

void ReadbackState::fetch() {
    if (bytes || failed || !device) return;
    if (const auto done = device->wait(submit); !done) {
        failed = done.error();
        return;
    }
    const auto mapped = device->map(buffer);
    if (!mapped) {
        failed = mapped.error();
        return;
    }
    std::vector<std::byte> out;
    if (row_bytes == 0) {
        out.assign(mapped->begin(), mapped->begin() + ptrdiff_t(buffer_bytes));
    } else {
        out.resize(size_t{row_bytes} * row_count);
        for (uint32_t row = 0; row < row_count; ++row)
            std::memcpy(out.data() + size_t{row} * row_bytes, mapped->data() + size_t{row} * row_pitch, row_bytes);
    }
    device->unmap(buffer);
    bytes = std::move(out);
}

bool Readback::ready() const {
    if (!state_) return false;
    return state_->bytes || state_->failed || (state_->device && state_->device->completed(state_->submit));
}

Result<std::vector<std::byte>> Readback::get() const {
    if (!state_) return Error{"read-back: of nothing"};
    state_->fetch();
    if (state_->failed) return *state_->failed;
    if (!state_->bytes) return Error{formatted("read-back of '{}': its graph was never executed", state_->name)};
    return *state_->bytes;
}

std::string Readback::name() const { return state_ ? state_->name : std::string{}; }

// ---- runner

struct Runner::Impl {
    Impl(rhi::Device& d, const RunnerOptions& o) : device(d), options(o), pipelines(d), objects(d) {}

    // One frame in flight.
    struct Slot {
        rhi::SubmitId submit = 0;
        rhi::QuerySet queries = {};
        rhi::BufferHandle ticks = {};
        bool ticks_held = false;           // the buffer has carried ticks before
        std::vector<uint64_t> bytes = {};  // of each pass
        uint32_t capacity = 0;             // passes
        std::vector<std::string> names = {};
        std::vector<std::vector<uint32_t>> dependencies = {};  // of each pass
        bool collected = true;
        FrameTimes times = {};
    };

    Result<void> collect(Slot& slot);
    Result<void> reserve_queries(Slot& slot, uint32_t passes);
    void settle_readbacks(bool all);
    Result<void> realise(const Graph& graph);
    Result<rhi::BindGroupEntry> entry_of(const BoundUse& bound, uint64_t block_base);
    Result<std::vector<std::pair<uint32_t, rhi::BindGroup>>> bind_groups(
        const std::vector<BoundUse>& bindings, const std::function<rhi::BindGroupLayout(uint32_t)>& layout,
        std::string_view label, uint64_t block_base);
    struct Prepared {  // of one pass, made ahead of recording
        rhi::ComputePipeline compute = {};
        rhi::RenderPipeline render = {};
        rhi::TracePipeline trace = {};
        std::vector<std::pair<uint32_t, rhi::BindGroup>> groups = {};
        std::vector<rhi::ColorAttachment> colors = {};
        rhi::DepthAttachment depth = {};
    };
    Result<Prepared> prepare(const GraphPass& pass, uint64_t block_base);
    void record(rhi::CommandEncoder& encoder, const GraphPass& pass, const Prepared& prepared);
    void between_regions(rhi::CommandEncoder& encoder, uint32_t dst, const CopyRegion& region,
                         std::vector<bool>& written);
    void emit(rhi::CommandEncoder& encoder, const std::vector<PlanBarrier>& list);
    Result<rhi::SubmitId> submit(const Graph& graph, Slot& slot);
    void remember();

    rhi::Device& device;
    RunnerOptions options;
    PipelineLibrary pipelines;
    Reflections reflections;
    GraphObjects objects;
    std::unordered_map<uint64_t, std::vector<Access>> textures_left, buffers_left;
    std::vector<MemoryTail> tail;
    std::vector<Slot> slots;
    std::vector<std::shared_ptr<ReadbackState>> readbacks;  // under way
    FrameTimes newest;
    RunnerStats stats;
    uint64_t query_objects = 0;
    // Of the last frame.
    Plan plan;
    std::vector<rhi::TextureHandle> textures;
    std::vector<rhi::BufferHandle> buffers;
};

Runner::Runner(rhi::Device& device, const RunnerOptions& options) : impl_(std::make_unique<Impl>(device, options)) {
    impl_->options.frames_in_flight = std::clamp(options.frames_in_flight, 1u, 8u);
    impl_->slots.resize(impl_->options.frames_in_flight);
}

Runner::~Runner() {
    impl_->settle_readbacks(true);
    for (const Impl::Slot& slot : impl_->slots) {
        if (slot.queries) impl_->device.destroy(slot.queries);
        if (slot.ticks) impl_->device.destroy(slot.ticks);
    }
}

PipelineLibrary& Runner::pipelines() { return impl_->pipelines; }
rhi::Device& Runner::device() { return impl_->device; }
RunnerOptions& Runner::options() { return impl_->options; }
const Plan& Runner::plan() const { return impl_->plan; }
const RunnerStats& Runner::stats() const { return impl_->stats; }
Reflections& Runner::reflections() { return impl_->reflections; }

std::vector<Access> Runner::left_in(rhi::TextureHandle texture) const {
    const auto it = impl_->textures_left.find(texture.bits());
    return it == impl_->textures_left.end() ? std::vector<Access>{} : it->second;
}

std::vector<Access> Runner::left_in(rhi::BufferHandle buffer) const {
    const auto it = impl_->buffers_left.find(buffer.bits());
    return it == impl_->buffers_left.end() ? std::vector<Access>{} : it->second;
}

bool Runner::history_left_in(const std::string& name, const GraphResource& like, std::vector<Access>& previous,
                             std::vector<Access>& current) const {
    const HistoryObjects* h = impl_->objects.find_history(name);
    if (!h || !same_shape(h->like, like)) return false;
    current = h->left[h->current];
    previous = h->left[1 - h->current];
    return h->valid;
}

Access Runner::access(rhi::TextureHandle texture) const {
    Access out = Access::Undefined;
    for (const Access a : left_in(texture)) out |= a;
    return out;
}

void Runner::set_access(rhi::TextureHandle texture, Access access) {
    const rhi::TextureDesc d = impl_->device.desc(texture);
    const uint32_t layers = d.dimension == rhi::Dimension::D2Array ? d.size.depth : 1;
    impl_->textures_left[texture.bits()].assign(size_t{d.mips} * layers, access);
}

void Runner::forget(rhi::TextureHandle texture) {
    impl_->textures_left.erase(texture.bits());
    impl_->objects.forget(texture);
}

void Runner::forget(rhi::BufferHandle buffer) {
    impl_->buffers_left.erase(buffer.bits());
    impl_->objects.forget(buffer);
}

rhi::TextureHandle Runner::texture(const Image& image) const {
    return image.id < impl_->textures.size() ? impl_->textures[image.id] : rhi::TextureHandle{};
}

rhi::BufferHandle Runner::buffer(const Buffer& buffer) const {
    return buffer.id < impl_->buffers.size() ? impl_->buffers[buffer.id] : rhi::BufferHandle{};
}

// ---- times

Result<void> Runner::Impl::collect(Slot& slot) {
    if (slot.collected) return {};
    if (const auto done = device.wait(slot.submit); !done) return done.error();
    slot.collected = true;
    slot.times = {.submit = slot.submit};
    if (!slot.queries) return {};
    const auto mapped = device.map(slot.ticks);
    if (!mapped) return mapped.error();
    // The frame's begin, then begin and end of each pass.
    std::vector<uint64_t> ticks(slot.names.size() * 2 + 1);
    std::memcpy(ticks.data(), mapped->data(), ticks.size() * sizeof(uint64_t));
    device.unmap(slot.ticks);
    const double ms_per_tick = device.limits().timestamp_period_ns * 1e-6;
    // Once it has drawn a triangle, Mesa's software driver writes the ticks of a pass when it gets to the barrier after it: begin and end
    // are one then, and a pass took as long as its end is after the end before.
    const bool late = device.info().kind == rhi::DeviceKind::Cpu;
    uint64_t done = ticks[0];
    for (size_t i = 0; i < slot.names.size(); ++i) {
        const uint64_t begin = late ? done : ticks[2 * i + 1], end = ticks[2 * i + 2];
        slot.times.passes.push_back({slot.names[i], double(int64_t(end - begin)) * ms_per_tick, slot.bytes[i]});
        done = std::max(done, end);
    }
    slot.times.total_ms = double(done - ticks[0]) * ms_per_tick;
    std::vector<double> lasts;
    for (const PassTime& pass : slot.times.passes) lasts.push_back(pass.ms);
    slot.times.side_by_side_ms = critical_path(slot.dependencies, lasts);
    if (slot.submit > newest.submit) newest = slot.times;
    return {};
}

Result<FrameTimes> Runner::times(rhi::SubmitId submit) {
    for (Impl::Slot& slot : impl_->slots) {
        if (slot.submit != submit) continue;
        if (const auto done = impl_->collect(slot); !done) return done.error();
        return slot.times;
    }
    return Error{formatted("times of submit {}: not one of the last {} frames", submit, impl_->slots.size())};
}

const FrameTimes& Runner::last_times() {
    for (Impl::Slot& slot : impl_->slots)
        if (!slot.collected && impl_->device.completed(slot.submit)) (void)impl_->collect(slot);
    return impl_->newest;
}

Result<void> Runner::Impl::reserve_queries(Slot& slot, uint32_t passes) {
    if (!device.caps().timestamp || passes <= slot.capacity) return {};
    if (slot.queries) device.destroy(slot.queries);
    if (slot.ticks) device.destroy(slot.ticks);
    slot.queries = {};
    slot.ticks = {};
    slot.capacity = std::max(32u, passes * 2);
    const auto queries = device.create_query_set({.count = slot.capacity * 2 + 1, .label = "pass times"});
    if (!queries) return queries.error();
    slot.queries = *queries;
    const auto ticks = device.create_buffer({.size = uint64_t{slot.capacity} * 16 + 8,
                                             .usage = rhi::BufferUsage::QueryResolve,
                                             .memory = rhi::MemoryKind::Readback,
                                             .label = "pass times"});
    if (!ticks) return ticks.error();
    slot.ticks = *ticks;
    slot.ticks_held = false;
    query_objects += 2;
    return {};
}

// Fetches what has arrived and takes the buffers back.
void Runner::Impl::settle_readbacks(bool all) {
    std::erase_if(readbacks, [&](const std::shared_ptr<ReadbackState>& state) {
        const bool wanted = state.use_count() > 1;
        if (!all && !device.completed(state->submit)) return false;
        if (wanted) state->fetch();
        objects.give_back(state->buffer);
        state->device = nullptr;
        state->buffer = {};
        return true;
    });
}

// ---- a frame

// A device object for every resource that is used.
Result<void> Runner::Impl::realise(const Graph& graph) {
    textures.assign(plan.resources.size(), {});
    buffers.assign(plan.resources.size(), {});
    if (const auto room = objects.reserve(plan.peak_bytes); !room) return room.error();
    for (const Placement& p : plan.placements) {
        const GraphResource& r = plan.resources[p.resource];
        const PlanResource& use = plan.uses[p.resource];
        if (r.is_image) {
            const auto t = objects.placed(texture_desc(r, use.texture_usage), p.offset);
            if (!t) return t.error();
            textures[p.resource] = *t;
        } else {
            const auto b = objects.placed(buffer_desc(r, use.buffer_usage), p.offset);
            if (!b) return b.error();
            buffers[p.resource] = *b;
        }
    }
    for (uint32_t i = 0; i < plan.resources.size(); ++i) {
        const GraphResource& r = plan.resources[i];
        const PlanResource& use = plan.uses[i];
        if (!use.used) continue;
        switch (r.origin) {
        case Origin::Transient:
            break;
        case Origin::Imported:
            textures[i] = r.texture;
            buffers[i] = r.buffer;
            break;
        case Origin::History: {
            const auto h = objects.history(r, use);
            if (!h) return h.error();
            const size_t which = r.history_current ? (*h)->current : 1 - (*h)->current;
            textures[i] = (*h)->textures[which];
            buffers[i] = (*h)->buffers[which];
            break;
        }
        case Origin::Upload: {
            const auto b = objects.upload(graph.resources()[i], use.buffer_usage);
            if (!b) return b.error();
            buffers[i] = *b;
            break;
        }
        case Origin::Readback: {
            const auto b = objects.readback(r.bytes);
            if (!b) return b.error();
            buffers[i] = *b;
            break;
        }
        }
    }
    return {};
}

Result<rhi::BindGroupEntry> Runner::Impl::entry_of(const BoundUse& bound, uint64_t block_base) {
    const Use& use = bound.use;
    rhi::BindGroupEntry e{.binding = bound.binding};
    if (use.kind == Use::Kind::Sampler) {
        const auto s = objects.sampler(use.sampler);
        if (!s) return s.error();
        e.sampler = *s;
    } else if (use.kind == Use::Kind::Block) {
        e.buffer = objects.block_buffer();
        e.offset = block_base + use.block.offset;
        e.size = use.block.size;
    } else if (use.is_image) {
        const GraphResource& r = plan.resources[use.resource];
        const auto v = objects.view(textures[use.resource], r, use.range, bound.dimension == rhi::Dimension::D2Array);
        if (!v) return v.error();
        e.view = *v;
    } else {
        const GraphResource& r = plan.resources[use.resource];
        e.buffer = buffers[use.resource];
        e.offset = use.offset;
        // Uploads lie in buffers that may be larger.
        e.size = r.origin == Origin::Upload && use.size == rhi::kWholeSize ? r.bytes - use.offset : use.size;
    }
    return e;
}

Result<std::vector<std::pair<uint32_t, rhi::BindGroup>>> Runner::Impl::bind_groups(
    const std::vector<BoundUse>& bindings, const std::function<rhi::BindGroupLayout(uint32_t)>& layout,
    std::string_view label, uint64_t block_base) {
    std::vector<std::pair<uint32_t, rhi::BindGroup>> out;
    std::vector<rhi::BindGroupEntry> entries;
    for (size_t i = 0; i < bindings.size(); ++i) {  // sorted by set
        const auto e = entry_of(bindings[i], block_base);
        if (!e) return e.error();
        entries.push_back(*e);
        if (i + 1 < bindings.size() && bindings[i + 1].set == bindings[i].set) continue;
        const auto group = objects.group(layout(bindings[i].set), entries, label);
        if (!group) return group.error();
        out.push_back({bindings[i].set, *group});
        entries.clear();
    }
    return out;
}

Result<Runner::Impl::Prepared> Runner::Impl::prepare(const GraphPass& pass, uint64_t block_base) {
    Prepared out;
    if (const auto* d = std::get_if<DispatchCommand>(&pass.command)) {
        const auto pipeline = pipelines.get(*d->kernel);
        if (!pipeline) return pipeline.error();
        out.compute = *pipeline;
        auto groups = bind_groups(
            d->bindings, [&](uint32_t set) { return device.group_layout(out.compute, set); }, pass.name, block_base);
        if (!groups) return groups.error();
        out.groups = std::move(*groups);
    } else if (const auto* t = std::get_if<TraceCommand>(&pass.command)) {
        const auto pipeline = pipelines.get(*t->kernel);
        if (!pipeline) return pipeline.error();
        out.trace = *pipeline;
        auto groups = bind_groups(
            t->bindings, [&](uint32_t set) { return device.group_layout(out.trace, set); }, pass.name, block_base);
        if (!groups) return groups.error();
        out.groups = std::move(*groups);
    } else if (const auto* draw = std::get_if<DrawCommand>(&pass.command)) {
        const auto pipeline = pipelines.get(*draw->kernel);
        if (!pipeline) return pipeline.error();
        out.render = *pipeline;
        auto groups = bind_groups(
            draw->bindings, [&](uint32_t set) { return device.group_layout(out.render, set); }, pass.name, block_base);
        if (!groups) return groups.error();
        out.groups = std::move(*groups);
        const auto attachment = [&](uint32_t id, rhi::Subresources range) {
            range.layer_count = 1;
            return objects.view(textures[id], plan.resources[id], range, false);
        };
        for (size_t i = 0; i < draw->color_ids.size(); ++i) {
            const ColorUse& c = draw->targets.colors[i];
            const auto v = attachment(draw->color_ids[i], c.range);
            if (!v) return v.error();
            out.colors.push_back({.view = *v, .load = c.load, .clear = c.clear});
        }
        if (draw->depth_id != ~0u) {
            const DepthUse& use = draw->targets.depth;
            const auto v = attachment(draw->depth_id, use.range);
            if (!v) return v.error();
            out.depth = {.view = *v, .load = use.load, .clear = use.clear, .read_only = use.read_only};
        }
    }
    return out;
}

// Every region is a write of its own to the same mip and layer: a later one waits for the earlier ones.
void Runner::Impl::between_regions(rhi::CommandEncoder& encoder, uint32_t dst, const CopyRegion& region,
                                   std::vector<bool>& written) {
    const GraphResource& r = plan.resources[dst];
    const bool array = r.is_image && r.dimension == rhi::Dimension::D2Array;
    const uint32_t first = array ? region.origin.z : 0, count = array ? region.size.depth : 1;
    const uint32_t level = r.is_image ? region.mip : 0;
    std::vector<rhi::Barrier> barriers;
    for (uint32_t l = first; l < first + count; ++l) {
        const size_t cell = level + size_t{l} * r.mips;
        if (written[cell])
            barriers.push_back({.buffer = buffers[dst],
                                .texture = textures[dst],
                                .range = r.is_image ? rhi::Subresources{level, 1, l, 1} : rhi::Subresources{},
                                .before = Access::CopyWrite,
                                .after = Access::CopyWrite});
        written[cell] = true;
    }
    if (!barriers.empty()) Graph::emit(encoder, barriers);
}

void Runner::Impl::record(rhi::CommandEncoder& encoder, const GraphPass& pass, const Prepared& prepared) {
    if (const auto* d = std::get_if<DispatchCommand>(&pass.command)) {
        if (d->indirect == ~0u && (d->groups[0] == 0 || d->groups[1] == 0 || d->groups[2] == 0)) return;
        rhi::ComputePass& compute = encoder.begin_compute(pass.name);
        compute.set_pipeline(prepared.compute);
        for (const auto& [set, group] : prepared.groups) compute.set_bind_group(set, group);
        if (!d->push.empty()) compute.set_push(d->push);
        if (d->indirect != ~0u) {
            compute.dispatch_indirect(buffers[d->indirect], d->indirect_offset);
        } else {
            compute.dispatch(d->groups[0], d->groups[1], d->groups[2]);
        }
        compute.end();
        return;
    }
    if (const auto* d = std::get_if<DrawCommand>(&pass.command)) {
        rhi::RenderPass& render =
            encoder.begin_render({.colors = prepared.colors, .depth = prepared.depth, .label = pass.name});
        render.set_pipeline(prepared.render);
        for (const auto& [set, group] : prepared.groups) render.set_bind_group(set, group);
        if (!d->push.empty()) render.set_push(d->push);
        for (const DrawCall& call : d->draws) {
            if (call.vertex_buffer) render.set_vertex_buffer(0, buffers[call.vertex_buffer.id]);
            if (call.index_buffer) render.set_index_buffer(buffers[call.index_buffer.id]);
            if (!d->kernel->mesh.empty()) {
                render.draw_mesh_groups(call.vertices, call.instances);
            } else if (call.indirect_buffer && call.index_buffer) {
                render.draw_indexed_indirect(buffers[call.indirect_buffer.id], call.indirect_offset);
            } else if (call.indirect_buffer) {
                render.draw_indirect(buffers[call.indirect_buffer.id], call.indirect_offset);
            } else if (call.index_buffer) {
                render.draw_indexed(call.vertices, call.instances, call.first_vertex, 0, call.first_instance);
            } else {
                render.draw(call.vertices, call.instances, call.first_vertex, call.first_instance);
            }
        }
        render.end();
        return;
    }
    if (const auto* t = std::get_if<TraceCommand>(&pass.command)) {
        rhi::ComputePass& compute = encoder.begin_compute(pass.name);
        compute.set_pipeline(prepared.trace);
        for (const auto& [set, group] : prepared.groups) compute.set_bind_group(set, group);
        compute.trace(t->width, t->height);
        compute.end();
        return;
    }
    encoder.push_label(pass.name);
    if (const auto* b = std::get_if<BuildCommand>(&pass.command))
        encoder.build_box_tree(buffers[b->tree], buffers[b->boxes], 0, b->count);
    if (const auto* c = std::get_if<CopyCommand>(&pass.command)) {
        const bool from_image = plan.resources[c->src].is_image, to_image = plan.resources[c->dst].is_image;
        if (!from_image && !to_image)
            encoder.copy_buffer(buffers[c->src], c->src_offset, buffers[c->dst], c->dst_offset, c->size);
        std::vector<bool> written(plan.resources[c->dst].subresources());
        for (const CopyRegion& region : c->regions) {
            between_regions(encoder, c->dst, region, written);
            const rhi::TexturePlace place{.mip = region.mip, .origin = region.origin};
            const rhi::BufferLayout layout{.offset = region.buffer_offset,
                                           .bytes_per_row = region.bytes_per_row,
                                           .rows_per_layer = region.rows_per_layer};
            if (from_image && to_image) {
                encoder.copy_texture({.texture = textures[c->src], .mip = region.src_mip, .origin = region.src_origin},
                                     {.texture = textures[c->dst], .mip = place.mip, .origin = place.origin},
                                     region.size);
            } else if (from_image) {
                rhi::BufferLayout to = layout;
                to.buffer = buffers[c->dst];
                encoder.copy_texture_to_buffer({.texture = textures[c->src], .mip = place.mip, .origin = place.origin},
                                               to, region.size);
            } else {
                rhi::BufferLayout from = layout;
                from.buffer = buffers[c->src];
                encoder.copy_buffer_to_texture(
                    from, {.texture = textures[c->dst], .mip = place.mip, .origin = place.origin}, region.size);
            }
        }
    } else if (const auto* clear = std::get_if<ClearCommand>(&pass.command)) {
        if (plan.resources[clear->resource].is_image) {
            encoder.clear_texture(textures[clear->resource], clear->value, clear->range);
        } else {
            encoder.clear_buffer(buffers[clear->resource], clear->offset, clear->size, clear->word);
        }
    }
    encoder.pop_label();
}

// What this frame leaves behind for the next one.
void Runner::Impl::remember() {
    tail = plan.tail;
    for (uint32_t i = 0; i < plan.resources.size(); ++i) {
        const GraphResource& r = plan.resources[i];
        const PlanResource& use = plan.uses[i];
        if (!use.used) continue;
        if (r.origin == Origin::Imported && r.is_image) textures_left[r.texture.bits()] = use.leave;
        if (r.origin == Origin::Imported && !r.is_image) buffers_left[r.buffer.bits()] = use.leave;
        if (r.origin == Origin::History) {
            HistoryObjects& h = *objects.find_history(r.history);
            h.left[r.history_current ? h.current : 1 - h.current] = use.leave;
        }
    }
    for (uint32_t i = 0; i < plan.resources.size(); ++i) {
        const GraphResource& r = plan.resources[i];
        if (r.origin != Origin::History || !r.history_current) continue;
        // A frame that did not write it breaks the chain.
        HistoryObjects* h = objects.find_history(r.history);
        if (!h) continue;
        h->valid = plan.uses[i].written;
        if (h->valid) h->current = 1 - h->current;
    }
}

void Runner::Impl::emit(rhi::CommandEncoder& encoder, const std::vector<PlanBarrier>& list) {
    std::vector<rhi::Barrier> barriers;
    for (const PlanBarrier& b : list)
        barriers.push_back({.buffer = buffers[b.resource],
                            .texture = textures[b.resource],
                            .range = b.range,
                            .before = b.before,
                            .after = b.after,
                            .alias_before = b.alias_before});
    if (!barriers.empty()) Graph::emit(encoder, barriers);
}

Result<rhi::SubmitId> Runner::Impl::submit(const Graph& graph, Slot& slot) {
    if (const auto r = realise(graph); !r) return r.error();
    if (const auto r = reserve_queries(slot, uint32_t(plan.passes.size())); !r) return r.error();
    const auto block_base = objects.blocks(graph.block_data());
    if (!block_base) return block_base.error();
    std::vector<Prepared> prepared;
    for (const GraphPass& pass : plan.passes) {
        auto p = prepare(pass, *block_base);
        if (!p) return Error{formatted("pass '{}': {}", pass.name, p.error().message), p.error().kind};
        prepared.push_back(std::move(*p));
    }
    auto encoder = device.create_encoder("frame");
    slot.names.clear();
    slot.bytes.clear();
    slot.dependencies = dependencies(plan);
    const rhi::Barrier free{.buffer = slot.ticks, .before = Access::HostRead, .after = Access::CopyWrite};
    if (slot.queries && !plan.passes.empty()) {
        encoder->write_timestamp(slot.queries, 0);
        if (slot.ticks_held) Graph::emit(*encoder, {&free, 1});
    }
    for (const PlanLevel& level : plan.levels) {
        emit(*encoder, level.barriers);
        for (const uint32_t p : level.passes) {
            const uint32_t n = uint32_t(slot.names.size());
            slot.names.push_back(plan.passes[p].name);
            slot.bytes.push_back(frame_bytes(plan, plan.passes[p]));
            if (slot.queries) encoder->write_timestamp(slot.queries, 2 * n + 1);
            record(*encoder, plan.passes[p], prepared[p]);
            if (slot.queries) encoder->write_timestamp(slot.queries, 2 * n + 2);
        }
    }
    emit(*encoder, plan.epilogue);
    if (slot.queries && !slot.names.empty()) {
        encoder->resolve_queries(slot.queries, 0, uint32_t(slot.names.size()) * 2 + 1, slot.ticks, 0);
        const rhi::Barrier arrived{.buffer = slot.ticks, .before = Access::CopyWrite, .after = Access::HostRead};
        Graph::emit(*encoder, {&arrived, 1});
    }
    return device.submit(std::move(encoder));
}

Result<rhi::SubmitId> Runner::execute(Graph& graph) {
    Impl& m = *impl_;
    KILN_ASSERT(graph.runner_ == this, "a graph that was begun without this runner");
    if (graph.begun_after_ != m.stats.frames)
        return Error{
            "render graph: begun before another graph was executed; its idea of what that one left is out of date"};
    CompileOptions compile_options{.aliasing = m.options.aliasing, .poison = m.options.poison, .tail = m.tail};
    compile_options.texture_need = [&](const rhi::TextureDesc& d) { return m.objects.need(d); };
    compile_options.buffer_need = [&](const rhi::BufferDesc& d) { return m.objects.need(d); };
    auto plan = graph.compile(compile_options);
    if (!plan) return plan.error();
    m.plan = std::move(*plan);

    const uint32_t slot_index = uint32_t(m.stats.frames % m.slots.size());
    Impl::Slot& slot = m.slots[slot_index];
    if (const auto done = m.collect(slot); !done) return done.error();
    m.settle_readbacks(false);
    // A frame number is used up also by a frame that fails below: what it asked for may be half made.
    m.objects.begin_frame(++m.stats.frames, slot_index, uint32_t(m.slots.size()));
    const auto submit = m.submit(graph, slot);
    for (uint32_t i = 0; i < m.plan.resources.size(); ++i) {
        const auto& state = graph.resources()[i].readback;
        if (!state || !m.buffers[i]) continue;
        if (!submit) {
            state->failed = submit.error();
            m.objects.give_back(m.buffers[i]);
            continue;
        }
        state->device = &m.device;
        state->buffer = m.buffers[i];
        state->submit = *submit;
        m.readbacks.push_back(state);
    }
    if (!submit) return submit.error();
    slot.submit = *submit;
    slot.collected = false;
    slot.ticks_held = slot.ticks_held || !slot.names.empty();
    m.remember();
    m.stats.objects_made = m.objects.made() + m.query_objects;
    m.stats.transient_bytes = m.objects.heap_bytes();
    m.stats.peak_bytes = m.plan.peak_bytes;
    m.stats.unaliased_bytes = m.plan.unaliased_bytes;
    m.stats.passes = uint32_t(m.plan.passes.size());
    m.stats.culled = uint32_t(m.plan.culled.size());
    m.stats.barriers = uint32_t(m.plan.barrier_count());
    m.stats.levels = uint32_t(m.plan.levels.size());
    return *submit;
}

}  // namespace kiln::render
