// SPDX-License-Identifier: MIT
// A device in front of another that checks every call against the rules: WebGPU's (usage flags, bounds, layouts, scopes,
// the floor's limits) and ours (barriers). What breaks a rule is reported in one sentence and never reaches the device
// below.
#pragma once

#include "rhi/reporter.h"
#include "rhi/validate/tracker.h"

namespace kiln::rhi::validate {

class ValidateDevice final : public Device {
public:
    explicit ValidateDevice(std::unique_ptr<Device> below);

    const DeviceInfo& info() const override { return below_->info(); }
    const Caps& caps() const override { return below_->caps(); }
    const Limits& limits() const override { return below_->limits(); }

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

    void destroy(HeapHandle handle) override;
    void destroy(BufferHandle handle) override;
    void destroy(TextureHandle handle) override;
    void destroy(ViewHandle handle) override;
    void destroy(SamplerHandle handle) override { forget(objects_.samplers, handle); }
    void destroy(ShaderModule handle) override { forget(objects_.shaders, handle); }
    void destroy(BindGroupLayout handle) override;
    void destroy(BindGroup handle) override { forget(objects_.groups, handle); }
    void destroy(PipelineLayout handle) override { forget(objects_.layouts, handle); }
    void destroy(ComputePipeline handle) override { forget(objects_.compute, handle); }
    void destroy(RenderPipeline handle) override { forget(objects_.render, handle); }
    void destroy(TracePipeline handle) override { forget(objects_.traces, handle); }
    void destroy(QuerySet handle) override { forget(objects_.queries, handle); }
    void destroy(SurfaceHandle handle) override;

    ViewHandle whole_view(TextureHandle texture) override;
    MemoryNeed memory_need(const BufferDesc& desc) override { return below_->memory_need(desc); }
    MemoryNeed memory_need(const TextureDesc& desc) override { return below_->memory_need(desc); }
    uint64_t box_tree_bytes(uint32_t boxes) override;
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
    bool completed(SubmitId id) override { return below_->completed(id); }
    Result<void> wait(SubmitId id) override;
    Result<void> wait_idle() override { return below_->wait_idle(); }
    SubmitId last_submit() const override { return below_->last_submit(); }
    Result<std::span<std::byte>> map(BufferHandle buffer) override;
    void unmap(BufferHandle buffer) override;
    Result<SurfaceState> configure(SurfaceHandle surface, const SurfaceSettings& settings) override;
    Result<SurfaceImage> acquire(SurfaceHandle surface) override;
    Result<SurfaceState> present(SurfaceHandle surface) override;

    MemoryStats memory_stats() const override { return below_->memory_stats(); }
    uint32_t live_handle_count() const override { return below_->live_handle_count(); }
    std::string live_handles() const override { return below_->live_handles(); }
    uint64_t pipelines_created() const override { return below_->pipelines_created(); }
    bool lost() const override { return below_->lost(); }
    void set_error_sink(ErrorSink sink) override { report_.set(std::move(sink)); }
    std::string trace() const override { return below_->trace(); }

    // For the encoder.
    Objects& objects() { return objects_; }
    void report(std::string_view sentence) { report_(sentence); }

private:
    // Reports and makes the error of it.
    Error refuse(std::string sentence);
    template <typename H, typename T>
    void forget(Table<H, T>& table, H handle) {
        if (!table.find(handle)) return report_("destroy: " + table.why_not(handle));
        table.erase(handle);
        below_->destroy(handle);
    }
    // A sentence about the heap placement, or nothing.
    std::string check_placement(HeapHandle heap, uint64_t offset, const MemoryNeed& need);
    std::string check_entry(const BindGroupLayoutEntry& slot, const BindGroupEntry& entry, BoundResource& out);
    std::string add_stage(std::vector<const Reflection*>& out, ShaderModule handle, ShaderStage stage);
    std::string fill_pipeline(PipelineInfo& out, std::span<const Reflection* const> shaders, PipelineLayout layout);
    BindGroupLayout remember_group_layout(BindGroupLayout handle, const PipelineInfo& pipeline, uint32_t index);

    Reporter report_;  // ahead of below_, which may still speak while it is destroyed
    Objects objects_;
    Tracker tracker_{objects_};
    std::unique_ptr<Device> below_;
    std::vector<BufferHandle> written_buffers_;  // since the last submit
    std::vector<TextureWrite> written_textures_;
    // A surface's texture is no more.
    void expire(TextureHandle texture);
};

}  // namespace kiln::rhi::validate
