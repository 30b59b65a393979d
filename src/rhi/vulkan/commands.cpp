// SPDX-License-Identifier: MIT
#include "rhi/vulkan/commands.h"

#include <cmath>
#include <cstring>

namespace kiln::rhi::vulkan {

VkBufferImageCopy2 image_region(const TextureDesc& desc, const TexturePlace& place, Extent size) {
    const bool volume = desc.dimension == Dimension::D3;
    VkBufferImageCopy2 out{.sType = VK_STRUCTURE_TYPE_BUFFER_IMAGE_COPY_2};
    out.imageSubresource = {aspect(desc.format), place.mip, volume ? 0 : place.origin.z, volume ? 1 : size.depth};
    out.imageOffset = {int32_t(place.origin.x), int32_t(place.origin.y), volume ? int32_t(place.origin.z) : 0};
    out.imageExtent = {size.width, size.height, volume ? size.depth : 1};
    return out;
}

VulkanEncoder::VulkanEncoder(VulkanDevice& device, CommandSlot slot, std::string_view label)
    : device_(device), vk_(device.vk()), slot_(slot), cmd_(slot.buffer) {
    push_label(label);
}

VulkanEncoder::~VulkanEncoder() {
    if (!submitted_) device_.give_back(slot_);
}

void VulkanEncoder::fail(const Error& error) {
    if (!error_) error_ = error;
}

template <typename T>
bool VulkanEncoder::have(const T* object) {
    if (!object) fail({"recording: stale handle"});
    return object != nullptr && cmd_;
}

Result<CommandSlot> VulkanEncoder::finish() {
    if (!cmd_ && !error_) error_ = Error{"encoder without a command buffer"};
    if (error_) return *error_;
    pop_label();
    if (const VkResult r = vk_.vkEndCommandBuffer(cmd_); r != VK_SUCCESS) return failure("recording", r);
    return slot_;
}

void VulkanEncoder::push_label(std::string_view label) {
    if (!device_.instance().debug() || !cmd_) return;
    const std::string terminated(label);
    const VkDebugUtilsLabelEXT info{.sType = VK_STRUCTURE_TYPE_DEBUG_UTILS_LABEL_EXT, .pLabelName = terminated.c_str()};
    device_.instance().begin_label(cmd_, &info);
}

void VulkanEncoder::pop_label() {
    if (device_.instance().debug() && cmd_) device_.instance().end_label(cmd_);
}

// ---- passes

ComputePass& VulkanEncoder::begin_compute(std::string_view label) {
    push_label(label);
    bind_point_ = VK_PIPELINE_BIND_POINT_COMPUTE;
    set_pipeline(static_cast<const Pipeline*>(nullptr));
    return *this;
}

RenderPass& VulkanEncoder::begin_render(const RenderPassDesc& desc) {
    push_label(desc.label);
    bind_point_ = VK_PIPELINE_BIND_POINT_GRAPHICS;
    set_pipeline(static_cast<const Pipeline*>(nullptr));
    if (!device_.draws()) fail({"render pass: the device's queue doesn't draw"});

    const auto load = [](Load l) {
        return l == Load::Load    ? VK_ATTACHMENT_LOAD_OP_LOAD
               : l == Load::Clear ? VK_ATTACHMENT_LOAD_OP_CLEAR
                                  : VK_ATTACHMENT_LOAD_OP_DONT_CARE;
    };
    const auto store = [](Store s) {
        return s == Store::Store ? VK_ATTACHMENT_STORE_OP_STORE : VK_ATTACHMENT_STORE_OP_DONT_CARE;
    };
    std::array<VkRenderingAttachmentInfo, kMaxColorTargets> colors;
    VkRenderingAttachmentInfo depth{.sType = VK_STRUCTURE_TYPE_RENDERING_ATTACHMENT_INFO};
    VkRect2D area{};
    uint32_t count = 0;
    for (const ColorAttachment& c : desc.colors) {
        const View* view = device_.find(c.view);
        if (!have(view) || count == kMaxColorTargets) return *this;
        VkClearValue clear{};
        for (size_t i = 0; i < 4; ++i) {
            if (info(view->texture.format).sample_type == SampleType::Uint) {
                clear.color.uint32[i] = uint32_t(std::llround(c.clear[i]));
            } else {
                clear.color.float32[i] = c.clear[i];
            }
        }
        colors[count++] = {.sType = VK_STRUCTURE_TYPE_RENDERING_ATTACHMENT_INFO,
                           .imageView = view->vk,
                           .imageLayout = VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL,
                           .loadOp = load(c.load),
                           .storeOp = store(c.store),
                           .clearValue = clear};
        const Extent e = mip_extent(view->texture, view->desc.range.base_mip);
        area.extent = {e.width, e.height};
    }
    if (desc.depth.view) {
        const View* view = device_.find(desc.depth.view);
        if (!have(view)) return *this;
        depth.imageView = view->vk;
        depth.imageLayout = desc.depth.read_only ? VK_IMAGE_LAYOUT_DEPTH_STENCIL_READ_ONLY_OPTIMAL
                                                 : VK_IMAGE_LAYOUT_DEPTH_STENCIL_ATTACHMENT_OPTIMAL;
        depth.loadOp = desc.depth.read_only ? VK_ATTACHMENT_LOAD_OP_LOAD : load(desc.depth.load);
        depth.storeOp = desc.depth.read_only ? VK_ATTACHMENT_STORE_OP_NONE : store(desc.depth.store);
        depth.clearValue.depthStencil = {desc.depth.clear, 0};
        const Extent e = mip_extent(view->texture, view->desc.range.base_mip);
        area.extent = {e.width, e.height};
    }
    if (error_) return *this;
    const VkRenderingInfo rendering{.sType = VK_STRUCTURE_TYPE_RENDERING_INFO,
                                    .renderArea = area,
                                    .layerCount = 1,
                                    .colorAttachmentCount = count,
                                    .pColorAttachments = colors.data(),
                                    .pDepthAttachment = desc.depth.view ? &depth : nullptr};
    vk_.vkCmdBeginRendering(cmd_, &rendering);
    in_render_ = true;
    set_viewport(0, 0, float(area.extent.width), float(area.extent.height), 0, 1);
    set_scissor(0, 0, area.extent.width, area.extent.height);
    set_blend_constant({});
    return *this;
}

void VulkanEncoder::end() {
    if (in_render_) vk_.vkCmdEndRendering(cmd_);
    in_render_ = false;
    for (BoundGroup& g : groups_) g = {};
    push_bytes_ = 0;
    pop_label();
}

void VulkanEncoder::set_pipeline(ComputePipeline handle) {
    if (const Pipeline* p = device_.find(handle); have(p)) switch_to(VK_PIPELINE_BIND_POINT_COMPUTE, p);
}

void VulkanEncoder::set_pipeline(TracePipeline handle) {
    if (const Pipeline* p = device_.find(handle); have(p)) {
        switch_to(VK_PIPELINE_BIND_POINT_RAY_TRACING_KHR, p);
        table_ = p->groups_in_table;
    }
}

// Groups are bound to one of the two kinds of pipeline.
void VulkanEncoder::switch_to(VkPipelineBindPoint point, const Pipeline* p) {
    if (bind_point_ != point) layout_ = VK_NULL_HANDLE;
    bind_point_ = point;
    set_pipeline(p);
}

void VulkanEncoder::set_pipeline(RenderPipeline handle) {
    if (const Pipeline* p = device_.find(handle); have(p)) set_pipeline(p);
}

void VulkanEncoder::set_pipeline(const Pipeline* p) {
    if (!p) {
        layout_ = VK_NULL_HANDLE;
        return;
    }
    vk_.vkCmdBindPipeline(cmd_, bind_point_, p->vk);
    // Another layout may disturb what was bound under the old one.
    if (layout_ != p->layout) {
        for (BoundGroup& g : groups_) g.dirty = true;
        push_dirty_ = true;
    }
    layout_ = p->layout;
    group_count_ = uint32_t(p->groups.size());
    push_needed_ = p->reflection.push_bytes;
}

void VulkanEncoder::set_bind_group(uint32_t index, BindGroup handle, std::span<const uint32_t> dynamic_offsets) {
    const Group* g = device_.find(handle);
    if (!have(g)) return;
    if (index >= kMaxBindGroups || dynamic_offsets.size() > 8)
        return fail({"set_bind_group: index or offsets out of range"});
    BoundGroup& bound = groups_[index];
    bound.set = g->vk;
    bound.offset_count = uint32_t(dynamic_offsets.size());
    std::copy(dynamic_offsets.begin(), dynamic_offsets.end(), bound.offsets.begin());
    bound.dirty = true;
}

void VulkanEncoder::set_push(std::span<const std::byte> bytes) {
    if (bytes.size() > kMaxPushBytes) return fail({"set_push: more than 64 bytes"});
    std::memcpy(push_.data(), bytes.data(), bytes.size());
    push_bytes_ = uint32_t(bytes.size());
    push_dirty_ = true;
}

bool VulkanEncoder::apply() {
    if (!cmd_ || error_) return false;
    if (!layout_) {
        fail({"dispatch or draw without a pipeline"});
        return false;
    }
    for (uint32_t i = 0; i < group_count_; ++i) {
        BoundGroup& g = groups_[i];
        if (!g.set || !g.dirty) continue;
        vk_.vkCmdBindDescriptorSets(cmd_, bind_point_, layout_, i, 1, &g.set, g.offset_count, g.offsets.data());
        g.dirty = false;
    }
    if (push_dirty_ && push_bytes_ > 0 && push_needed_ > 0) {
        vk_.vkCmdPushConstants(cmd_, layout_, device_.stages().push, 0, std::min(push_bytes_, push_needed_),
                               push_.data());
        push_dirty_ = false;
    }
    return true;
}

void VulkanEncoder::dispatch(uint32_t x, uint32_t y, uint32_t z) {
    if (apply()) vk_.vkCmdDispatch(cmd_, x, y, z);
}

void VulkanEncoder::dispatch_indirect(BufferHandle buffer, uint64_t offset) {
    const Buffer* b = device_.find(buffer);
    if (have(b) && apply()) vk_.vkCmdDispatchIndirect(cmd_, b->vk, offset);
}

void VulkanEncoder::trace(uint32_t width, uint32_t height) {
    if (!apply()) return;
    const VkStridedDeviceAddressRegionKHR none{};
    vk_.vkCmdTraceRaysKHR(cmd_, &table_[0], &table_[1], &table_[2], &none, width, height, 1);
}

void VulkanEncoder::set_vertex_buffer(uint32_t slot, BufferHandle buffer, uint64_t offset) {
    if (const Buffer* b = device_.find(buffer); have(b)) vk_.vkCmdBindVertexBuffers(cmd_, slot, 1, &b->vk, &offset);
}

void VulkanEncoder::set_index_buffer(BufferHandle buffer, bool is_32_bit, uint64_t offset) {
    if (const Buffer* b = device_.find(buffer); have(b))
        vk_.vkCmdBindIndexBuffer(cmd_, b->vk, offset, is_32_bit ? VK_INDEX_TYPE_UINT32 : VK_INDEX_TYPE_UINT16);
}

void VulkanEncoder::set_viewport(float x, float y, float width, float height, float depth_min, float depth_max) {
    if (!cmd_) return;
    // Clip space has +y up, as everywhere but in Vulkan: a viewport of negative height turns it over.
    const VkViewport v{x, y + height, width, -height, depth_min, depth_max};
    vk_.vkCmdSetViewport(cmd_, 0, 1, &v);
}

void VulkanEncoder::set_scissor(uint32_t x, uint32_t y, uint32_t width, uint32_t height) {
    if (!cmd_) return;
    const VkRect2D r{{int32_t(x), int32_t(y)}, {width, height}};
    vk_.vkCmdSetScissor(cmd_, 0, 1, &r);
}

void VulkanEncoder::set_blend_constant(std::array<float, 4> rgba) {
    if (cmd_) vk_.vkCmdSetBlendConstants(cmd_, rgba.data());
}

void VulkanEncoder::draw(uint32_t vertices, uint32_t instances, uint32_t first_vertex, uint32_t first_instance) {
    if (apply()) vk_.vkCmdDraw(cmd_, vertices, instances, first_vertex, first_instance);
}

void VulkanEncoder::draw_indexed(uint32_t indices, uint32_t instances, uint32_t first_index, int32_t base_vertex,
                                 uint32_t first_instance) {
    if (apply()) vk_.vkCmdDrawIndexed(cmd_, indices, instances, first_index, base_vertex, first_instance);
}

void VulkanEncoder::draw_indirect(BufferHandle buffer, uint64_t offset, uint32_t draws, uint32_t stride) {
    const Buffer* b = device_.find(buffer);
    if (have(b) && apply()) vk_.vkCmdDrawIndirect(cmd_, b->vk, offset, draws, stride);
}

void VulkanEncoder::draw_indexed_indirect(BufferHandle buffer, uint64_t offset, uint32_t draws, uint32_t stride) {
    const Buffer* b = device_.find(buffer);
    if (have(b) && apply()) vk_.vkCmdDrawIndexedIndirect(cmd_, b->vk, offset, draws, stride);
}

void VulkanEncoder::draw_mesh_groups(uint32_t x, uint32_t y, uint32_t z) {
    if (apply()) vk_.vkCmdDrawMeshTasksEXT(cmd_, x, y, z);
}

void VulkanEncoder::build_box_tree(BufferHandle tree, BufferHandle boxes, uint64_t offset, uint32_t count) {
    Buffer* to = device_.find(tree);
    const Buffer* from = device_.find(boxes);
    if (!have(to) || !have(from)) return;
    if (Result<void> r = device_.record_box_tree(cmd_, *to, *from, offset, count); !r) fail(r.error());
}

// ---- copies

void VulkanEncoder::copy_buffer(BufferHandle src, uint64_t src_offset, BufferHandle dst, uint64_t dst_offset,
                                uint64_t size) {
    const Buffer* from = device_.find(src);
    const Buffer* to = device_.find(dst);
    if (!have(from) || !have(to) || size == 0) return;
    const VkBufferCopy region{src_offset, dst_offset, size};
    vk_.vkCmdCopyBuffer(cmd_, from->vk, to->vk, 1, &region);
}

void VulkanEncoder::copy_buffer_to_texture(const BufferLayout& src, const TexturePlace& dst, Extent size) {
    const Buffer* from = device_.find(src.buffer);
    const Texture* to = device_.find(dst.texture);
    if (!have(from) || !have(to)) return;
    VkBufferImageCopy2 region = image_region(to->desc, dst, size);
    region.bufferOffset = src.offset;
    region.bufferRowLength = src.bytes_per_row / bytes_per_texel(to->desc.format);
    region.bufferImageHeight = src.rows_per_layer;
    const VkCopyBufferToImageInfo2 info{.sType = VK_STRUCTURE_TYPE_COPY_BUFFER_TO_IMAGE_INFO_2,
                                        .srcBuffer = from->vk,
                                        .dstImage = to->vk,
                                        .dstImageLayout = layout_of(Access::CopyWrite, to->desc),
                                        .regionCount = 1,
                                        .pRegions = &region};
    vk_.vkCmdCopyBufferToImage2(cmd_, &info);
}

void VulkanEncoder::copy_texture_to_buffer(const TexturePlace& src, const BufferLayout& dst, Extent size) {
    const Texture* from = device_.find(src.texture);
    const Buffer* to = device_.find(dst.buffer);
    if (!have(from) || !have(to)) return;
    VkBufferImageCopy2 region = image_region(from->desc, src, size);
    region.bufferOffset = dst.offset;
    region.bufferRowLength = dst.bytes_per_row / bytes_per_texel(from->desc.format);
    region.bufferImageHeight = dst.rows_per_layer;
    const VkCopyImageToBufferInfo2 info{.sType = VK_STRUCTURE_TYPE_COPY_IMAGE_TO_BUFFER_INFO_2,
                                        .srcImage = from->vk,
                                        .srcImageLayout = layout_of(Access::CopyRead, from->desc),
                                        .dstBuffer = to->vk,
                                        .regionCount = 1,
                                        .pRegions = &region};
    vk_.vkCmdCopyImageToBuffer2(cmd_, &info);
}

void VulkanEncoder::copy_texture(const TexturePlace& src, const TexturePlace& dst, Extent size) {
    const Texture* from = device_.find(src.texture);
    const Texture* to = device_.find(dst.texture);
    if (!have(from) || !have(to)) return;
    const VkBufferImageCopy2 a = image_region(from->desc, src, size);
    const VkBufferImageCopy2 b = image_region(to->desc, dst, size);
    VkImageCopy2 region{.sType = VK_STRUCTURE_TYPE_IMAGE_COPY_2,
                        .srcSubresource = a.imageSubresource,
                        .srcOffset = a.imageOffset,
                        .dstSubresource = b.imageSubresource,
                        .dstOffset = b.imageOffset,
                        .extent = {size.width, size.height, std::max(a.imageExtent.depth, b.imageExtent.depth)}};
    const VkCopyImageInfo2 info{.sType = VK_STRUCTURE_TYPE_COPY_IMAGE_INFO_2,
                                .srcImage = from->vk,
                                .srcImageLayout = layout_of(Access::CopyRead, from->desc),
                                .dstImage = to->vk,
                                .dstImageLayout = layout_of(Access::CopyWrite, to->desc),
                                .regionCount = 1,
                                .pRegions = &region};
    vk_.vkCmdCopyImage2(cmd_, &info);
}

void VulkanEncoder::clear_buffer(BufferHandle buffer, uint64_t offset, uint64_t size, uint32_t word) {
    const Buffer* b = device_.find(buffer);
    if (!have(b)) return;
    if (size == kWholeSize) size = b->desc.size - std::min(offset, b->desc.size);
    size &= ~3ull;
    if (size > 0) vk_.vkCmdFillBuffer(cmd_, b->vk, offset, size, word);
}

void VulkanEncoder::clear_texture(TextureHandle texture, std::array<float, 4> value, Subresources range) {
    const Texture* t = device_.find(texture);
    if (!have(t)) return;
    const Subresources r = resolved(t->desc, range);
    const VkImageSubresourceRange sub{aspect(t->desc.format), r.base_mip, r.mip_count, r.base_layer, r.layer_count};
    const VkImageLayout layout = layout_of(Access::CopyWrite, t->desc);
    if (is_depth(t->desc.format)) {
        const VkClearDepthStencilValue clear{value[0], 0};
        vk_.vkCmdClearDepthStencilImage(cmd_, t->vk, layout, &clear, 1, &sub);
        return;
    }
    VkClearColorValue clear{};
    for (size_t i = 0; i < 4; ++i) {
        if (info(t->desc.format).sample_type == SampleType::Uint) {
            clear.uint32[i] = uint32_t(std::llround(value[i]));
        } else {
            clear.float32[i] = value[i];
        }
    }
    vk_.vkCmdClearColorImage(cmd_, t->vk, layout, &clear, 1, &sub);
}

// ---- synchronisation

void VulkanEncoder::barrier(BarrierKey, std::span<const Barrier> barriers) {
    image_barriers_.clear();
    buffer_barriers_.clear();
    for (const Barrier& b : barriers) {
        const Sync before = sync_of(b.before | b.alias_before, device_.stages());
        const Sync after = sync_of(b.after, device_.stages());
        if (b.texture) {
            const Texture* t = device_.find(b.texture);
            if (!have(t)) return;
            const Subresources r = resolved(t->desc, b.range);
            image_barriers_.push_back(
                {.sType = VK_STRUCTURE_TYPE_IMAGE_MEMORY_BARRIER_2,
                 .srcStageMask = before.stages,
                 .srcAccessMask = before.access,
                 .dstStageMask = after.stages,
                 .dstAccessMask = after.access,
                 .oldLayout = layout_of(b.before, t->desc),
                 .newLayout = layout_of(b.after, t->desc),
                 .srcQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED,
                 .dstQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED,
                 .image = t->vk,
                 .subresourceRange = {aspect(t->desc.format), r.base_mip, r.mip_count, r.base_layer, r.layer_count}});
        } else {
            const Buffer* buffer = device_.find(b.buffer);
            if (!have(buffer)) return;
            buffer_barriers_.push_back({.sType = VK_STRUCTURE_TYPE_BUFFER_MEMORY_BARRIER_2,
                                        .srcStageMask = before.stages,
                                        .srcAccessMask = before.access,
                                        .dstStageMask = after.stages,
                                        .dstAccessMask = after.access,
                                        .srcQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED,
                                        .dstQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED,
                                        .buffer = buffer->vk,
                                        .offset = 0,
                                        .size = VK_WHOLE_SIZE});
        }
    }
    // Memory that passed from one resource to another: a barrier on the new one alone doesn't flush the old one's writes.
    Access alias_before = Access::Undefined;
    Access alias_after = Access::Undefined;
    for (const Barrier& b : barriers) {
        if (!any(b.alias_before)) continue;
        alias_before |= b.alias_before;
        alias_after |= b.after;
    }
    const Sync before = sync_of(alias_before, device_.stages());
    const Sync after = sync_of(alias_after, device_.stages());
    const VkMemoryBarrier2 alias{.sType = VK_STRUCTURE_TYPE_MEMORY_BARRIER_2,
                                 .srcStageMask = before.stages,
                                 .srcAccessMask = before.access,
                                 .dstStageMask = after.stages,
                                 .dstAccessMask = after.access};
    const VkDependencyInfo info{.sType = VK_STRUCTURE_TYPE_DEPENDENCY_INFO,
                                .memoryBarrierCount = any(alias_before) ? 1u : 0u,
                                .pMemoryBarriers = &alias,
                                .bufferMemoryBarrierCount = uint32_t(buffer_barriers_.size()),
                                .pBufferMemoryBarriers = buffer_barriers_.data(),
                                .imageMemoryBarrierCount = uint32_t(image_barriers_.size()),
                                .pImageMemoryBarriers = image_barriers_.data()};
    if (cmd_ && !barriers.empty()) vk_.vkCmdPipelineBarrier2(cmd_, &info);
}

void VulkanEncoder::write_timestamp(QuerySet set, uint32_t index) {
    const Queries* q = device_.find(set);
    if (!have(q) || index >= q->count) return;
    vk_.vkCmdResetQueryPool(cmd_, q->vk, index, 1);
    vk_.vkCmdWriteTimestamp2(cmd_, VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT, q->vk, index);
}

void VulkanEncoder::resolve_queries(QuerySet set, uint32_t first, uint32_t count, BufferHandle dst, uint64_t offset) {
    const Queries* q = device_.find(set);
    const Buffer* b = device_.find(dst);
    if (!have(q) || !have(b) || count == 0) return;
    vk_.vkCmdCopyQueryPoolResults(cmd_, q->vk, first, count, b->vk, offset, 8,
                                  VK_QUERY_RESULT_64_BIT | VK_QUERY_RESULT_WAIT_BIT);
}

}  // namespace kiln::rhi::vulkan
