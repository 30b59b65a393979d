// SPDX-License-Identifier: MIT
#include "rhi/vulkan/upload.h"

#include <algorithm>
#include <cstring>

namespace kiln::rhi::vulkan {

namespace {

constexpr uint64_t kChunkBytes = 4ull << 20;
constexpr size_t kIdleChunks = 4;  // more are given back

void full_barrier(const VolkDeviceTable& vk, VkCommandBuffer commands, const VkMemoryBarrier2& barrier) {
    const VkDependencyInfo info{
        .sType = VK_STRUCTURE_TYPE_DEPENDENCY_INFO, .memoryBarrierCount = 1, .pMemoryBarriers = &barrier};
    vk.vkCmdPipelineBarrier2(commands, &info);
}

}  // namespace

void Uploads::init(VkDevice device, const VolkDeviceTable* vk, Memory* memory) {
    device_ = device;
    vk_ = vk;
    memory_ = memory;
}

void Uploads::shutdown() {
    for (auto* list : {&filling_, &idle_})
        for (Chunk& chunk : *list) free_chunk(chunk);
    for (Chunk& chunk : busy_) free_chunk(chunk);
    filling_.clear();
    idle_.clear();
    busy_.clear();
}

void Uploads::free_chunk(Chunk& chunk) {
    vk_->vkDestroyBuffer(device_, chunk.buffer, nullptr);
    memory_->release(chunk.memory);
}

Result<Uploads::Chunk> Uploads::make_chunk(uint64_t size) {
    const VkBufferCreateInfo info{
        .sType = VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO, .size = size, .usage = VK_BUFFER_USAGE_TRANSFER_SRC_BIT};
    Chunk out;
    if (const VkResult r = vk_->vkCreateBuffer(device_, &info, nullptr, &out.buffer); r != VK_SUCCESS)
        return failure("staging", r);
    VkMemoryRequirements need;
    vk_->vkGetBufferMemoryRequirements(device_, out.buffer, &need);
    Result<Allocation> memory = memory_->allocate(need, MemoryKind::Upload, false, "staging");
    if (!memory) {
        vk_->vkDestroyBuffer(device_, out.buffer, nullptr);
        return memory.error();
    }
    out.memory = *memory;
    if (const VkResult r = vk_->vkBindBufferMemory(device_, out.buffer, memory->memory, memory->offset);
        r != VK_SUCCESS) {
        free_chunk(out);
        return failure("staging", r);
    }
    return out;
}

Result<Uploads::Place> Uploads::stage(std::span<const std::byte> bytes, uint64_t alignment) {
    const auto room = [&](const Chunk& c) { return (c.used + alignment - 1) / alignment * alignment; };
    if (filling_.empty() || room(filling_.back()) + bytes.size() > filling_.back().memory.size) {
        if (bytes.size() <= kChunkBytes && !idle_.empty()) {
            filling_.push_back(idle_.back());
            idle_.pop_back();
        } else {
            Result<Chunk> made = make_chunk(std::max<uint64_t>(bytes.size(), kChunkBytes));
            if (!made) return made.error();
            filling_.push_back(*made);
        }
    }
    Chunk& chunk = filling_.back();
    const uint64_t offset = room(chunk);
    std::memcpy(chunk.memory.mapped + offset, bytes.data(), bytes.size());
    chunk.used = offset + bytes.size();
    return Place{chunk.buffer, offset};
}

Result<void> Uploads::to_buffer(VkBuffer buffer, uint64_t offset, std::span<const std::byte> bytes) {
    if (bytes.empty()) return {};
    Result<Place> place = stage(bytes, 16);
    if (!place) return place.error();
    buffers_.push_back({place->buffer,
                        buffer,
                        {.sType = VK_STRUCTURE_TYPE_BUFFER_COPY_2,
                         .srcOffset = place->offset,
                         .dstOffset = offset,
                         .size = bytes.size()}});
    return {};
}

Result<void> Uploads::to_image(const ImageTarget& target, std::span<const std::byte> bytes) {
    // The copy wants an offset that is a multiple of the texel and of 4; texels have 1, 2, 4, 8 or 16 bytes.
    Result<Place> place = stage(bytes, 16);
    if (!place) return place.error();
    images_.push_back({place->buffer, target});
    images_.back().target.region.bufferOffset = place->offset;
    return {};
}

void Uploads::record(VkCommandBuffer commands, SubmitId id) {
    full_barrier(*vk_, commands,
                 {.sType = VK_STRUCTURE_TYPE_MEMORY_BARRIER_2,
                  .srcStageMask = VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT,
                  .srcAccessMask = VK_ACCESS_2_MEMORY_WRITE_BIT | VK_ACCESS_2_MEMORY_READ_BIT,
                  .dstStageMask = VK_PIPELINE_STAGE_2_ALL_TRANSFER_BIT,
                  .dstAccessMask = VK_ACCESS_2_TRANSFER_WRITE_BIT | VK_ACCESS_2_TRANSFER_READ_BIT});

    // Copies over bytes that an earlier copy of this batch wrote must come after it.
    // The window keeps thousands of small writes from being compared each with each.
    constexpr size_t kWindow = 256;
    size_t since = 0;
    for (size_t i = 0; i < buffers_.size(); ++i) {
        const BufferCopy& copy = buffers_[i];
        const bool overlaps =
            std::any_of(buffers_.begin() + ptrdiff_t(since), buffers_.begin() + ptrdiff_t(i), [&](const BufferCopy& c) {
                return c.to == copy.to && c.region.dstOffset < copy.region.dstOffset + copy.region.size &&
                       copy.region.dstOffset < c.region.dstOffset + c.region.size;
            });
        if (overlaps || i - since >= kWindow) {
            full_barrier(*vk_, commands,
                         {.sType = VK_STRUCTURE_TYPE_MEMORY_BARRIER_2,
                          .srcStageMask = VK_PIPELINE_STAGE_2_ALL_TRANSFER_BIT,
                          .srcAccessMask = VK_ACCESS_2_TRANSFER_WRITE_BIT,
                          .dstStageMask = VK_PIPELINE_STAGE_2_ALL_TRANSFER_BIT,
                          .dstAccessMask = VK_ACCESS_2_TRANSFER_WRITE_BIT});
            since = i;
        }
        const VkCopyBufferInfo2 info{.sType = VK_STRUCTURE_TYPE_COPY_BUFFER_INFO_2,
                                     .srcBuffer = copy.from,
                                     .dstBuffer = copy.to,
                                     .regionCount = 1,
                                     .pRegions = &copy.region};
        vk_->vkCmdCopyBuffer2(commands, &info);
    }

    for (const ImageCopy& copy : images_) {
        const ImageTarget& t = copy.target;
        const VkImageSubresourceLayers& s = t.region.imageSubresource;
        VkImageMemoryBarrier2 barrier{
            .sType = VK_STRUCTURE_TYPE_IMAGE_MEMORY_BARRIER_2,
            .srcStageMask = t.before.stages | VK_PIPELINE_STAGE_2_ALL_TRANSFER_BIT,
            .srcAccessMask = t.before.access | VK_ACCESS_2_TRANSFER_WRITE_BIT,
            .dstStageMask = VK_PIPELINE_STAGE_2_ALL_TRANSFER_BIT,
            .dstAccessMask = VK_ACCESS_2_TRANSFER_WRITE_BIT,
            .oldLayout = t.layout_before,
            .newLayout = VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL,
            .srcQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED,
            .dstQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED,
            .image = t.image,
            .subresourceRange = {s.aspectMask, s.mipLevel, 1, s.baseArrayLayer, s.layerCount}};
        const VkDependencyInfo dependency{
            .sType = VK_STRUCTURE_TYPE_DEPENDENCY_INFO, .imageMemoryBarrierCount = 1, .pImageMemoryBarriers = &barrier};
        vk_->vkCmdPipelineBarrier2(commands, &dependency);
        const VkCopyBufferToImageInfo2 info{.sType = VK_STRUCTURE_TYPE_COPY_BUFFER_TO_IMAGE_INFO_2,
                                            .srcBuffer = copy.from,
                                            .dstImage = t.image,
                                            .dstImageLayout = VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL,
                                            .regionCount = 1,
                                            .pRegions = &t.region};
        vk_->vkCmdCopyBufferToImage2(commands, &info);
        barrier.srcStageMask = VK_PIPELINE_STAGE_2_ALL_TRANSFER_BIT;
        barrier.srcAccessMask = VK_ACCESS_2_TRANSFER_WRITE_BIT;
        barrier.dstStageMask = t.after.stages;
        barrier.dstAccessMask = t.after.access;
        barrier.oldLayout = VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL;
        barrier.newLayout = t.layout_after;
        vk_->vkCmdPipelineBarrier2(commands, &dependency);
    }

    full_barrier(*vk_, commands,
                 {.sType = VK_STRUCTURE_TYPE_MEMORY_BARRIER_2,
                  .srcStageMask = VK_PIPELINE_STAGE_2_ALL_TRANSFER_BIT,
                  .srcAccessMask = VK_ACCESS_2_TRANSFER_WRITE_BIT,
                  .dstStageMask = VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT,
                  .dstAccessMask = VK_ACCESS_2_MEMORY_WRITE_BIT | VK_ACCESS_2_MEMORY_READ_BIT});
    buffers_.clear();
    images_.clear();
    for (Chunk& chunk : filling_) {
        chunk.busy_until = id;
        busy_.push_back(chunk);
    }
    filling_.clear();
}

void Uploads::recycle(SubmitId done) {
    while (!busy_.empty() && busy_.front().busy_until <= done) {
        Chunk chunk = busy_.front();
        busy_.pop_front();
        chunk.used = 0;
        if (chunk.memory.size > 2 * kChunkBytes || idle_.size() >= kIdleChunks) {
            free_chunk(chunk);
        } else {
            idle_.push_back(chunk);
        }
    }
}

}  // namespace kiln::rhi::vulkan
