// SPDX-License-Identifier: MIT
// write_buffer and write_texture: bytes are copied into a staging chunk at once and into place ahead of the next submit.
#pragma once

#include "rhi/vulkan/memory.h"

#include <deque>

namespace kiln::rhi::vulkan {

class Uploads {
public:
    void init(VkDevice device, const VolkDeviceTable* vk, Memory* memory);
    void shutdown();

    // The bytes are copied; `image` as it is before and shall be after.
    Result<void> to_buffer(VkBuffer buffer, uint64_t offset, std::span<const std::byte> bytes);
    struct ImageTarget {
        VkImage image;
        VkBufferImageCopy2 region;  // bufferOffset is filled in here
        Sync before, after;
        VkImageLayout layout_before, layout_after;
    };
    Result<void> to_image(const ImageTarget& target, std::span<const std::byte> bytes);

    bool empty() const { return buffers_.empty() && images_.empty(); }
    // Records all that waits, between full barriers; its chunks are busy until submit `id` is done.
    void record(VkCommandBuffer commands, SubmitId id);
    // Chunks of submits up to `done` are free again.
    void recycle(SubmitId done);

private:
    struct Chunk {
        VkBuffer buffer = VK_NULL_HANDLE;
        Allocation memory;
        uint64_t used = 0;
        SubmitId busy_until = 0;
    };
    struct BufferCopy {
        VkBuffer from, to;
        VkBufferCopy2 region;
    };
    struct ImageCopy {
        VkBuffer from;
        ImageTarget target;
    };
    struct Place {
        VkBuffer buffer;
        uint64_t offset;
    };

    Result<Place> stage(std::span<const std::byte> bytes, uint64_t alignment);
    Result<Chunk> make_chunk(uint64_t size);
    void free_chunk(Chunk& chunk);

    VkDevice device_ = VK_NULL_HANDLE;
    const VolkDeviceTable* vk_ = nullptr;
    Memory* memory_ = nullptr;
    std::vector<Chunk> filling_;  // of the next submit; the last one has room
    std::deque<Chunk> busy_;
    std::vector<Chunk> idle_;
    std::vector<BufferCopy> buffers_;
    std::vector<ImageCopy> images_;
};

}  // namespace kiln::rhi::vulkan
