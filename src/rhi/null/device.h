// SPDX-License-Identifier: MIT
// A device without a GPU. Buffers and textures hold real bytes; writes, copies, clears and maps work; dispatches and
// draws do nothing but stand in the trace. Work runs inside submit(), so every submit is completed at once.
#pragma once

#include "rhi/auto_layout.h"
#include "rhi/reporter.h"
#include "rhi/slot_map.h"
#include "rhi/texture_math.h"

namespace kiln::rhi::null {

struct Heap {
    std::string label;
    uint64_t size;
};

struct Buffer {
    std::string label;
    BufferDesc desc;
    std::vector<std::byte> bytes;
};

struct Texture {
    std::string label;
    TextureDesc desc;
    ViewHandle whole;
    std::vector<std::vector<std::byte>> subresources;  // mip + layer * mips, tightly packed; empty until first written
};

struct View {
    std::string label;
    ViewDesc desc;
    bool whole;
};

struct Shader {
    std::string label;
    Reflection reflection;
};

struct GroupLayout {
    std::string label;
    bool owned;
};

struct Pipeline {
    std::string label;
    Reflection reflection;
    std::vector<BindGroupLayout> groups;
};

struct Layout {
    std::string label;
    std::vector<BindGroupLayout> groups;
};

struct Queries {
    std::string label;
    std::vector<uint64_t> ticks;
};

struct Surface {
    std::string label;
    SurfaceSettings settings;
    TextureHandle acquired;
};

struct Named {
    std::string label;
};

class NullDevice final : public Device {
public:
    NullDevice();

    const DeviceInfo& info() const override { return info_; }
    const Caps& caps() const override { return caps_; }
    const Limits& limits() const override { return limits_; }

    Result<HeapHandle> create_heap(const HeapDesc& desc) override;
    Result<BufferHandle> create_buffer(const BufferDesc& desc) override;
    Result<TextureHandle> create_texture(const TextureDesc& desc) override;
    Result<ViewHandle> create_view(const ViewDesc& desc) override;
    Result<SamplerHandle> create_sampler(const SamplerDesc& desc) override;
    Result<ShaderModule> create_shader_module(const ShaderModuleDesc& desc) override;
    Result<BindGroupLayout> create_bind_group_layout(const BindGroupLayoutDesc& desc) override;
    Result<BindGroup> create_bind_group(const BindGroupDesc& desc) override;
    Result<PipelineLayout> create_pipeline_layout(const PipelineLayoutDesc& desc) override;
    Result<ComputePipeline> create_compute_pipeline(const ComputePipelineDesc& desc) override;
    Result<RenderPipeline> create_render_pipeline(const RenderPipelineDesc& desc) override;
    Result<TracePipeline> create_trace_pipeline(const TracePipelineDesc& desc) override;
    Result<QuerySet> create_query_set(const QuerySetDesc& desc) override;
    Result<SurfaceHandle> create_surface(const SurfaceDesc& desc) override;

    void destroy(HeapHandle handle) override { forget(heaps_, handle, "heap"); }
    void destroy(BufferHandle handle) override { forget(buffers_, handle, "buffer"); }
    void destroy(TextureHandle handle) override;
    void destroy(ViewHandle handle) override { forget(views_, handle, "view"); }
    void destroy(SamplerHandle handle) override { forget(samplers_, handle, "sampler"); }
    void destroy(ShaderModule handle) override { forget(shaders_, handle, "shader module"); }
    void destroy(BindGroupLayout handle) override { forget(group_layouts_, handle, "bind group layout"); }
    void destroy(BindGroup handle) override { forget(groups_, handle, "bind group"); }
    void destroy(PipelineLayout handle) override { forget(layouts_, handle, "pipeline layout"); }
    void destroy(ComputePipeline handle) override { forget(compute_, handle, "compute pipeline"); }
    void destroy(RenderPipeline handle) override { forget(render_, handle, "render pipeline"); }
    void destroy(TracePipeline handle) override { forget(trace_pipelines_, handle, "trace pipeline"); }
    void destroy(QuerySet handle) override { forget(queries_, handle, "query set"); }
    void destroy(SurfaceHandle handle) override;

    ViewHandle whole_view(TextureHandle texture) override;
    MemoryNeed memory_need(const BufferDesc& desc) override;
    MemoryNeed memory_need(const TextureDesc& desc) override;
    uint64_t box_tree_bytes(uint32_t boxes) override { return 256 + 64ull * boxes; }
    const Reflection* reflection(ShaderModule shader) override;
    const Reflection* reflection(ComputePipeline pipeline) override;
    BindGroupLayout group_layout(ComputePipeline pipeline, uint32_t index) override;
    BindGroupLayout group_layout(RenderPipeline pipeline, uint32_t index) override;
    BindGroupLayout group_layout(TracePipeline pipeline, uint32_t index) override;
    BufferDesc desc(BufferHandle buffer) override;
    TextureDesc desc(TextureHandle texture) override;
    ViewDesc desc(ViewHandle view) override;

    Result<void> write_buffer(BufferHandle buffer, uint64_t offset, std::span<const std::byte> bytes) override;
    Result<void> write_texture(const TextureWrite& write, std::span<const std::byte> bytes) override;
    std::unique_ptr<CommandEncoder> create_encoder(std::string_view label) override;
    Result<SubmitId> submit(std::unique_ptr<CommandEncoder> encoder) override;
    bool completed(SubmitId id) override { return id <= submits_; }
    Result<void> wait(SubmitId id) override;
    Result<void> wait_idle() override { return {}; }
    SubmitId last_submit() const override { return submits_; }
    Result<std::span<std::byte>> map(BufferHandle buffer) override;
    void unmap(BufferHandle buffer) override;
    Result<SurfaceState> configure(SurfaceHandle surface, const SurfaceSettings& settings) override;
    Result<SurfaceImage> acquire(SurfaceHandle surface) override;
    Result<SurfaceState> present(SurfaceHandle surface) override;

    MemoryStats memory_stats() const override;
    uint32_t live_handle_count() const override;
    std::string live_handles() const override;
    uint64_t pipelines_created() const override { return pipelines_created_; }
    bool lost() const override { return false; }
    void set_error_sink(ErrorSink sink) override { report_.set(std::move(sink)); }
    std::string trace() const override { return trace_; }

    // For the encoder.
    Buffer* find(BufferHandle h) { return found(buffers_.get(h), "buffer"); }
    Texture* find(TextureHandle h) { return found(textures_.get(h), "texture"); }
    View* find(ViewHandle h) { return found(views_.get(h), "view"); }
    Pipeline* find(ComputePipeline h) { return found(compute_.get(h), "compute pipeline"); }
    Pipeline* find(RenderPipeline h) { return found(render_.get(h), "render pipeline"); }
    Pipeline* find(TracePipeline h) { return found(trace_pipelines_.get(h), "trace pipeline"); }
    Named* find(BindGroup h) { return found(groups_.get(h), "bind group"); }
    Queries* find(QuerySet h) { return found(queries_.get(h), "query set"); }
    void report(std::string_view sentence) { report_(sentence); }
    uint64_t tick() { return ticks_ += 1000; }
    static std::vector<std::byte>& bytes_of(Texture& texture, uint32_t mip, uint32_t layer);

private:
    template <typename T>
    T* found(T* object, std::string_view kind) {
        if (!object) report_("stale " + std::string(kind) + " handle");
        return object;
    }
    template <typename H, typename T>
    void forget(SlotMap<H, T>& map, H handle, std::string_view kind) {
        const auto gone = map.remove(handle);
        if (!gone) return report_("destroy: stale " + std::string(kind) + " handle");
        line("destroy " + std::string(kind) + " '" + gone->label + "'");
    }
    void line(const std::string& text) { trace_ += text + '\n'; }
    Result<Pipeline> make_pipeline(std::span<const ShaderModule> shaders, PipelineLayout layout,
                                   std::string_view label);

    DeviceInfo info_;
    Caps caps_;
    Limits limits_;
    Reporter report_;
    SlotMap<HeapHandle, Heap> heaps_;
    SlotMap<BufferHandle, Buffer> buffers_;
    SlotMap<TextureHandle, Texture> textures_;
    SlotMap<ViewHandle, View> views_;
    SlotMap<SamplerHandle, Named> samplers_;
    SlotMap<ShaderModule, Shader> shaders_;
    SlotMap<BindGroupLayout, GroupLayout> group_layouts_;
    SlotMap<BindGroup, Named> groups_;
    SlotMap<PipelineLayout, Layout> layouts_;
    SlotMap<ComputePipeline, Pipeline> compute_;
    SlotMap<RenderPipeline, Pipeline> render_;
    SlotMap<TracePipeline, Pipeline> trace_pipelines_;
    SlotMap<QuerySet, Queries> queries_;
    SlotMap<SurfaceHandle, Surface> surfaces_;
    AutoLayouts auto_layouts_;
    std::string trace_;
    SubmitId submits_ = 0;
    uint64_t ticks_ = 0;
    uint64_t pipelines_created_ = 0;
    uint64_t peak_bytes_ = 0;
};

}  // namespace kiln::rhi::null
