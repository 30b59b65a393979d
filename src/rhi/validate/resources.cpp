// SPDX-License-Identifier: MIT
// Objects: what their descriptions may say.
#include "rhi/validate/device.h"

#include "base/format.h"
#include "rhi/texture_math.h"
#include "rhi/validate/rules.h"

#include <algorithm>

namespace kiln::rhi::validate {

namespace {

bool is_buffer(BindingKind kind) {
    return kind == BindingKind::UniformBuffer || kind == BindingKind::StorageBuffer ||
           kind == BindingKind::StorageBufferReadOnly;
}

bool is_storage_texture(BindingKind kind) {
    return kind == BindingKind::StorageTexture || kind == BindingKind::StorageTextureReadOnly;
}

std::string check(const BufferDesc& d, const Caps& caps) {
    if (d.size == 0) return "size is 0";
    if (d.usage == BufferUsage::None) return "no usage";
    if (d.memory == MemoryKind::Readback && any(d.usage & ~(BufferUsage::CopyDst | BufferUsage::QueryResolve)))
        return "readback memory is for CopyDst and QueryResolve only";
    if (d.memory == MemoryKind::Upload && any(d.usage & ~BufferUsage::CopySrc))
        return "upload memory is for CopySrc only";
    if (d.memory != MemoryKind::Device && d.heap) return "a heap holds device memory only";
    if (any(d.usage & BufferUsage::Address) && !caps.buffer_address)
        return "usage Address needs the capability buffer_address";
    if (any(d.usage & (BufferUsage::Boxes | BufferUsage::BoxTree)) && !caps.rt_pipeline)
        return "usages Boxes and BoxTree need the capability rt_pipeline";
    if (any(d.usage & BufferUsage::BoxTree) && (d.usage != BufferUsage::BoxTree || d.heap))
        return "usage BoxTree stands alone, in memory of its own";
    return {};
}

std::string check(const TextureDesc& d, const Caps& caps) {
    if (d.format == Format::Undefined) return "no format";
    if (d.usage == TextureUsage::None) return "no usage";
    if (d.size.width == 0 || d.size.height == 0 || d.size.depth == 0) return "a size of 0";
    const FormatInfo& f = info(d.format);
    const uint32_t most = d.dimension == Dimension::D3 ? kMaxTexture3d : kMaxTexture2d;
    if (std::max(d.size.width, d.size.height) > most || (d.dimension == Dimension::D3 && d.size.depth > most))
        return formatted("{}x{}x{} is beyond the floor of {} along an edge", d.size.width, d.size.height, d.size.depth,
                         most);
    if (d.dimension == Dimension::D2Array && d.size.depth > kMaxTextureLayers)
        return formatted("{} layers, the floor is {}", d.size.depth, kMaxTextureLayers);
    if (d.dimension == Dimension::D1 && (d.size.height != 1 || d.mips != 1))
        return "a D1 texture has height 1 and one mip";
    if ((d.dimension == Dimension::D1 || d.dimension == Dimension::D2) && d.size.depth != 1)
        return "depth is not 1; use D2Array or D3";
    if (d.mips == 0 || d.mips > full_mip_count(d))
        return formatted("{} mips, there can be {}", d.mips, full_mip_count(d));
    if (any(d.usage & TextureUsage::Storage) && !f.core_storage &&
        !(caps.storage_r16f && f.sample_type != SampleType::Depth))
        return formatted("{} can't be a storage texture here", f.name);
    if (any(d.usage & TextureUsage::Depth) != (f.sample_type == SampleType::Depth) &&
        any(d.usage & (TextureUsage::Depth | TextureUsage::Color)))
        return formatted("{} as a {} attachment", f.name, any(d.usage & TextureUsage::Depth) ? "depth" : "colour");
    return {};
}

}  // namespace

std::string ValidateDevice::check_placement(HeapHandle heap, uint64_t offset, const MemoryNeed& need) {
    if (!heap) return {};
    const HeapInfo* h = objects_.heaps.find(heap);
    if (!h) return objects_.heaps.why_not(heap);
    if (offset % need.alignment != 0)
        return formatted("heap offset {} is not a multiple of {}", offset, need.alignment);
    if (offset > h->size || need.size > h->size - offset)
        return formatted("{} B at {} go past the end of heap '{}' ({} B)", need.size, offset, h->label, h->size);
    return {};
}

Result<HeapHandle> ValidateDevice::create_heap(const HeapDesc& desc) {
    if (desc.size == 0) return refuse(formatted("heap '{}': size is 0", desc.label));
    Result<HeapHandle> out = below_->create_heap(desc);
    if (out) objects_.heaps.set(*out, {std::string(desc.label), desc.size});
    return out;
}

Result<BufferHandle> ValidateDevice::create_buffer(const BufferDesc& desc) {
    std::string fault = check(desc, caps());
    MemoryNeed need;
    if (fault.empty() && desc.heap) {
        need = below_->memory_need(desc);
        fault = check_placement(desc.heap, desc.heap_offset, need);
    }
    if (!fault.empty()) return refuse(formatted("buffer '{}': {}", desc.label, fault));
    Result<BufferHandle> out = below_->create_buffer(desc);
    if (!out) return out;
    BufferInfo made{.label = std::string(desc.label), .desc = desc, .need = need};
    made.desc.label = {};
    objects_.buffers.set(*out, std::move(made));
    tracker_.add(*out, bool(desc.heap));
    return out;
}

Result<TextureHandle> ValidateDevice::create_texture(const TextureDesc& desc) {
    std::string fault = check(desc, caps());
    MemoryNeed need;
    if (fault.empty() && desc.heap) {
        need = below_->memory_need(desc);
        fault = check_placement(desc.heap, desc.heap_offset, need);
    }
    if (!fault.empty()) return refuse(formatted("texture '{}': {}", desc.label, fault));
    Result<TextureHandle> out = below_->create_texture(desc);
    if (!out) return out;
    TextureInfo made{.label = std::string(desc.label), .desc = desc, .need = need, .whole = below_->whole_view(*out)};
    made.desc.label = {};
    if (made.whole)
        objects_.views.set(made.whole,
                           {made.label, {.texture = *out, .range = resolved(desc, {}), .as_array = true}, true});
    objects_.textures.set(*out, std::move(made));
    tracker_.add(*out);
    return out;
}

Result<ViewHandle> ValidateDevice::create_view(const ViewDesc& desc) {
    const TextureInfo* t = objects_.textures.find(desc.texture);
    if (!t) return refuse(formatted("view '{}': {}", desc.label, objects_.textures.why_not(desc.texture)));
    const Subresources r = resolved(t->desc, desc.range);
    if (r.mip_count == 0 || r.layer_count == 0 || r.base_mip + r.mip_count > t->desc.mips ||
        r.base_layer + r.layer_count > layer_count(t->desc))
        return refuse(formatted("view '{}': mips {}+{}, layers {}+{} are beyond texture '{}' ({} mips, {} layers)",
                                desc.label, r.base_mip, r.mip_count, r.base_layer, r.layer_count, t->label,
                                t->desc.mips, layer_count(t->desc)));
    Result<ViewHandle> out = below_->create_view(desc);
    if (!out) return out;
    objects_.views.set(
        *out, {std::string(desc.label), {.texture = desc.texture, .range = r, .as_array = desc.as_array}, false});
    return out;
}

Result<SamplerHandle> ValidateDevice::create_sampler(const SamplerDesc& desc) {
    if (!(desc.lod_min <= desc.lod_max))
        return refuse(formatted("sampler '{}': lod_min {} > lod_max {}", desc.label, desc.lod_min, desc.lod_max));
    Result<SamplerHandle> out = below_->create_sampler(desc);
    if (out) objects_.samplers.set(*out, {std::string(desc.label)});
    return out;
}

Result<ShaderModule> ValidateDevice::create_shader_module(const ShaderModuleDesc& desc) {
    Result<ShaderModule> out = below_->create_shader_module(desc);
    if (out) objects_.shaders.set(*out, {std::string(desc.label), *below_->reflection(*out)});
    return out;
}

Result<BindGroupLayout> ValidateDevice::create_bind_group_layout(const BindGroupLayoutDesc& desc) {
    std::vector<BindGroupLayoutEntry> entries(desc.entries.begin(), desc.entries.end());
    std::sort(entries.begin(), entries.end(), [](const auto& a, const auto& b) { return a.binding < b.binding; });
    std::string fault = check_counts({&entries, 1});
    for (size_t i = 0; i < entries.size() && fault.empty(); ++i) {
        const BindGroupLayoutEntry& e = entries[i];
        if (i > 0 && entries[i - 1].binding == e.binding) fault = formatted("binding {} twice", e.binding);
        if (!any(e.stages)) fault = formatted("binding {} is for no stage", e.binding);
        if (e.dynamic_offset && !is_buffer(e.kind))
            fault = formatted("binding {}: only buffers have dynamic offsets", e.binding);
        if (is_storage_texture(e.kind) && e.format == Format::Undefined)
            fault = formatted("binding {}: a storage texture has a format", e.binding);
    }
    if (!fault.empty()) return refuse(formatted("bind group layout '{}': {}", desc.label, fault));
    Result<BindGroupLayout> out = below_->create_bind_group_layout(desc);
    if (out) objects_.group_layouts.set(*out, {std::string(desc.label), std::move(entries), false});
    return out;
}

std::string ValidateDevice::check_entry(const BindGroupLayoutEntry& slot, const BindGroupEntry& entry,
                                        BoundResource& out) {
    out.slot = slot;
    if (is_buffer(slot.kind)) {
        const BufferInfo* b = objects_.buffers.find(entry.buffer);
        if (!b) return objects_.buffers.why_not(entry.buffer);
        const bool uniform = slot.kind == BindingKind::UniformBuffer;
        if (!any(b->desc.usage & (uniform ? BufferUsage::Uniform : BufferUsage::Storage)))
            return formatted("buffer '{}' lacks usage {}", b->label, uniform ? "Uniform" : "Storage");
        if (entry.offset % kBindingAlignment != 0)
            return formatted("offset {} of buffer '{}' is not a multiple of {}", entry.offset, b->label,
                             kBindingAlignment);
        if (entry.offset >= b->desc.size)
            return formatted("offset {} is past the end of buffer '{}' ({} B)", entry.offset, b->label, b->desc.size);
        const uint64_t size = entry.size == kWholeSize ? b->desc.size - entry.offset : entry.size;
        if (size == 0 || size > b->desc.size - entry.offset)
            return formatted("{} B at {} go past the end of buffer '{}' ({} B)", size, entry.offset, b->label,
                             b->desc.size);
        const uint64_t most = uniform ? kMaxUniformBinding : kMaxStorageBinding;
        if (size > most) return formatted("{} B of buffer '{}' in one binding, the floor is {}", size, b->label, most);
        out.buffer = entry.buffer;
        out.offset = entry.offset;
        out.size = size;
        return {};
    }
    if (slot.kind == BindingKind::BoxTree) {
        const BufferInfo* b = objects_.buffers.find(entry.buffer);
        if (!b) return objects_.buffers.why_not(entry.buffer);
        if (!any(b->desc.usage & BufferUsage::BoxTree)) return formatted("buffer '{}' lacks usage BoxTree", b->label);
        out.buffer = entry.buffer;
        out.size = b->desc.size;
        return {};
    }
    if (slot.kind == BindingKind::Sampler) {
        if (!objects_.samplers.find(entry.sampler)) return objects_.samplers.why_not(entry.sampler);
        out.sampler = entry.sampler;
        return {};
    }
    const ViewInfo* v = objects_.views.find(entry.view);
    if (!v) return objects_.views.why_not(entry.view);
    const TextureInfo* t = objects_.textures.find(v->desc.texture);
    if (!t) return objects_.textures.why_not(v->desc.texture);
    const bool storage = is_storage_texture(slot.kind);
    if (!any(t->desc.usage & (storage ? TextureUsage::Storage : TextureUsage::Sampled)))
        return formatted("texture '{}' lacks usage {}", t->label, storage ? "Storage" : "Sampled");
    const Dimension seen =
        t->desc.dimension == Dimension::D2Array && v->desc.range.layer_count == 1 && !v->desc.as_array
            ? Dimension::D2
            : t->desc.dimension;
    if (seen != slot.dimension)
        return formatted("the view of texture '{}' has another dimension than the shader's", t->label);
    if (storage && t->desc.format != slot.format)
        return formatted("texture '{}' is {}, the shader stores {}", t->label, name(t->desc.format), name(slot.format));
    if (storage && v->desc.range.mip_count != 1)
        return formatted("a storage binding of texture '{}' must be of one mip", t->label);
    const SampleType type = rhi::info(t->desc.format).sample_type;
    if (!storage && (type == SampleType::Uint) != (slot.sample_type == SampleType::Uint))
        return formatted("texture '{}' is {}, the shader reads another kind of number", t->label, name(t->desc.format));
    out.texture = v->desc.texture;
    out.view = entry.view;
    out.range = v->desc.range;
    return {};
}

Result<BindGroup> ValidateDevice::create_bind_group(const BindGroupDesc& desc) {
    const GroupLayoutInfo* layout = objects_.group_layouts.find(desc.layout);
    if (!layout)
        return refuse(formatted("bind group '{}': {}", desc.label, objects_.group_layouts.why_not(desc.layout)));
    GroupInfo made{.label = std::string(desc.label), .entries = layout->entries, .resources = {}};
    std::string fault;
    for (const BindGroupLayoutEntry& slot : layout->entries) {
        const auto given = std::find_if(desc.entries.begin(), desc.entries.end(),
                                        [&](const auto& e) { return e.binding == slot.binding; });
        if (given == desc.entries.end()) {
            fault = formatted("binding {} ({}) is missing", slot.binding, name(slot.kind));
        } else {
            BoundResource bound;
            fault = check_entry(slot, *given, bound);
            if (!fault.empty()) fault = formatted("binding {}: {}", slot.binding, fault);
            made.resources.push_back(bound);
        }
        if (!fault.empty()) break;
    }
    if (fault.empty() && desc.entries.size() != layout->entries.size())
        fault = formatted("{} entries for a layout of {}", desc.entries.size(), layout->entries.size());
    if (!fault.empty()) return refuse(formatted("bind group '{}': {}", desc.label, fault));
    Result<BindGroup> out = below_->create_bind_group(desc);
    if (out) objects_.groups.set(*out, std::move(made));
    return out;
}

Result<PipelineLayout> ValidateDevice::create_pipeline_layout(const PipelineLayoutDesc& desc) {
    LayoutInfo made{.label = std::string(desc.label), .groups = {}, .push_bytes = desc.push_bytes};
    std::string fault;
    for (const BindGroupLayout group : desc.groups) {
        const GroupLayoutInfo* l = objects_.group_layouts.find(group);
        if (!l) return refuse(formatted("pipeline layout '{}': {}", desc.label, objects_.group_layouts.why_not(group)));
        made.groups.push_back(l->entries);
    }
    fault = check_counts(made.groups);
    if (fault.empty() && (desc.push_bytes > kMaxPushBytes || desc.push_bytes % 4 != 0))
        fault = formatted("{} B of push data: at most {}, a multiple of 4", desc.push_bytes, kMaxPushBytes);
    if (!fault.empty()) return refuse(formatted("pipeline layout '{}': {}", desc.label, fault));
    Result<PipelineLayout> out = below_->create_pipeline_layout(desc);
    if (out) objects_.layouts.set(*out, std::move(made));
    return out;
}

std::string ValidateDevice::fill_pipeline(PipelineInfo& out, std::span<const Reflection* const> shaders,
                                          PipelineLayout layout) {
    uint32_t sets = 0;
    for (const Reflection* r : shaders) {
        if (const std::vector<std::string> beyond = check_floor(*r, caps()); !beyond.empty()) return beyond.front();
        for (const ReflectedBinding& b : r->bindings) {
            sets = std::max(sets, b.set + 1);
            if (is_buffer(b.kind) && b.block_size > 0) out.blocks.push_back({b.set, b.binding, b.block_size, b.name});
        }
        out.push_bytes = std::max(out.push_bytes, r->push_bytes);
    }
    std::vector<std::vector<BindGroupLayoutEntry>> wanted;
    for (uint32_t set = 0; set < sets; ++set) {
        auto entries = layout_entries(shaders, set);
        if (!entries) return entries.error().message;
        wanted.push_back(std::move(*entries));
    }
    if (!layout) {
        out.groups = std::move(wanted);
        return check_counts(out.groups);
    }
    const LayoutInfo* l = objects_.layouts.find(layout);
    if (!l) return objects_.layouts.why_not(layout);
    if (l->push_bytes < out.push_bytes)
        return formatted("layout '{}' has {} B of push data, the shader reads {}", l->label, l->push_bytes,
                         out.push_bytes);
    for (uint32_t set = 0; set < sets; ++set)
        for (const BindGroupLayoutEntry& e : wanted[set]) {
            const auto* given = set < l->groups.size() ? &l->groups[set] : nullptr;
            const bool has = given && std::any_of(given->begin(), given->end(), [&](const BindGroupLayoutEntry& g) {
                                 return g.binding == e.binding && g.kind == e.kind && g.format == e.format &&
                                        (is_buffer(g.kind) || g.kind == BindingKind::Sampler ||
                                         g.kind == BindingKind::BoxTree || g.dimension == e.dimension) &&
                                        !any(e.stages & ~g.stages);
                             });
            if (!has)
                return formatted("layout '{}' has no fitting entry for set {} binding {} ({})", l->label, set,
                                 e.binding, name(e.kind));
        }
    out.groups = l->groups;
    return {};
}

Result<ComputePipeline> ValidateDevice::create_compute_pipeline(const ComputePipelineDesc& desc) {
    const ShaderInfo* shader = objects_.shaders.find(desc.shader);
    if (!shader) return refuse(formatted("pipeline '{}': {}", desc.label, objects_.shaders.why_not(desc.shader)));
    if (shader->reflection.stage != ShaderStage::Compute)
        return refuse(formatted("pipeline '{}': '{}' is not a compute shader", desc.label, shader->label));
    ComputeInfo made;
    made.label = desc.label;
    const Reflection* const shaders[] = {&shader->reflection};
    if (std::string fault = fill_pipeline(made, shaders, desc.layout); !fault.empty())
        return refuse(formatted("pipeline '{}': {}", desc.label, fault));
    Result<ComputePipeline> out = below_->create_compute_pipeline(desc);
    if (out) objects_.compute.set(*out, std::move(made));
    return out;
}

Result<RenderPipeline> ValidateDevice::create_render_pipeline(const RenderPipelineDesc& desc) {
    RenderInfo made;
    made.label = desc.label;
    made.mesh = bool(desc.mesh);
    std::vector<const Reflection*> shaders;
    std::string fault;
    if (made.mesh) {
        fault = add_stage(shaders, desc.mesh, ShaderStage::Mesh);
        if (fault.empty() && (desc.vertex || !desc.vertex_buffers.empty()))
            fault = "a mesh shader takes the place of the vertex shader and its buffers";
    } else {
        fault = add_stage(shaders, desc.vertex, ShaderStage::Vertex);
    }
    if (fault.empty() && desc.fragment) fault = add_stage(shaders, desc.fragment, ShaderStage::Fragment);
    if (fault.empty()) fault = fill_pipeline(made, shaders, desc.layout);
    if (fault.empty() && desc.colors.size() > kMaxColorTargets)
        fault = formatted("{} colour targets, the floor is {}", desc.colors.size(), kMaxColorTargets);
    if (fault.empty() && desc.colors.empty() && desc.depth.format == Format::Undefined)
        fault = "neither colour nor depth";
    for (const ColorTarget& c : desc.colors) {
        if (c.format == Format::Undefined || is_depth(c.format))
            fault = formatted("{} as a colour target", name(c.format));
        if (c.blend && rhi::info(c.format).sample_type != SampleType::Float)
            fault = formatted("{} can't be blended", name(c.format));
        made.colors.push_back(c.format);
    }
    if (desc.depth.format != Format::Undefined && !is_depth(desc.depth.format))
        fault = formatted("{} as depth", name(desc.depth.format));
    for (const VertexBufferLayout& b : desc.vertex_buffers)
        for (const VertexAttribute& a : b.attributes)
            if (a.offset + bytes_per_vertex_attribute(a.format) > b.stride)
                fault = formatted("vertex attribute {} ends past the stride of {} B", a.location, b.stride);
    if (!fault.empty()) return refuse(formatted("pipeline '{}': {}", desc.label, fault));
    made.depth = desc.depth.format;
    made.depth_write = desc.depth.write;
    made.vertex_buffers = uint32_t(desc.vertex_buffers.size());
    Result<RenderPipeline> out = below_->create_render_pipeline(desc);
    if (out) objects_.render.set(*out, std::move(made));
    return out;
}

std::string ValidateDevice::add_stage(std::vector<const Reflection*>& out, ShaderModule handle, ShaderStage stage) {
    const ShaderInfo* shader = objects_.shaders.find(handle);
    if (!shader) return objects_.shaders.why_not(handle);
    if (shader->reflection.stage != stage) return formatted("'{}' is not a {} shader", shader->label, name(stage));
    out.push_back(&shader->reflection);
    return {};
}

Result<TracePipeline> ValidateDevice::create_trace_pipeline(const TracePipelineDesc& desc) {
    TraceInfo made;
    made.label = desc.label;
    std::vector<const Reflection*> shaders;
    std::string fault = caps().rt_pipeline ? "" : "the device has no ray-tracing pipelines";
    for (const auto& [shader, stage] :
         {std::pair(desc.raygen, ShaderStage::RayGen), std::pair(desc.miss, ShaderStage::Miss),
          std::pair(desc.intersection, ShaderStage::Intersection),
          std::pair(desc.closest_hit, ShaderStage::ClosestHit)})
        if (fault.empty()) fault = add_stage(shaders, shader, stage);
    if (fault.empty()) fault = fill_pipeline(made, shaders, desc.layout);
    if (!fault.empty()) return refuse(formatted("pipeline '{}': {}", desc.label, fault));
    Result<TracePipeline> out = below_->create_trace_pipeline(desc);
    if (out) objects_.traces.set(*out, std::move(made));
    return out;
}

Result<QuerySet> ValidateDevice::create_query_set(const QuerySetDesc& desc) {
    if (!caps().timestamp) return refuse(formatted("query set '{}': the device has no timestamps", desc.label));
    if (desc.count == 0 || desc.count > 4096)
        return refuse(formatted("query set '{}': {} queries, at least 1 and at most 4096", desc.label, desc.count));
    Result<QuerySet> out = below_->create_query_set(desc);
    if (out) objects_.queries.set(*out, {std::string(desc.label), std::vector<bool>(desc.count)});
    return out;
}

void ValidateDevice::destroy(HeapHandle handle) {
    const HeapInfo* h = objects_.heaps.find(handle);
    if (!h) return report_("destroy: " + objects_.heaps.why_not(handle));
    bool inhabited = false;
    objects_.buffers.for_each(
        [&](BufferHandle, const BufferInfo& b) { inhabited = inhabited || b.desc.heap == handle; });
    objects_.textures.for_each(
        [&](TextureHandle, const TextureInfo& t) { inhabited = inhabited || t.desc.heap == handle; });
    if (inhabited) return report_(formatted("destroy: heap '{}' still holds resources", h->label));
    forget(objects_.heaps, handle);
}

void ValidateDevice::destroy(BufferHandle handle) {
    tracker_.remove(handle);
    std::erase(written_buffers_, handle);
    forget(objects_.buffers, handle);
}

void ValidateDevice::destroy(TextureHandle handle) {
    if (const TextureInfo* t = objects_.textures.find(handle); t && t->shown)
        return report_(formatted("destroy: the texture of surface '{}' is its own; present it", t->label));
    if (const TextureInfo* t = objects_.textures.find(handle); t && t->whole) objects_.views.erase(t->whole);
    tracker_.remove(handle);
    std::erase_if(written_textures_, [&](const TextureWrite& w) { return w.place.texture == handle; });
    forget(objects_.textures, handle);
}

void ValidateDevice::destroy(ViewHandle handle) {
    if (const ViewInfo* v = objects_.views.find(handle); v && v->whole)
        return report_(formatted("destroy: the whole view of texture '{}' goes with it", v->label));
    forget(objects_.views, handle);
}

void ValidateDevice::destroy(BindGroupLayout handle) {
    if (const GroupLayoutInfo* l = objects_.group_layouts.find(handle); l && l->owned)
        return report_(formatted("destroy: {} belongs to the pipelines that made it", l->label));
    forget(objects_.group_layouts, handle);
}

}  // namespace kiln::rhi::validate
