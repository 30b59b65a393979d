// SPDX-License-Identifier: MIT
// Device memory: few large blocks per kind, cut up by RangeAllocator. Buffers and images never share a block, so the
// granularity rule between them never applies. Big resources get a block of their own.
#pragma once

#include "rhi/range_allocator.h"
#include "rhi/vulkan/convert.h"

#include <list>

namespace kiln::rhi::vulkan {

struct Block;

// A range of device memory. Plain data; give it back with Memory::release.
struct Allocation {
    VkDeviceMemory memory = VK_NULL_HANDLE;
    uint64_t offset = 0;
    uint64_t size = 0;
    std::byte* mapped = nullptr;  // of this range; null for device memory
    Block* block = nullptr;
};

struct Block {
    VkDeviceMemory memory = VK_NULL_HANDLE;
    uint32_t type = 0;
    MemoryKind kind = MemoryKind::Device;
    bool images = false;
    bool alone = false;
    std::byte* mapped = nullptr;
    RangeAllocator ranges;
};

class Memory {
public:
    Memory() = default;
    Memory(const Memory&) = delete;
    Memory& operator=(const Memory&) = delete;

    // `addresses`: buffers may be asked for their GPU address.
    void init(VkPhysicalDevice physical, VkDevice device, const VolkDeviceTable* vk, bool addresses);
    void shutdown();

    // `what` names the resource in errors.
    Result<Allocation> allocate(const VkMemoryRequirements& need, MemoryKind kind, bool images, std::string_view what);
    void release(const Allocation& allocation);

    // Memory type for a heap that may hold any device-local buffer or image; kRemaining if the driver has none.
    uint32_t heap_type(uint32_t type_bits) const { return pick_type(type_bits, MemoryKind::Device); }
    uint64_t granularity() const { return granularity_; }
    MemoryStats stats() const;

private:
    uint32_t pick_type(uint32_t type_bits, MemoryKind kind) const;
    Result<Block*> add_block(uint64_t size, uint32_t type, MemoryKind kind, bool images, bool alone,
                             std::string_view what);
    void free_block(std::list<Block>::iterator it);

    VkDevice device_ = VK_NULL_HANDLE;
    const VolkDeviceTable* vk_ = nullptr;
    bool addresses_ = false;
    VkPhysicalDeviceMemoryProperties properties_{};
    uint64_t granularity_ = 1;
    uint64_t reserved_[VK_MAX_MEMORY_HEAPS] = {};
    std::list<Block> blocks_;
    uint64_t used_bytes_ = 0;
    uint64_t peak_bytes_ = 0;
};

}  // namespace kiln::rhi::vulkan
