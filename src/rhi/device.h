// SPDX-License-Identifier: MIT
// A graphics device: makes objects, takes recorded work, gives bytes back. See create.h for how to get one.
// Owner's thread unless said otherwise. Whatever fails in the driver comes back as a Result; what the caller did wrong
// goes to the error sink as one sentence (through the validate decorator) and comes back as a Result where there is one.
#pragma once

#include <kiln/result.h>
#include "rhi/commands.h"
#include "rhi/spirv_reflect.h"
#include "rhi/types.h"

#include <functional>
#include <memory>

namespace kiln::rhi {

// A texture upload. The device makes the transitions itself, for the whole subresource (mip, and layer of a D2Array).
struct TextureWrite {
    TexturePlace place = {};
    Extent size = {};
    uint32_t bytes_per_row = 0;  // of `bytes`; 0: tight
    uint32_t rows_per_layer = 0;
    Access before = Access::Undefined;  // state of the subresource now; Undefined discards what lies outside the region
    Access after = Access::SampledReadCompute;
};

using ErrorSink = std::function<void(std::string_view sentence)>;

class Device {
public:
    virtual ~Device() = default;

    virtual const DeviceInfo& info() const = 0;
    virtual const Caps& caps() const = 0;
    virtual const Limits& limits() const = 0;

    // ---- objects. destroy() may be called at once after the last submit that uses the object: the device keeps it
    // until the GPU is done. A stale handle is reported, never followed.
    virtual Result<HeapHandle> create_heap(const HeapDesc& desc) = 0;
    virtual Result<BufferHandle> create_buffer(const BufferDesc& desc) = 0;
    virtual Result<TextureHandle> create_texture(const TextureDesc& desc) = 0;
    virtual Result<ViewHandle> create_view(const ViewDesc& desc) = 0;
    virtual Result<SamplerHandle> create_sampler(const SamplerDesc& desc) = 0;
    virtual Result<ShaderModule> create_shader_module(const ShaderModuleDesc& desc) = 0;
    virtual Result<BindGroupLayout> create_bind_group_layout(const BindGroupLayoutDesc& desc) = 0;
    virtual Result<BindGroup> create_bind_group(const BindGroupDesc& desc) = 0;
    virtual Result<PipelineLayout> create_pipeline_layout(const PipelineLayoutDesc& desc) = 0;
    virtual Result<ComputePipeline> create_compute_pipeline(const ComputePipelineDesc& desc) = 0;
    virtual Result<RenderPipeline> create_render_pipeline(const RenderPipelineDesc& desc) = 0;
    virtual Result<TracePipeline> create_trace_pipeline(const TracePipelineDesc& desc) = 0;
    virtual Result<QuerySet> create_query_set(const QuerySetDesc& desc) = 0;
    virtual Result<SurfaceHandle> create_surface(const SurfaceDesc& desc) = 0;

    virtual void destroy(HeapHandle handle) = 0;
    virtual void destroy(BufferHandle handle) = 0;
    virtual void destroy(TextureHandle handle) = 0;
    virtual void destroy(ViewHandle handle) = 0;
    virtual void destroy(SamplerHandle handle) = 0;
    virtual void destroy(ShaderModule handle) = 0;  // pipelines made from it live on
    virtual void destroy(BindGroupLayout handle) = 0;
    virtual void destroy(BindGroup handle) = 0;
    virtual void destroy(PipelineLayout handle) = 0;
    virtual void destroy(ComputePipeline handle) = 0;
    virtual void destroy(RenderPipeline handle) = 0;
    virtual void destroy(TracePipeline handle) = 0;
    virtual void destroy(QuerySet handle) = 0;
    virtual void destroy(SurfaceHandle handle) = 0;  // waits for the GPU

    // ---- what an object is
    // The view of the whole texture that every texture comes with; it goes with the texture.
    virtual ViewHandle whole_view(TextureHandle texture) = 0;
    // Room a resource needs in a heap. `desc.heap` is ignored.
    virtual MemoryNeed memory_need(const BufferDesc& desc) = 0;
    virtual MemoryNeed memory_need(const TextureDesc& desc) = 0;
    // Of a buffer of usage BoxTree that is to hold `boxes` of them.
    virtual uint64_t box_tree_bytes(uint32_t boxes) = 0;
    // Null for a stale handle. Lives as long as the module or pipeline.
    virtual const Reflection* reflection(ShaderModule shader) = 0;
    virtual const Reflection* reflection(ComputePipeline pipeline) = 0;
    // The layout of one bind group of a pipeline, also when the pipeline made its layout itself. Pipelines whose
    // reflected entries are equal share it. The pipeline owns it: don't destroy it.
    virtual BindGroupLayout group_layout(ComputePipeline pipeline, uint32_t index) = 0;
    virtual BindGroupLayout group_layout(RenderPipeline pipeline, uint32_t index) = 0;
    virtual BindGroupLayout group_layout(TracePipeline pipeline, uint32_t index) = 0;
    // The sizes and usages it was made with (label and heap excepted). A default-constructed one for a stale handle.
    virtual BufferDesc desc(BufferHandle buffer) = 0;
    virtual TextureDesc desc(TextureHandle texture) = 0;
    virtual ViewDesc desc(ViewHandle view) = 0;  // counts resolved, never kRemaining

    // ---- queue
    // Copied at once; takes effect ahead of the next submit's commands, after all earlier submits.
    virtual Result<void> write_buffer(BufferHandle buffer, uint64_t offset, std::span<const std::byte> bytes) = 0;
    virtual Result<void> write_texture(const TextureWrite& write, std::span<const std::byte> bytes) = 0;
    virtual std::unique_ptr<CommandEncoder> create_encoder(std::string_view label) = 0;
    virtual Result<SubmitId> submit(std::unique_ptr<CommandEncoder> encoder) = 0;
    virtual bool completed(SubmitId id) = 0;
    virtual Result<void> wait(SubmitId id) = 0;
    virtual Result<void> wait_idle() = 0;
    virtual SubmitId last_submit() const = 0;

    // Bytes of an Upload or Readback buffer; valid until unmap. Readback: wait for the copying submit first.
    virtual Result<std::span<std::byte>> map(BufferHandle buffer) = 0;
    virtual void unmap(BufferHandle buffer) = 0;

    // ---- windows. configure() a surface once its window has a size. Then for each picture: acquire(), write_texture() with
    // `after` = Access::Present, submit(), present().
    virtual Result<SurfaceState> configure(SurfaceHandle surface, const SurfaceSettings& settings) = 0;
    // Waits for a free texture a tenth of a second at most.
    virtual Result<SurfaceImage> acquire(SurfaceHandle surface) = 0;
    virtual Result<SurfaceState> present(SurfaceHandle surface) = 0;

    // ---- health
    virtual MemoryStats memory_stats() const = 0;
    // Objects made and not destroyed. Layouts owned by pipelines and whole views don't count.
    virtual uint32_t live_handle_count() const = 0;
    virtual std::string live_handles() const = 0;  // one a line: "buffer 'bricks'"
    virtual uint64_t pipelines_created() const = 0;
    virtual bool lost() const = 0;
    // Default: the log. Called from any thread that uses the device, never concurrently.
    virtual void set_error_sink(ErrorSink sink) = 0;
    // Of the null backend and its decorator: everything done so far, one command a line. Empty elsewhere.
    virtual std::string trace() const { return {}; }
};

}  // namespace kiln::rhi
