// SPDX-License-Identifier: MIT
// The Vulkan 1.3 device: one queue, one timeline semaphore whose value is the SubmitId of what has finished.
#pragma once

#include "rhi/auto_layout.h"
#include "rhi/slot_map.h"
#include "rhi/texture_math.h"
#include "rhi/vulkan/instance.h"
#include "rhi/vulkan/memory.h"
#include "rhi/vulkan/upload.h"

#include <deque>

namespace kiln::rhi::vulkan {

struct Heap {
    std::string label;
    Allocation memory;
    uint32_t type_bits;
};

struct Buffer {
    std::string label;
    BufferDesc desc;
    VkBuffer vk;
    Allocation memory;  // empty when it lives in a heap
    // Of usage BoxTree: what descriptors name, and the boxes behind it.
    VkAccelerationStructureKHR top = VK_NULL_HANDLE, bottom = VK_NULL_HANDLE;
};

struct Texture {
    std::string label;
    TextureDesc desc;
    VkImage vk;
    Allocation memory;
    ViewHandle whole;
    bool shown = false;  // a surface's own
};

struct View {
    std::string label;
    ViewDesc desc;
    TextureDesc texture;
    VkImageView vk;
    bool whole;
};

struct Sampler {
    std::string label;
    VkSampler vk;
};

struct Shader {
    std::string label;
    VkShaderModule vk;
    Reflection reflection;
};

struct GroupLayout {
    std::string label;
    std::vector<BindGroupLayoutEntry> entries;
    VkDescriptorSetLayout vk;
    bool owned;
};

struct Group {
    std::string label;
    VkDescriptorSet vk;
    VkDescriptorPool pool;
};

struct Layout {
    std::string label;
    std::vector<BindGroupLayout> groups;
    VkPipelineLayout vk;
};

struct Pipeline {
    std::string label;
    Reflection reflection;  // of the compute or vertex shader
    std::vector<BindGroupLayout> groups;
    VkPipeline vk;
    VkPipelineLayout layout;
    bool owns_layout;
    // Of a trace pipeline: a record a shader group.
    VkBuffer table = VK_NULL_HANDLE;
    Allocation table_memory = {};
    std::array<VkStridedDeviceAddressRegionKHR, 3> groups_in_table = {};  // ray generation, miss, hit
};

struct Queries {
    std::string label;
    VkQueryPool vk;
    uint32_t count;
};

struct Surface {
    std::string label;
    VkSurfaceKHR vk = VK_NULL_HANDLE;
    VkSwapchainKHR swapchain = VK_NULL_HANDLE;
    std::vector<VkImage> images;
    // Of each image: what was drawn is done, so it may be shown. Free again when the image is acquired again.
    std::vector<VkSemaphore> drawn;
    // An image is there to be drawn into; taken in turns, each free when the submit that waited for it is done.
    struct Arrival {
        VkSemaphore semaphore;
        SubmitId waited_for_by;
    };
    std::vector<Arrival> arrivals;
    size_t next_arrival = 0;
    Format format = Format::Undefined;
    uint32_t width = 0, height = 0;
    uint32_t image = 0;  // that is acquired, and its texture
    TextureHandle acquired = {};
};

// A command buffer with a pool of its own; recycled when the work is done.
struct CommandSlot {
    VkCommandPool pool = VK_NULL_HANDLE;
    VkCommandBuffer buffer = VK_NULL_HANDLE;
};

class VulkanDevice final : public Device {
public:
    static Result<std::unique_ptr<Device>> create(std::unique_ptr<Instance> instance, const Adapter& adapter,
                                                  bool use_pipeline_cache);
    ~VulkanDevice() override;

    const DeviceInfo& info() const override { return adapter_.info; }
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

    void destroy(HeapHandle handle) override;
    void destroy(BufferHandle handle) override;
    void destroy(TextureHandle handle) override;
    void destroy(ViewHandle handle) override;
    void destroy(SamplerHandle handle) override;
    void destroy(ShaderModule handle) override;
    void destroy(BindGroupLayout handle) override;
    void destroy(BindGroup handle) override;
    void destroy(PipelineLayout handle) override;
    void destroy(ComputePipeline handle) override;
    void destroy(RenderPipeline handle) override;
    void destroy(TracePipeline handle) override;
    void destroy(QuerySet handle) override;
    void destroy(SurfaceHandle handle) override;

    ViewHandle whole_view(TextureHandle texture) override;
    MemoryNeed memory_need(const BufferDesc& desc) override;
    MemoryNeed memory_need(const TextureDesc& desc) override;
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
    bool completed(SubmitId id) override;
    Result<void> wait(SubmitId id) override;
    Result<void> wait_idle() override { return wait(last_submit_); }
    SubmitId last_submit() const override { return last_submit_; }
    Result<std::span<std::byte>> map(BufferHandle buffer) override;
    void unmap(BufferHandle) override {}
    Result<SurfaceState> configure(SurfaceHandle surface, const SurfaceSettings& settings) override;
    Result<SurfaceImage> acquire(SurfaceHandle surface) override;
    Result<SurfaceState> present(SurfaceHandle surface) override;

    MemoryStats memory_stats() const override;
    uint32_t live_handle_count() const override;
    std::string live_handles() const override;
    uint64_t pipelines_created() const override { return pipelines_created_; }
    bool lost() const override { return lost_; }
    void set_error_sink(ErrorSink sink) override { report_.set(std::move(sink)); }

    // For the encoder.
    const VolkDeviceTable& vk() const { return vk_; }
    const Instance& instance() const { return *instance_; }
    const ShaderStages& stages() const { return stages_; }
    Result<void> record_box_tree(VkCommandBuffer cmd, Buffer& tree, const Buffer& boxes, uint64_t offset,
                                 uint32_t count);
    bool draws() const { return adapter_.graphics; }
    Buffer* find(BufferHandle h) { return found(buffers_.get(h), "buffer"); }
    Texture* find(TextureHandle h) { return found(textures_.get(h), "texture"); }
    View* find(ViewHandle h) { return found(views_.get(h), "view"); }
    Pipeline* find(ComputePipeline h) { return found(compute_.get(h), "compute pipeline"); }
    Pipeline* find(RenderPipeline h) { return found(render_.get(h), "render pipeline"); }
    Pipeline* find(TracePipeline h) { return found(traces_.get(h), "trace pipeline"); }
    Group* find(BindGroup h) { return found(groups_.get(h), "bind group"); }
    Queries* find(QuerySet h) { return found(queries_.get(h), "query set"); }
    void report(std::string_view sentence) { report_(sentence); }
    void give_back(CommandSlot slot);  // of an encoder that was never submitted

private:
    // Driver objects whose handles are gone but which a running submit may still use.
    struct Garbage {
        SubmitId after;
        VkObjectType type;
        uint64_t object;
        VkDescriptorPool pool = VK_NULL_HANDLE;
        Allocation memory = {};
    };
    struct Running {
        SubmitId id;
        CommandSlot slot;
    };

    VulkanDevice(std::unique_ptr<Instance> instance, Adapter adapter);
    Result<void> init(bool use_pipeline_cache);
    void find_caps();

    template <typename T>
    T* found(T* object, std::string_view kind) {
        if (!object) report_("stale " + std::string(kind) + " handle");
        return object;
    }
    template <typename H, typename T>
    std::optional<T> take(SlotMap<H, T>& map, H handle, std::string_view kind) {
        std::optional<T> out = map.remove(handle);
        if (!out) report_("destroy: stale " + std::string(kind) + " handle");
        return out;
    }
    template <typename T>
    void retire(VkObjectType type, T object, const Allocation& memory = {}, VkDescriptorPool pool = VK_NULL_HANDLE) {
        const bool may_still_be_submitted = open_encoders_ > 0 || !uploads_.empty();
        garbage_.push_back({last_submit_ + (may_still_be_submitted ? 1 : 0), type, uint64_t(object), pool, memory});
    }
    template <typename T>
    void label(VkObjectType type, T object, std::string_view text) {
        set_label(type, uint64_t(object), text);
    }
    void set_label(VkObjectType type, uint64_t object, std::string_view text);
    void destroy_now(const Garbage& garbage);
    void collect();
    Error fail(std::string_view what, VkResult result);
    SubmitId finished();

    Result<CommandSlot> take_slot();
    Result<VkDescriptorSet> allocate_set(VkDescriptorSetLayout layout, VkDescriptorPool& pool);
    Result<VkBuffer> make_buffer(const BufferDesc& desc);
    struct TreeBytes {
        uint64_t tree = 0, scratch = 0;
    };
    TreeBytes tree_bytes(uint32_t boxes) const;  // 0 boxes: of the tree of one tree
    VkDeviceAddress address(VkBuffer buffer) const;
    Result<VkAccelerationStructureKHR> make_tree(VkBuffer buffer, uint64_t offset, uint64_t bytes, bool top);
    Result<void> fill_table(Pipeline& pipeline);
    VkImageCreateInfo image_info(const TextureDesc& desc) const;
    Result<VkImageView> make_view(const Texture& texture, const ViewDesc& desc);
    Result<BindGroupLayout> make_group_layout(const BindGroupLayoutDesc& desc, bool owned);
    Result<VkPipelineLayout> make_layout(std::span<const BindGroupLayout> groups, uint32_t push_bytes);
    // Fills groups, layout and owns_layout of `out`.
    Result<void> choose_layout(Pipeline& out, PipelineLayout wanted, std::span<const Reflection* const> shaders);

    Result<VkSemaphore> make_semaphore();
    void drop_swapchain(Surface& surface);  // waits for the GPU

    std::unique_ptr<Instance> instance_;
    Adapter adapter_;
    Caps caps_;
    Limits limits_;
    Reporter report_;
    VkDevice device_ = VK_NULL_HANDLE;
    VolkDeviceTable vk_{};
    VkQueue queue_ = VK_NULL_HANDLE;
    VkSemaphore timeline_ = VK_NULL_HANDLE;
    VkPipelineCache pipeline_cache_ = VK_NULL_HANDLE;
    std::string pipeline_cache_path_;  // empty: not kept
    SubmitId last_submit_ = 0;
    SubmitId finished_ = 0;  // last seen
    bool lost_ = false;
    uint64_t pipelines_created_ = 0;
    ShaderStages stages_;
    TreeBytes top_bytes_;             // of the one entry that leads to a tree of boxes
    uint64_t scratch_alignment_ = 1;  // of box trees
    VkPhysicalDeviceRayTracingPipelinePropertiesKHR trace_limits_{};

    Memory memory_;
    Uploads uploads_;
    std::deque<Garbage> garbage_;
    std::deque<Running> running_;
    std::vector<CommandSlot> idle_slots_;
    uint32_t open_encoders_ = 0;
    std::vector<VkDescriptorPool> set_pools_;
    AutoLayouts auto_layouts_;

    SlotMap<HeapHandle, Heap> heaps_;
    SlotMap<BufferHandle, Buffer> buffers_;
    SlotMap<TextureHandle, Texture> textures_;
    SlotMap<ViewHandle, View> views_;
    SlotMap<SamplerHandle, Sampler> samplers_;
    SlotMap<ShaderModule, Shader> shaders_;
    SlotMap<BindGroupLayout, GroupLayout> group_layouts_;
    SlotMap<BindGroup, Group> groups_;
    SlotMap<PipelineLayout, Layout> layouts_;
    SlotMap<ComputePipeline, Pipeline> compute_;
    SlotMap<RenderPipeline, Pipeline> render_;
    SlotMap<TracePipeline, Pipeline> traces_;
    SlotMap<QuerySet, Queries> queries_;
    SlotMap<SurfaceHandle, Surface> surfaces_;
    std::vector<VkSemaphore> arrivals_;  // that the next submit waits for
};

}  // namespace kiln::rhi::vulkan
