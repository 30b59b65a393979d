// SPDX-License-Identifier: MIT
// Our words in Vulkan's.
#pragma once

#include "rhi/device.h"

#include <volk.h>

// Vulkan's structs mean "nothing" by zero; we name only what differs from it.
#pragma GCC diagnostic ignored "-Wmissing-field-initializers"

namespace kiln::rhi::vulkan {

VkFormat to_vk(Format format);
VkBufferUsageFlags to_vk(BufferUsage usage);
VkImageUsageFlags to_vk(TextureUsage usage);
VkShaderStageFlags to_vk(ShaderStage stages);
VkCompareOp to_vk(Compare compare);
VkFormat to_vk(VertexFormat format);
VkBlendFactor to_vk(BlendFactor factor);
VkBlendOp to_vk(BlendOp op);
VkPrimitiveTopology to_vk(Topology topology);
VkDescriptorType to_vk(const BindGroupLayoutEntry& entry);
VkImageAspectFlags aspect(Format format);

struct Sync {
    VkPipelineStageFlags2 stages = VK_PIPELINE_STAGE_2_NONE;
    VkAccessFlags2 access = VK_ACCESS_2_NONE;
};
// The stages in which shaders run; those of the tiers only where the device has them.
struct ShaderStages {
    VkPipelineStageFlags2 graphics = VK_PIPELINE_STAGE_2_VERTEX_SHADER_BIT | VK_PIPELINE_STAGE_2_FRAGMENT_SHADER_BIT;
    VkPipelineStageFlags2 compute = VK_PIPELINE_STAGE_2_COMPUTE_SHADER_BIT;
    VkShaderStageFlags push = VK_SHADER_STAGE_VERTEX_BIT | VK_SHADER_STAGE_FRAGMENT_BIT | VK_SHADER_STAGE_COMPUTE_BIT;
};
Sync sync_of(Access access, const ShaderStages& shaders);

// Layout of a texture while it is accessed so. A texture has one layout for all shader reads, fixed by its usage, because
// bind groups are written long before anyone knows which reads will share a barrier.
VkImageLayout shader_read_layout(const TextureDesc& desc);
VkImageLayout layout_of(Access access, const TextureDesc& desc);

// "VK_ERROR_DEVICE_LOST"
std::string name(VkResult result);
// "{what}: {result}"; out of memory and a lost device get their kind.
Error failure(std::string_view what, VkResult result);

}  // namespace kiln::rhi::vulkan
