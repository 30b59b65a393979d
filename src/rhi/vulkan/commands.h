// SPDX-License-Identifier: MIT
// Records into one command buffer. Bind groups and push data are kept and applied at the next dispatch or draw, so their
// order relative to set_pipeline doesn't matter.
#pragma once

#include "rhi/vulkan/device.h"

namespace kiln::rhi::vulkan {

// The texture side of a copy. Offsets into the buffer are the caller's.
VkBufferImageCopy2 image_region(const TextureDesc& desc, const TexturePlace& place, Extent size);

class VulkanEncoder final : public CommandEncoder, private ComputePass, private RenderPass {
public:
    VulkanEncoder(VulkanDevice& device, CommandSlot slot, std::string_view label);
    ~VulkanEncoder() override;

    ComputePass& begin_compute(std::string_view label) override;
    RenderPass& begin_render(const RenderPassDesc& desc) override;
    void copy_buffer(BufferHandle src, uint64_t src_offset, BufferHandle dst, uint64_t dst_offset,
                     uint64_t size) override;
    void copy_buffer_to_texture(const BufferLayout& src, const TexturePlace& dst, Extent size) override;
    void copy_texture_to_buffer(const TexturePlace& src, const BufferLayout& dst, Extent size) override;
    void copy_texture(const TexturePlace& src, const TexturePlace& dst, Extent size) override;
    void clear_buffer(BufferHandle buffer, uint64_t offset, uint64_t size, uint32_t word) override;
    void clear_texture(TextureHandle texture, std::array<float, 4> value, Subresources range) override;
    void build_box_tree(BufferHandle tree, BufferHandle boxes, uint64_t offset, uint32_t count) override;
    void barrier(BarrierKey, std::span<const Barrier> barriers) override;
    void write_timestamp(QuerySet set, uint32_t index) override;
    void resolve_queries(QuerySet set, uint32_t first, uint32_t count, BufferHandle dst, uint64_t offset) override;
    void push_label(std::string_view label) override;
    void pop_label() override;

    // For the device.
    void fail(const Error& error);
    Result<CommandSlot> finish();  // ends recording; the first error, if there was one
    void release() {
        slot_ = {};
        submitted_ = true;
    }

private:
    // ComputePass and RenderPass
    void set_pipeline(ComputePipeline pipeline) override;
    void set_pipeline(RenderPipeline pipeline) override;
    void set_pipeline(TracePipeline pipeline) override;
    void set_bind_group(uint32_t index, BindGroup group, std::span<const uint32_t> dynamic_offsets) override;
    void set_push(std::span<const std::byte> bytes) override;
    void dispatch(uint32_t x, uint32_t y, uint32_t z) override;
    void dispatch_indirect(BufferHandle buffer, uint64_t offset) override;
    void trace(uint32_t width, uint32_t height) override;
    void set_vertex_buffer(uint32_t slot, BufferHandle buffer, uint64_t offset) override;
    void set_index_buffer(BufferHandle buffer, bool is_32_bit, uint64_t offset) override;
    void set_viewport(float x, float y, float width, float height, float depth_min, float depth_max) override;
    void set_scissor(uint32_t x, uint32_t y, uint32_t width, uint32_t height) override;
    void set_blend_constant(std::array<float, 4> rgba) override;
    void draw(uint32_t vertices, uint32_t instances, uint32_t first_vertex, uint32_t first_instance) override;
    void draw_indexed(uint32_t indices, uint32_t instances, uint32_t first_index, int32_t base_vertex,
                      uint32_t first_instance) override;
    void draw_indirect(BufferHandle buffer, uint64_t offset, uint32_t draws, uint32_t stride) override;
    void draw_indexed_indirect(BufferHandle buffer, uint64_t offset, uint32_t draws, uint32_t stride) override;
    void draw_mesh_groups(uint32_t x, uint32_t y, uint32_t z) override;
    void end() override;

    struct BoundGroup {
        VkDescriptorSet set = VK_NULL_HANDLE;
        uint32_t offset_count = 0;
        std::array<uint32_t, 8> offsets{};
        bool dirty = false;
    };

    void set_pipeline(const Pipeline* pipeline);
    void switch_to(VkPipelineBindPoint point, const Pipeline* pipeline);
    bool apply();  // groups and push data; false when there is nothing to run
    template <typename T>
    bool have(const T* object);

    VulkanDevice& device_;
    const VolkDeviceTable& vk_;
    CommandSlot slot_;
    VkCommandBuffer cmd_;
    bool submitted_ = false;
    bool in_render_ = false;
    std::optional<Error> error_;

    VkPipelineBindPoint bind_point_ = VK_PIPELINE_BIND_POINT_COMPUTE;
    VkPipelineLayout layout_ = VK_NULL_HANDLE;
    std::array<VkStridedDeviceAddressRegionKHR, 3> table_{};  // of the trace pipeline
    uint32_t group_count_ = 0;
    uint32_t push_needed_ = 0;
    std::array<BoundGroup, kMaxBindGroups> groups_;
    std::array<std::byte, kMaxPushBytes> push_{};
    uint32_t push_bytes_ = 0;
    bool push_dirty_ = false;

    std::vector<VkImageMemoryBarrier2> image_barriers_;
    std::vector<VkBufferMemoryBarrier2> buffer_barriers_;
};

}  // namespace kiln::rhi::vulkan
