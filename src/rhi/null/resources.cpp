// SPDX-License-Identifier: MIT
// Objects of the null device.
#include "rhi/null/device.h"

namespace kiln::rhi::null {

namespace {

uint64_t texture_bytes(const TextureDesc& d) {
    uint64_t bytes = 0;
    for (uint32_t mip = 0; mip < d.mips; ++mip) {
        const Extent e = mip_extent(d, mip);
        bytes += uint64_t{e.width} * e.height * e.depth * bytes_per_texel(d.format);
    }
    return bytes;
}

}  // namespace

std::vector<std::byte>& NullDevice::bytes_of(Texture& texture, uint32_t mip, uint32_t layer) {
    static std::vector<std::byte> none;
    const uint32_t index = mip + layer * texture.desc.mips;
    if (mip >= texture.desc.mips || index >= texture.subresources.size()) return none = {};
    std::vector<std::byte>& bytes = texture.subresources[index];
    if (bytes.empty()) {
        const Extent e = mip_extent(texture.desc, mip);
        const uint32_t depth = texture.desc.dimension == Dimension::D3 ? e.depth : 1;
        bytes.resize(uint64_t{e.width} * e.height * depth * bytes_per_texel(texture.desc.format));
    }
    return bytes;
}

Result<HeapHandle> NullDevice::create_heap(const HeapDesc& desc) {
    line("create heap '" + std::string(desc.label) + "' " + std::to_string(desc.size) + " B");
    return heaps_.insert({std::string(desc.label), desc.size});
}

Result<BufferHandle> NullDevice::create_buffer(const BufferDesc& desc) {
    if (desc.size == 0 || desc.size > limits_.max_buffer)
        return Error{"buffer '" + std::string(desc.label) + "': size " + std::to_string(desc.size) + " B",
                     desc.size ? ErrorKind::OutOfMemory : ErrorKind::Failed};
    Buffer b{std::string(desc.label), desc, std::vector<std::byte>(desc.size)};
    b.desc.label = {};
    b.desc.heap = {};
    line("create buffer '" + b.label + "' " + std::to_string(desc.size) + " B");
    const BufferHandle handle = buffers_.insert(std::move(b));
    peak_bytes_ = memory_stats().peak_used_bytes;
    return handle;
}

Result<TextureHandle> NullDevice::create_texture(const TextureDesc& desc) {
    Texture t{.label = std::string(desc.label), .desc = desc, .whole = {}, .subresources = {}};
    t.desc.label = {};
    t.desc.heap = {};
    t.subresources.resize(size_t{desc.mips} * layer_count(desc));
    line("create texture '" + t.label + "' " + std::string(name(desc.format)) + " " + std::to_string(desc.size.width) +
         "x" + std::to_string(desc.size.height) + "x" + std::to_string(desc.size.depth) + " mips " +
         std::to_string(desc.mips));
    const TextureHandle handle = textures_.insert(std::move(t));
    Texture& made = *textures_.get(handle);
    made.whole = views_.insert({made.label, {.texture = handle, .range = resolved(desc, {}), .as_array = true}, true});
    return handle;
}

void NullDevice::destroy(TextureHandle handle) {
    if (const Texture* t = textures_.get(handle)) views_.remove(t->whole);
    forget(textures_, handle, "texture");
}

Result<ViewHandle> NullDevice::create_view(const ViewDesc& desc) {
    const Texture* t = find(desc.texture);
    if (!t) return Error{"view '" + std::string(desc.label) + "': stale texture handle"};
    View v{std::string(desc.label), desc, false};
    v.desc.range = resolved(t->desc, desc.range);
    v.desc.label = {};
    return views_.insert(std::move(v));
}

Result<SamplerHandle> NullDevice::create_sampler(const SamplerDesc& desc) {
    return samplers_.insert({std::string(desc.label)});
}

Result<ShaderModule> NullDevice::create_shader_module(const ShaderModuleDesc& desc) {
    Result<Reflection> reflection = reflect_spirv(desc.spirv);
    if (!reflection)
        return Error{"shader module '" + std::string(desc.label) + "': " + reflection.error().message,
                     ErrorKind::Input};
    return shaders_.insert({std::string(desc.label), std::move(*reflection)});
}

Result<BindGroupLayout> NullDevice::create_bind_group_layout(const BindGroupLayoutDesc& desc) {
    return group_layouts_.insert({std::string(desc.label), false});
}

Result<BindGroup> NullDevice::create_bind_group(const BindGroupDesc& desc) {
    if (!found(group_layouts_.get(desc.layout), "bind group layout"))
        return Error{"bind group '" + std::string(desc.label) + "': stale layout"};
    return groups_.insert({std::string(desc.label)});
}

Result<PipelineLayout> NullDevice::create_pipeline_layout(const PipelineLayoutDesc& desc) {
    return layouts_.insert({std::string(desc.label), {desc.groups.begin(), desc.groups.end()}});
}

Result<Pipeline> NullDevice::make_pipeline(std::span<const ShaderModule> shaders, PipelineLayout layout,
                                           std::string_view label) {
    Pipeline p{.label = std::string(label), .reflection = {}, .groups = {}};
    std::vector<const Reflection*> reflections;
    for (const ShaderModule shader : shaders) {
        const Shader* s = found(shaders_.get(shader), "shader module");
        if (!s) return Error{"pipeline '" + p.label + "': stale shader module"};
        reflections.push_back(&s->reflection);
    }
    p.reflection = *reflections[0];
    if (layout) {
        const Layout* l = found(layouts_.get(layout), "pipeline layout");
        if (!l) return Error{"pipeline '" + p.label + "': stale layout"};
        p.groups = l->groups;
    } else {
        auto groups = auto_layouts_.groups(reflections, [&](const BindGroupLayoutDesc& d) -> Result<BindGroupLayout> {
            return group_layouts_.insert({std::string(d.label), true});
        });
        if (!groups) return Error{"pipeline '" + p.label + "': " + groups.error().message};
        p.groups = std::move(*groups);
    }
    ++pipelines_created_;
    line("create pipeline '" + p.label + "'");
    return p;
}

Result<ComputePipeline> NullDevice::create_compute_pipeline(const ComputePipelineDesc& desc) {
    auto p = make_pipeline(std::array{desc.shader}, desc.layout, desc.label);
    if (!p) return p.error();
    return compute_.insert(std::move(*p));
}

Result<RenderPipeline> NullDevice::create_render_pipeline(const RenderPipelineDesc& desc) {
    std::vector<ShaderModule> shaders;
    for (const ShaderModule shader : {desc.vertex, desc.mesh, desc.fragment})
        if (shader) shaders.push_back(shader);
    if (shaders.empty()) return Error{"pipeline '" + std::string(desc.label) + "': no shader"};
    auto p = make_pipeline(shaders, desc.layout, desc.label);
    if (!p) return p.error();
    return render_.insert(std::move(*p));
}

Result<TracePipeline> NullDevice::create_trace_pipeline(const TracePipelineDesc& desc) {
    auto p =
        make_pipeline(std::array{desc.raygen, desc.miss, desc.intersection, desc.closest_hit}, desc.layout, desc.label);
    if (!p) return p.error();
    return trace_pipelines_.insert(std::move(*p));
}

Result<QuerySet> NullDevice::create_query_set(const QuerySetDesc& desc) {
    return queries_.insert({std::string(desc.label), std::vector<uint64_t>(desc.count)});
}

MemoryNeed NullDevice::memory_need(const BufferDesc& desc) { return {(desc.size + 255) & ~255ull, 256}; }

MemoryNeed NullDevice::memory_need(const TextureDesc& desc) { return {(texture_bytes(desc) + 1023) & ~1023ull, 1024}; }

}  // namespace kiln::rhi::null
