// SPDX-License-Identifier: MIT
#include "rhi/vulkan/memory.h"

#include <algorithm>

namespace kiln::rhi::vulkan {

namespace {

constexpr uint64_t kMiB = 1ull << 20;

// Blocks are a 32nd of their heap, so that a small heap isn't swallowed by one and a large one needs few.
uint64_t block_bytes(uint64_t heap, MemoryKind kind) {
    const uint64_t most = kind == MemoryKind::Device ? 128 * kMiB : 32 * kMiB;
    return std::clamp(heap / 32, 8 * kMiB, most) & ~(kMiB - 1);
}

}  // namespace

void Memory::init(VkPhysicalDevice physical, VkDevice device, const VolkDeviceTable* vk, bool addresses) {
    device_ = device;
    vk_ = vk;
    addresses_ = addresses;
    vkGetPhysicalDeviceMemoryProperties(physical, &properties_);
    VkPhysicalDeviceProperties p;
    vkGetPhysicalDeviceProperties(physical, &p);
    granularity_ = std::max<uint64_t>(1, p.limits.bufferImageGranularity);
}

void Memory::shutdown() {
    while (!blocks_.empty()) free_block(blocks_.begin());
}

uint32_t Memory::pick_type(uint32_t type_bits, MemoryKind kind) const {
    constexpr VkMemoryPropertyFlags kLocal = VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT;
    constexpr VkMemoryPropertyFlags kCached = VK_MEMORY_PROPERTY_HOST_CACHED_BIT;
    // Coherent only: every driver must have such a type, and nobody has to flush.
    constexpr VkMemoryPropertyFlags kHost = VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT;
    constexpr VkMemoryPropertyFlags kOdd = VK_MEMORY_PROPERTY_LAZILY_ALLOCATED_BIT | VK_MEMORY_PROPERTY_PROTECTED_BIT |
                                           VK_MEMORY_PROPERTY_DEVICE_COHERENT_BIT_AMD;
    uint32_t best = kRemaining;
    int best_score = -1;
    for (uint32_t i = 0; i < properties_.memoryTypeCount; ++i) {
        const VkMemoryPropertyFlags flags = properties_.memoryTypes[i].propertyFlags;
        if (!(type_bits >> i & 1u) || (flags & kOdd)) continue;
        int score = 0;
        if (kind == MemoryKind::Device) {
            score = ((flags & kLocal) ? 4 : 0) + ((flags & kHost) == 0 ? 1 : 0);
        } else {
            if ((flags & kHost) != kHost) continue;
            const bool cached = flags & kCached;
            score = (cached == (kind == MemoryKind::Readback) ? 2 : 0) + ((flags & kLocal) ? 0 : 1);
        }
        if (score > best_score) {
            best_score = score;
            best = i;
        }
    }
    return best;
}

Result<Block*> Memory::add_block(uint64_t size, uint32_t type, MemoryKind kind, bool images, bool alone,
                                 std::string_view what) {
    const uint32_t heap = properties_.memoryTypes[type].heapIndex;
    // Some drivers promise more than the heap has and fail later, in the middle of a frame.
    if (reserved_[heap] + size > properties_.memoryHeaps[heap].size)
        return failure(what, VK_ERROR_OUT_OF_DEVICE_MEMORY);
    const VkMemoryAllocateFlagsInfo flags{.sType = VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_FLAGS_INFO,
                                          .flags = VK_MEMORY_ALLOCATE_DEVICE_ADDRESS_BIT};
    const VkMemoryAllocateInfo info{.sType = VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO,
                                    .pNext = addresses_ && !images ? &flags : nullptr,
                                    .allocationSize = size,
                                    .memoryTypeIndex = type};
    VkDeviceMemory memory = VK_NULL_HANDLE;
    if (const VkResult result = vk_->vkAllocateMemory(device_, &info, nullptr, &memory); result != VK_SUCCESS)
        return failure(what, result);
    void* mapped = nullptr;
    if (kind != MemoryKind::Device) {
        if (const VkResult result = vk_->vkMapMemory(device_, memory, 0, VK_WHOLE_SIZE, 0, &mapped);
            result != VK_SUCCESS) {
            vk_->vkFreeMemory(device_, memory, nullptr);
            return failure(what, result);
        }
    }
    reserved_[heap] += size;
    blocks_.push_back({memory, type, kind, images, alone, static_cast<std::byte*>(mapped), RangeAllocator(size)});
    return &blocks_.back();
}

void Memory::free_block(std::list<Block>::iterator it) {
    reserved_[properties_.memoryTypes[it->type].heapIndex] -= it->ranges.size();
    vk_->vkFreeMemory(device_, it->memory, nullptr);  // unmaps
    blocks_.erase(it);
}

Result<Allocation> Memory::allocate(const VkMemoryRequirements& need, MemoryKind kind, bool images,
                                    std::string_view what) {
    const uint32_t type = pick_type(need.memoryTypeBits, kind);
    if (type == kRemaining) return Error{std::string(what) + ": the driver has no fitting kind of memory"};
    const uint64_t block_size =
        block_bytes(properties_.memoryHeaps[properties_.memoryTypes[type].heapIndex].size, kind);

    Block* block = nullptr;
    std::optional<uint64_t> offset;
    if (need.size <= block_size / 2) {
        for (Block& b : blocks_) {
            if (b.alone || b.type != type || b.kind != kind || b.images != images) continue;
            offset = b.ranges.allocate(need.size, need.alignment);
            block = &b;
            if (offset) break;
        }
        if (!offset) {
            // If a whole block no longer fits, the resource alone still may.
            Result<Block*> added = add_block(block_size, type, kind, images, false, what);
            if (added) {
                block = *added;
                offset = block->ranges.allocate(need.size, need.alignment);
            }
        }
    }
    if (!offset) {
        Result<Block*> added = add_block(need.size, type, kind, images, true, what);
        if (!added) return added.error();
        block = *added;
        offset = block->ranges.allocate(need.size, 1);
    }
    used_bytes_ += need.size;
    peak_bytes_ = std::max(peak_bytes_, used_bytes_);
    return Allocation{block->memory, *offset, need.size, block->mapped ? block->mapped + *offset : nullptr, block};
}

void Memory::release(const Allocation& allocation) {
    Block* block = allocation.block;
    if (!block) return;
    block->ranges.release(allocation.offset);
    used_bytes_ -= allocation.size;
    if (!block->ranges.empty()) return;
    // One empty block of each sort stays, so that a resource made and dropped every frame costs no driver call.
    const bool another_empty = std::any_of(blocks_.begin(), blocks_.end(), [&](const Block& b) {
        return &b != block && !b.alone && b.type == block->type && b.kind == block->kind && b.images == block->images &&
               b.ranges.empty();
    });
    if (!block->alone && !another_empty) return;
    free_block(std::find_if(blocks_.begin(), blocks_.end(), [&](const Block& b) { return &b == block; }));
}

MemoryStats Memory::stats() const {
    MemoryStats out;
    for (const Block& b : blocks_) {
        if (b.kind == MemoryKind::Device) out.device_bytes += b.ranges.size();
        if (b.kind == MemoryKind::Upload) out.upload_bytes += b.ranges.size();
        if (b.kind == MemoryKind::Readback) out.readback_bytes += b.ranges.size();
        ++out.blocks;
    }
    out.used_bytes = used_bytes_;
    out.peak_used_bytes = peak_bytes_;
    return out;
}

}  // namespace kiln::rhi::vulkan
