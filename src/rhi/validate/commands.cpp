// SPDX-License-Identifier: MIT
#include "rhi/validate/commands.h"

#include "base/format.h"
#include "rhi/texture_math.h"
#include "rhi/validate/rules.h"

#include <algorithm>

namespace kiln::rhi::validate {

ValidateEncoder::ValidateEncoder(ValidateDevice& device, std::unique_ptr<CommandEncoder> below, std::string_view label)
    : device_(device), objects_(device.objects()), below_(std::move(below)), label_(label) {
    recording_.places.push_back(formatted("'{}'", label_));
}

bool ValidateEncoder::good(const std::string& sentence) {
    if (sentence.empty()) return true;
    const std::string whole = recording_.places.back() + ": " + sentence;
    if (error_.empty()) error_ = whole;
    device_.report(whole);
    return false;
}

bool ValidateEncoder::step(std::string text, In where) {
    if (finished_ || !error_.empty()) return false;
    if (in_ != In::Nothing) {
        ++steps_in_pass_;
        text = formatted("{} ({} of '{}')", text, steps_in_pass_, pass_);
    }
    recording_.places.push_back(formatted("'{}': {}", label_, text));
    if (in_ == where) return true;
    if (where == In::Nothing) return fault(formatted("pass '{}' must end first", pass_));
    return fault("the pass has ended");
}

void ValidateEncoder::note(const Use& use) {
    recording_.events.push_back({false, use, {}, uint32_t(recording_.places.size() - 1)});
}

bool ValidateEncoder::scope_add(const Use& use) {
    for (const Use& other : scope_) {
        const bool same = (use.buffer && use.buffer == other.buffer) ||
                          (use.texture && use.texture == other.texture && overlap(use.range, other.range));
        if (!same || use.access == other.access || !(writes(use.access) || writes(other.access))) continue;
        const std::string what = use.buffer ? formatted("buffer '{}'", objects_.buffers.find(use.buffer)->label)
                                            : formatted("texture '{}'", objects_.textures.find(use.texture)->label);
        return fault(formatted("{} is used as {} and as {} at once", what, name(other.access), name(use.access)));
    }
    const bool known = std::any_of(scope_.begin(), scope_.end(), [&](const Use& o) {
        return o.buffer == use.buffer && o.texture == use.texture && o.range == use.range && o.access == use.access;
    });
    if (!known) scope_.push_back(use);
    return true;
}

void ValidateEncoder::scope_end() {
    // Two bindings of one texture whose ranges overlap without being equal, both written: one use of each part is enough.
    for (size_t i = 0; i < scope_.size(); ++i) {
        const Use& u = scope_[i];
        const bool covered = writes(u.access) && u.texture &&
                             std::any_of(scope_.begin(), scope_.begin() + ptrdiff_t(i), [&](const Use& o) {
                                 return o.texture == u.texture && overlap(o.range, u.range);
                             });
        if (!covered) note(u);
    }
    scope_.clear();
}

Use ValidateEncoder::part(const TexturePlace& place, const TextureInfo& t, Extent size, Access a) const {
    const bool volume = t.desc.dimension == Dimension::D3;
    return {.buffer = {},
            .texture = place.texture,
            .range = {place.mip, 1, volume ? 0 : place.origin.z, volume ? 1 : size.depth},
            .access = a,
            .at = place.origin,
            .size = size};
}

// ---- passes

ComputePass& ValidateEncoder::begin_compute(std::string_view label) {
    const bool ok = step(formatted("compute pass '{}'", label), In::Nothing);
    in_ = In::Compute;
    pass_ = label;
    steps_in_pass_ = 0;
    if (ok) compute_below_ = &below_->begin_compute(label);
    return *this;
}

RenderPass& ValidateEncoder::begin_render(const RenderPassDesc& desc) {
    bool ok = step(formatted("render pass '{}'", desc.label), In::Nothing);
    in_ = In::Render;
    pass_ = desc.label;
    steps_in_pass_ = 0;
    color_formats_.clear();
    depth_format_ = Format::Undefined;
    depth_read_only_ = desc.depth.read_only;
    Extent size{0, 0, 0};
    const auto attach = [&](ViewHandle view, TextureUsage usage, Access access) {
        const ViewInfo* v = find(objects_.views, view);
        const TextureInfo* t = v ? find(objects_.textures, v->desc.texture) : nullptr;
        if (!t) return Format::Undefined;
        if (!any(t->desc.usage & usage)) fault(formatted("texture '{}' lacks the usage of an attachment", t->label));
        if (v->desc.range.mip_count != 1 || v->desc.range.layer_count != 1)
            fault(formatted("an attachment is one mip and one layer of texture '{}'", t->label));
        const Extent e = mip_extent(t->desc, v->desc.range.base_mip);
        if (size.width != 0 && (e.width != size.width || e.height != size.height))
            fault(formatted("attachment '{}' is {}x{}, another is {}x{}", t->label, e.width, e.height, size.width,
                            size.height));
        size = e;
        if (error_.empty())
            scope_add({.buffer = {}, .texture = v->desc.texture, .range = v->desc.range, .access = access});
        return t->desc.format;
    };
    if (ok) {
        if (desc.colors.empty() && !desc.depth.view) fault("no attachment");
        if (desc.colors.size() > kMaxColorTargets) fault("too many colour attachments");
        for (const ColorAttachment& c : desc.colors)
            color_formats_.push_back(attach(c.view, TextureUsage::Color, Access::ColorWrite));
        if (desc.depth.view)
            depth_format_ = attach(desc.depth.view, TextureUsage::Depth,
                                   desc.depth.read_only ? Access::DepthRead : Access::DepthWrite);
        ok = error_.empty();
    }
    if (ok) render_below_ = &below_->begin_render(desc);
    return *this;
}

void ValidateEncoder::end() {
    if (in_ == In::Nothing) {
        fault("end: no pass is open");
        return;
    }
    if (error_.empty()) {
        recording_.places.push_back(formatted("'{}': render pass '{}'", label_, pass_));
        if (in_ == In::Render) scope_end();
        if (in_ == In::Render) render_below_->end();
        if (in_ == In::Compute) compute_below_->end();
    }
    in_ = In::Nothing;
    compute_ = {};
    render_ = {};
    trace_ = {};
    for (BoundGroup& g : groups_) g = {};
    push_bytes_ = 0;
    vertex_buffers_.clear();
    index_buffer_ = {};
    scope_.clear();
}

void ValidateEncoder::set_pipeline(ComputePipeline pipeline) {
    if (!step("set_pipeline", In::Compute) || !find(objects_.compute, pipeline)) return;
    compute_ = pipeline;
    trace_ = {};
    compute_below_->set_pipeline(pipeline);
}

void ValidateEncoder::set_pipeline(TracePipeline pipeline) {
    if (!step("set_pipeline", In::Compute) || !find(objects_.traces, pipeline)) return;
    trace_ = pipeline;
    compute_ = {};
    compute_below_->set_pipeline(pipeline);
}

void ValidateEncoder::set_pipeline(RenderPipeline pipeline) {
    if (!step("set_pipeline", In::Render)) return;
    const RenderInfo* p = find(objects_.render, pipeline);
    if (!p) return;
    if (p->colors != color_formats_ || p->depth != depth_format_) {
        fault(formatted("pipeline '{}' is made for attachments of other formats than the pass's", p->label));
        return;
    }
    if (depth_read_only_ && p->depth_write) {
        fault(formatted("pipeline '{}' writes depth, which the pass only reads", p->label));
        return;
    }
    render_ = pipeline;
    render_below_->set_pipeline(pipeline);
}

void ValidateEncoder::set_bind_group(uint32_t index, BindGroup group, std::span<const uint32_t> dynamic_offsets) {
    if (!step(formatted("set_bind_group {}", index), in_ == In::Render ? In::Render : In::Compute)) return;
    const GroupInfo* g = find(objects_.groups, group);
    if (!g) return;
    if (index >= kMaxBindGroups) {
        fault(formatted("there are {} bind groups", kMaxBindGroups));
        return;
    }
    size_t dynamic = 0;
    for (const BoundResource& r : g->resources) {
        if (!r.slot.dynamic_offset) continue;
        if (dynamic < dynamic_offsets.size()) {
            const uint32_t offset = dynamic_offsets[dynamic];
            const BufferInfo* b = objects_.buffers.find(r.buffer);
            if (offset % kBindingAlignment != 0)
                fault(formatted("dynamic offset {} is not a multiple of {}", offset, kBindingAlignment));
            if (b && r.offset + offset + r.size > b->desc.size)
                fault(formatted("dynamic offset {} goes past the end of buffer '{}'", offset, b->label));
        }
        ++dynamic;
    }
    if (dynamic != dynamic_offsets.size())
        fault(formatted("bind group '{}' takes {} dynamic offsets, {} are given", g->label, dynamic,
                        dynamic_offsets.size()));
    if (!error_.empty()) return;
    groups_[index] = {group, {dynamic_offsets.begin(), dynamic_offsets.end()}};
    if (in_ == In::Render) {
        render_below_->set_bind_group(index, group, dynamic_offsets);
    } else {
        compute_below_->set_bind_group(index, group, dynamic_offsets);
    }
}

void ValidateEncoder::set_push(std::span<const std::byte> bytes) {
    if (!step("set_push", in_ == In::Render ? In::Render : In::Compute)) return;
    if (bytes.size() > kMaxPushBytes || bytes.size() % 4 != 0) {
        fault(formatted("{} B of push data: at most {}, a multiple of 4", bytes.size(), kMaxPushBytes));
        return;
    }
    push_bytes_ = uint32_t(bytes.size());
    if (in_ == In::Render) {
        render_below_->set_push(bytes);
    } else {
        compute_below_->set_push(bytes);
    }
}

bool ValidateEncoder::bind_all(const PipelineInfo& p, bool compute) {
    if (push_bytes_ < p.push_bytes)
        return fault(
            formatted("pipeline '{}' reads {} B of push data, {} are set", p.label, p.push_bytes, push_bytes_));
    for (uint32_t set = 0; set < p.groups.size(); ++set) {
        if (p.groups[set].empty()) continue;
        if (!groups_[set].group)
            return fault(formatted("pipeline '{}' needs bind group {}, none is set", p.label, set));
        const GroupInfo* g = find(objects_.groups, groups_[set].group);
        if (!g) return false;
        if (g->entries != p.groups[set])
            return fault(formatted("bind group '{}' doesn't fit group {} of pipeline '{}'", g->label, set, p.label));
        for (const BoundResource& r : g->resources) {
            if (r.buffer) {
                const BufferInfo* b = find(objects_.buffers, r.buffer);
                if (!b) return false;
                if (r.slot.kind == BindingKind::BoxTree && !b->built)
                    return fault(formatted("no box tree was ever built in buffer '{}'", b->label));
                for (const PipelineInfo::Block& block : p.blocks)
                    if (block.set == set && block.binding == r.slot.binding && r.size < block.bytes)
                        return fault(formatted("binding '{}' of pipeline '{}' is {} B, bind group '{}' gives {}",
                                               block.name, p.label, block.bytes, g->label, r.size));
                if (!scope_add(whole(r.buffer, access_of(r.slot, compute)))) return false;
            } else if (r.texture) {
                if (!find(objects_.views, r.view) || !find(objects_.textures, r.texture)) return false;
                if (!scope_add(
                        {.buffer = {}, .texture = r.texture, .range = r.range, .access = access_of(r.slot, compute)}))
                    return false;
            } else if (!find(objects_.samplers, r.sampler)) {
                return false;
            }
        }
    }
    return true;
}

void ValidateEncoder::dispatch(uint32_t x, uint32_t y, uint32_t z) {
    if (!step("dispatch", In::Compute)) return;
    if (!compute_) {
        fault("no pipeline is set");
        return;
    }
    const ComputeInfo* p = find(objects_.compute, compute_);
    if (!p) return;
    if (std::max({x, y, z}) > kMaxGroupsPerDispatch) {
        fault(formatted("{}x{}x{} workgroups, the floor is {} along an axis", x, y, z, kMaxGroupsPerDispatch));
        return;
    }
    if (!bind_all(*p, true)) return;
    scope_end();
    compute_below_->dispatch(x, y, z);
}

bool ValidateEncoder::indirect(BufferHandle buffer, uint64_t offset, uint64_t bytes) {
    const BufferInfo* b = find(objects_.buffers, buffer);
    if (!b) return false;
    if (!good(check_access(Access::IndirectRead, *b))) return false;
    if (offset % 4 != 0) return fault(formatted("offset {} is not a multiple of 4", offset));
    if (offset > b->desc.size || bytes > b->desc.size - offset)
        return fault(
            formatted("{} B at {} go past the end of buffer '{}' ({} B)", bytes, offset, b->label, b->desc.size));
    return scope_add(whole(buffer, Access::IndirectRead));
}

void ValidateEncoder::dispatch_indirect(BufferHandle buffer, uint64_t offset) {
    if (!step("dispatch_indirect", In::Compute)) return;
    if (!compute_) {
        fault("no pipeline is set");
        return;
    }
    const ComputeInfo* p = find(objects_.compute, compute_);
    if (!p || !bind_all(*p, true) || !indirect(buffer, offset, 12)) return;
    scope_end();
    compute_below_->dispatch_indirect(buffer, offset);
}

void ValidateEncoder::trace(uint32_t width, uint32_t height) {
    if (!step("trace", In::Compute)) return;
    if (!trace_) {
        fault("no trace pipeline is set");
        return;
    }
    const TraceInfo* p = find(objects_.traces, trace_);
    if (!p) return;
    if (uint64_t{width} * height > kMaxRays) {
        fault(formatted("{}x{} rays, at most {}", width, height, kMaxRays));
        return;
    }
    if (!bind_all(*p, true)) return;
    scope_end();
    compute_below_->trace(width, height);
}

void ValidateEncoder::set_vertex_buffer(uint32_t slot, BufferHandle buffer, uint64_t offset) {
    if (!step("set_vertex_buffer", In::Render)) return;
    const BufferInfo* b = find(objects_.buffers, buffer);
    if (!b || !good(check_access(Access::VertexRead, *b))) return;
    if (slot >= 8 || offset >= b->desc.size) {
        fault(formatted("slot {} or offset {} is out of range", slot, offset));
        return;
    }
    if (vertex_buffers_.size() <= slot) vertex_buffers_.resize(slot + 1);
    vertex_buffers_[slot] = buffer;
    if (scope_add(whole(buffer, Access::VertexRead))) render_below_->set_vertex_buffer(slot, buffer, offset);
}

void ValidateEncoder::set_index_buffer(BufferHandle buffer, bool is_32_bit, uint64_t offset) {
    if (!step("set_index_buffer", In::Render)) return;
    const BufferInfo* b = find(objects_.buffers, buffer);
    if (!b || !good(check_access(Access::IndexRead, *b))) return;
    if (offset >= b->desc.size || offset % (is_32_bit ? 4 : 2) != 0) {
        fault(formatted("offset {} is out of range or not a multiple of the index", offset));
        return;
    }
    index_buffer_ = buffer;
    if (scope_add(whole(buffer, Access::IndexRead))) render_below_->set_index_buffer(buffer, is_32_bit, offset);
}

void ValidateEncoder::set_viewport(float x, float y, float width, float height, float depth_min, float depth_max) {
    if (!step("set_viewport", In::Render)) return;
    if (!(width > 0 && height > 0 && depth_min >= 0 && depth_max <= 1)) {
        fault("an empty viewport, or depths outside 0..1");
        return;
    }
    render_below_->set_viewport(x, y, width, height, depth_min, depth_max);
}

void ValidateEncoder::set_scissor(uint32_t x, uint32_t y, uint32_t width, uint32_t height) {
    if (step("set_scissor", In::Render)) render_below_->set_scissor(x, y, width, height);
}

void ValidateEncoder::set_blend_constant(std::array<float, 4> rgba) {
    if (step("set_blend_constant", In::Render)) render_below_->set_blend_constant(rgba);
}

bool ValidateEncoder::ready_to_draw(bool indexed, bool mesh) {
    if (!render_) return fault("no pipeline is set");
    const RenderInfo* p = find(objects_.render, render_);
    if (!p) return false;
    if (p->mesh != mesh)
        return fault(p->mesh ? formatted("pipeline '{}' has a mesh shader: draw_mesh_groups", p->label)
                             : formatted("pipeline '{}' has no mesh shader", p->label));
    for (uint32_t slot = 0; slot < p->vertex_buffers; ++slot)
        if (slot >= vertex_buffers_.size() || !vertex_buffers_[slot])
            return fault(formatted("vertex buffer {} is not set", slot));
    if (indexed && !index_buffer_) return fault("no index buffer is set");
    return bind_all(*p, false);
}

void ValidateEncoder::draw(uint32_t vertices, uint32_t instances, uint32_t first_vertex, uint32_t first_instance) {
    if (step("draw", In::Render) && ready_to_draw(false))
        render_below_->draw(vertices, instances, first_vertex, first_instance);
}

void ValidateEncoder::draw_indexed(uint32_t indices, uint32_t instances, uint32_t first_index, int32_t base_vertex,
                                   uint32_t first_instance) {
    if (step("draw_indexed", In::Render) && ready_to_draw(true))
        render_below_->draw_indexed(indices, instances, first_index, base_vertex, first_instance);
}

void ValidateEncoder::draw_indirect(BufferHandle buffer, uint64_t offset, uint32_t draws, uint32_t stride) {
    if (!step("draw_indirect", In::Render) || !ready_to_draw(false)) return;
    if (draws > 1 && !device_.caps().multi_draw_indirect) return void(fault("the device draws one at a time"));
    if (indirect(buffer, offset, draws == 0 ? 0 : uint64_t{stride} * (draws - 1) + 16))
        render_below_->draw_indirect(buffer, offset, draws, stride);
}

void ValidateEncoder::draw_indexed_indirect(BufferHandle buffer, uint64_t offset, uint32_t draws, uint32_t stride) {
    if (!step("draw_indexed_indirect", In::Render) || !ready_to_draw(true)) return;
    if (draws > 1 && !device_.caps().multi_draw_indirect) return void(fault("the device draws one at a time"));
    if (indirect(buffer, offset, draws == 0 ? 0 : uint64_t{stride} * (draws - 1) + 20))
        render_below_->draw_indexed_indirect(buffer, offset, draws, stride);
}

void ValidateEncoder::draw_mesh_groups(uint32_t x, uint32_t y, uint32_t z) {
    if (!step("draw_mesh_groups", In::Render) || !ready_to_draw(false, true)) return;
    if (std::max({x, y, z}) > kMaxGroupsPerDispatch || uint64_t{x} * y * z > kMaxMeshGroups) {
        fault(formatted("{}x{}x{} workgroups, the floor is {} along an axis and {} in all", x, y, z,
                        kMaxGroupsPerDispatch, kMaxMeshGroups));
        return;
    }
    render_below_->draw_mesh_groups(x, y, z);
}

void ValidateEncoder::build_box_tree(BufferHandle tree, BufferHandle boxes, uint64_t offset, uint32_t count) {
    if (!step("build_box_tree", In::Nothing)) return;
    if (!device_.caps().rt_pipeline) return void(fault("the device has no ray-tracing pipelines"));
    BufferInfo* to = find(objects_.buffers, tree);
    const BufferInfo* from = find(objects_.buffers, boxes);
    if (!to || !from || !good(check_access(Access::BoxTreeWrite, *to)) || !good(check_access(Access::BoxesRead, *from)))
        return;
    if (count == 0) return void(fault("no boxes"));
    if (offset % 8 != 0 || offset > from->desc.size || count * sizeof(Box) > from->desc.size - offset)
        return void(fault(formatted("{} boxes at {}: not a multiple of 8, or past the end of buffer '{}' ({} B)", count,
                                    offset, from->label, from->desc.size)));
    if (const uint64_t need = device_.box_tree_bytes(count); to->desc.size < need)
        return void(fault(
            formatted("a tree of {} boxes takes {} B, buffer '{}' has {}", count, need, to->label, to->desc.size)));
    note(whole(boxes, Access::BoxesRead));
    note(whole(tree, Access::BoxTreeWrite));
    to->built = true;
    below_->build_box_tree(tree, boxes, offset, count);
}

// ---- copies

void ValidateEncoder::copy_buffer(BufferHandle src, uint64_t src_offset, BufferHandle dst, uint64_t dst_offset,
                                  uint64_t size) {
    if (!step("copy_buffer", In::Nothing)) return;
    const BufferInfo* from = find(objects_.buffers, src);
    const BufferInfo* to = find(objects_.buffers, dst);
    if (!from || !to || !good(check_access(Access::CopyRead, *from))) return;
    if (!any(to->desc.usage & BufferUsage::CopyDst))
        return void(fault(formatted("buffer '{}' lacks usage CopyDst", to->label)));
    if (src == dst) return void(fault(formatted("buffer '{}' is copied to itself", from->label)));
    if (src_offset % 4 != 0 || dst_offset % 4 != 0 || size % 4 != 0)
        return void(fault("offsets and size must be multiples of 4"));
    for (const auto& [b, offset] : {std::pair(from, src_offset), std::pair(to, dst_offset)})
        if (offset > b->desc.size || size > b->desc.size - offset)
            return void(fault(
                formatted("{} B at {} go past the end of buffer '{}' ({} B)", size, offset, b->label, b->desc.size)));
    note(whole(src, Access::CopyRead));
    note(whole(dst, Access::CopyWrite));
    below_->copy_buffer(src, src_offset, dst, dst_offset, size);
}

void ValidateEncoder::copy_buffer_to_texture(const BufferLayout& src, const TexturePlace& dst, Extent size) {
    if (!step("copy_buffer_to_texture", In::Nothing)) return;
    const BufferInfo* from = find(objects_.buffers, src.buffer);
    const TextureInfo* to = find(objects_.textures, dst.texture);
    if (!from || !to || !good(check_access(Access::CopyRead, *from)) || !good(check_access(Access::CopyWrite, *to)) ||
        !good(check_region(*to, dst, size)) || !good(check_rows(*to, src, size, from->desc.size, device_.limits())))
        return;
    note(whole(src.buffer, Access::CopyRead));
    note(part(dst, *to, size, Access::CopyWrite));
    below_->copy_buffer_to_texture(src, dst, size);
}

void ValidateEncoder::copy_texture_to_buffer(const TexturePlace& src, const BufferLayout& dst, Extent size) {
    if (!step("copy_texture_to_buffer", In::Nothing)) return;
    const TextureInfo* from = find(objects_.textures, src.texture);
    const BufferInfo* to = find(objects_.buffers, dst.buffer);
    if (!from || !to || !good(check_access(Access::CopyRead, *from))) return;
    if (!any(to->desc.usage & BufferUsage::CopyDst))
        return void(fault(formatted("buffer '{}' lacks usage CopyDst", to->label)));
    if (!good(check_region(*from, src, size)) || !good(check_rows(*from, dst, size, to->desc.size, device_.limits())))
        return;
    note(part(src, *from, size, Access::CopyRead));
    note(whole(dst.buffer, Access::CopyWrite));
    below_->copy_texture_to_buffer(src, dst, size);
}

void ValidateEncoder::copy_texture(const TexturePlace& src, const TexturePlace& dst, Extent size) {
    if (!step("copy_texture", In::Nothing)) return;
    const TextureInfo* from = find(objects_.textures, src.texture);
    const TextureInfo* to = find(objects_.textures, dst.texture);
    if (!from || !to || !good(check_access(Access::CopyRead, *from)) || !good(check_access(Access::CopyWrite, *to)) ||
        !good(check_region(*from, src, size)) || !good(check_region(*to, dst, size)))
        return;
    if (from->desc.format != to->desc.format)
        return void(fault(formatted("'{}' is {}, '{}' is {}", from->label, name(from->desc.format), to->label,
                                    name(to->desc.format))));
    const Use read = part(src, *from, size, Access::CopyRead);
    const Use write = part(dst, *to, size, Access::CopyWrite);
    if (src.texture == dst.texture && overlap(read.range, write.range))
        return void(fault(formatted("texture '{}' is copied onto the same mip and layer", from->label)));
    note(read);
    note(write);
    below_->copy_texture(src, dst, size);
}

void ValidateEncoder::clear_buffer(BufferHandle buffer, uint64_t offset, uint64_t size, uint32_t word) {
    if (!step("clear_buffer", In::Nothing)) return;
    const BufferInfo* b = find(objects_.buffers, buffer);
    if (!b) return;
    if (!any(b->desc.usage & BufferUsage::CopyDst))
        return void(fault(formatted("buffer '{}' lacks usage CopyDst", b->label)));
    if (offset % 4 != 0 || (size != kWholeSize && size % 4 != 0))
        return void(fault("offset and size must be multiples of 4"));
    if (offset > b->desc.size || (size != kWholeSize && size > b->desc.size - offset))
        return void(
            fault(formatted("{} B at {} go past the end of buffer '{}' ({} B)", size, offset, b->label, b->desc.size)));
    note(whole(buffer, Access::CopyWrite));
    below_->clear_buffer(buffer, offset, size, word);
}

void ValidateEncoder::clear_texture(TextureHandle texture, std::array<float, 4> value, Subresources range) {
    if (!step("clear_texture", In::Nothing)) return;
    const TextureInfo* t = find(objects_.textures, texture);
    if (!t || !good(check_access(Access::CopyWrite, *t))) return;
    const Subresources r = resolved(t->desc, range);
    if (r.mip_count == 0 || r.layer_count == 0 || r.base_mip + r.mip_count > t->desc.mips ||
        r.base_layer + r.layer_count > layer_count(t->desc))
        return void(fault(formatted("the range is beyond texture '{}'", t->label)));
    note({.buffer = {}, .texture = texture, .range = r, .access = Access::CopyWrite});
    below_->clear_texture(texture, value, range);
}

// ---- the rest

void ValidateEncoder::barrier(BarrierKey key, std::span<const Barrier> barriers) {
    if (!step("barrier", In::Nothing)) return;
    for (const Barrier& b : barriers) {
        if (bool(b.buffer) == bool(b.texture)) return void(fault("a barrier is on a buffer or on a texture"));
        if (!any(b.after)) return void(fault("`after` is Undefined"));
        if (b.buffer) {
            const BufferInfo* info = find(objects_.buffers, b.buffer);
            if (!info || !good(check_access(b.after, *info))) return;
        } else {
            const TextureInfo* info = find(objects_.textures, b.texture);
            if (!info || !good(check_access(b.after, *info))) return;
            const Subresources r = resolved(info->desc, b.range);
            if (r.mip_count == 0 || r.layer_count == 0 || r.base_mip + r.mip_count > info->desc.mips ||
                r.base_layer + r.layer_count > layer_count(info->desc))
                return void(fault(formatted("the range is beyond texture '{}'", info->label)));
        }
        recording_.events.push_back({true, {}, b, uint32_t(recording_.places.size() - 1)});
    }
    below_->barrier(key, barriers);
}

void ValidateEncoder::write_timestamp(QuerySet set, uint32_t index) {
    if (!step("write_timestamp", In::Nothing)) return;
    QueryInfo* q = find(objects_.queries, set);
    if (!q) return;
    if (index >= q->written.size())
        return void(fault(formatted("query {} of '{}', which has {}", index, q->label, q->written.size())));
    q->written[index] = true;
    below_->write_timestamp(set, index);
}

void ValidateEncoder::resolve_queries(QuerySet set, uint32_t first, uint32_t count, BufferHandle dst, uint64_t offset) {
    if (!step("resolve_queries", In::Nothing)) return;
    const QueryInfo* q = find(objects_.queries, set);
    const BufferInfo* b = find(objects_.buffers, dst);
    if (!q || !b) return;
    if (!any(b->desc.usage & BufferUsage::QueryResolve))
        return void(fault(formatted("buffer '{}' lacks usage QueryResolve", b->label)));
    if (uint64_t{first} + count > q->written.size())
        return void(fault(formatted("'{}' has {} queries", q->label, q->written.size())));
    for (uint32_t i = first; i < first + count; ++i)
        if (!q->written[i]) return void(fault(formatted("query {} of '{}' was never written", i, q->label)));
    if (offset % 8 != 0 || offset > b->desc.size || count * 8ull > b->desc.size - offset)
        return void(fault(formatted("{} B at {}: not a multiple of 8, or past the end of buffer '{}' ({} B)",
                                    count * 8ull, offset, b->label, b->desc.size)));
    note(whole(dst, Access::CopyWrite));
    below_->resolve_queries(set, first, count, dst, offset);
}

void ValidateEncoder::push_label(std::string_view label) {
    ++labels_;
    if (error_.empty()) below_->push_label(label);
}

void ValidateEncoder::pop_label() {
    if (labels_ == 0) return void(fault("pop_label without a push_label"));
    --labels_;
    if (error_.empty()) below_->pop_label();
}

void ValidateEncoder::finish() {
    if (in_ != In::Nothing) fault(formatted("submit: pass '{}' is still open", pass_));
    if (labels_ != 0 && error_.empty()) fault(formatted("submit: {} labels are still open", labels_));
    finished_ = true;
}

}  // namespace kiln::rhi::validate
