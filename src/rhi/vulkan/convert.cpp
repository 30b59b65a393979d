// SPDX-License-Identifier: MIT
#include "rhi/vulkan/convert.h"

namespace kiln::rhi::vulkan {

VkFormat to_vk(Format format) {
    switch (format) {
    case Format::Undefined:
        return VK_FORMAT_UNDEFINED;
    case Format::R8Snorm:
        return VK_FORMAT_R8_SNORM;
    case Format::R16Float:
        return VK_FORMAT_R16_SFLOAT;
    case Format::R16Uint:
        return VK_FORMAT_R16_UINT;
    case Format::R32Uint:
        return VK_FORMAT_R32_UINT;
    case Format::R32Float:
        return VK_FORMAT_R32_SFLOAT;
    case Format::Rg16Float:
        return VK_FORMAT_R16G16_SFLOAT;
    case Format::Rg32Uint:
        return VK_FORMAT_R32G32_UINT;
    case Format::Rgba8Unorm:
        return VK_FORMAT_R8G8B8A8_UNORM;
    case Format::Rgba16Float:
        return VK_FORMAT_R16G16B16A16_SFLOAT;
    case Format::Rgba32Float:
        return VK_FORMAT_R32G32B32A32_SFLOAT;
    case Format::Rgba32Uint:
        return VK_FORMAT_R32G32B32A32_UINT;
    case Format::R11g11b10Float:
        return VK_FORMAT_B10G11R11_UFLOAT_PACK32;
    case Format::Depth32Float:
        return VK_FORMAT_D32_SFLOAT;
    case Format::Rgba8Srgb:
        return VK_FORMAT_R8G8B8A8_SRGB;
    case Format::Bgra8Unorm:
        return VK_FORMAT_B8G8R8A8_UNORM;
    }
    return VK_FORMAT_UNDEFINED;
}

VkBufferUsageFlags to_vk(BufferUsage usage) {
    VkBufferUsageFlags out = 0;
    const auto map = [&](BufferUsage ours, VkBufferUsageFlags theirs) {
        if (any(usage & ours)) out |= theirs;
    };
    map(BufferUsage::CopySrc, VK_BUFFER_USAGE_TRANSFER_SRC_BIT);
    map(BufferUsage::CopyDst, VK_BUFFER_USAGE_TRANSFER_DST_BIT);
    map(BufferUsage::Uniform, VK_BUFFER_USAGE_UNIFORM_BUFFER_BIT);
    map(BufferUsage::Storage, VK_BUFFER_USAGE_STORAGE_BUFFER_BIT);
    map(BufferUsage::Index, VK_BUFFER_USAGE_INDEX_BUFFER_BIT);
    map(BufferUsage::Vertex, VK_BUFFER_USAGE_VERTEX_BUFFER_BIT);
    map(BufferUsage::Indirect, VK_BUFFER_USAGE_INDIRECT_BUFFER_BIT);
    map(BufferUsage::QueryResolve, VK_BUFFER_USAGE_TRANSFER_DST_BIT);
    map(BufferUsage::Address, VK_BUFFER_USAGE_SHADER_DEVICE_ADDRESS_BIT);
    map(BufferUsage::Boxes, VK_BUFFER_USAGE_SHADER_DEVICE_ADDRESS_BIT |
                                VK_BUFFER_USAGE_ACCELERATION_STRUCTURE_BUILD_INPUT_READ_ONLY_BIT_KHR);
    // Tree, the record that leads to it, and what building needs; see box_tree.cpp.
    map(BufferUsage::BoxTree, VK_BUFFER_USAGE_SHADER_DEVICE_ADDRESS_BIT |
                                  VK_BUFFER_USAGE_ACCELERATION_STRUCTURE_STORAGE_BIT_KHR |
                                  VK_BUFFER_USAGE_ACCELERATION_STRUCTURE_BUILD_INPUT_READ_ONLY_BIT_KHR |
                                  VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_TRANSFER_DST_BIT);
    return out;
}

VkImageUsageFlags to_vk(TextureUsage usage) {
    VkImageUsageFlags out = 0;
    const auto map = [&](TextureUsage ours, VkImageUsageFlags theirs) {
        if (any(usage & ours)) out |= theirs;
    };
    map(TextureUsage::CopySrc, VK_IMAGE_USAGE_TRANSFER_SRC_BIT);
    map(TextureUsage::CopyDst, VK_IMAGE_USAGE_TRANSFER_DST_BIT);
    map(TextureUsage::Sampled, VK_IMAGE_USAGE_SAMPLED_BIT);
    map(TextureUsage::Storage, VK_IMAGE_USAGE_STORAGE_BIT);
    map(TextureUsage::Color, VK_IMAGE_USAGE_COLOR_ATTACHMENT_BIT);
    map(TextureUsage::Depth, VK_IMAGE_USAGE_DEPTH_STENCIL_ATTACHMENT_BIT);
    return out;
}

VkShaderStageFlags to_vk(ShaderStage stages) {
    VkShaderStageFlags out = 0;
    if (any(stages & ShaderStage::Vertex)) out |= VK_SHADER_STAGE_VERTEX_BIT;
    if (any(stages & ShaderStage::Fragment)) out |= VK_SHADER_STAGE_FRAGMENT_BIT;
    if (any(stages & ShaderStage::Compute)) out |= VK_SHADER_STAGE_COMPUTE_BIT;
    if (any(stages & ShaderStage::Mesh)) out |= VK_SHADER_STAGE_MESH_BIT_EXT;
    if (any(stages & ShaderStage::RayGen)) out |= VK_SHADER_STAGE_RAYGEN_BIT_KHR;
    if (any(stages & ShaderStage::Miss)) out |= VK_SHADER_STAGE_MISS_BIT_KHR;
    if (any(stages & ShaderStage::Intersection)) out |= VK_SHADER_STAGE_INTERSECTION_BIT_KHR;
    if (any(stages & ShaderStage::ClosestHit)) out |= VK_SHADER_STAGE_CLOSEST_HIT_BIT_KHR;
    return out;
}

VkCompareOp to_vk(Compare compare) {
    switch (compare) {
    case Compare::Never:
        return VK_COMPARE_OP_NEVER;
    case Compare::Less:
        return VK_COMPARE_OP_LESS;
    case Compare::Equal:
        return VK_COMPARE_OP_EQUAL;
    case Compare::LessEqual:
        return VK_COMPARE_OP_LESS_OR_EQUAL;
    case Compare::Greater:
        return VK_COMPARE_OP_GREATER;
    case Compare::NotEqual:
        return VK_COMPARE_OP_NOT_EQUAL;
    case Compare::GreaterEqual:
        return VK_COMPARE_OP_GREATER_OR_EQUAL;
    case Compare::Always:
        return VK_COMPARE_OP_ALWAYS;
    }
    return VK_COMPARE_OP_ALWAYS;
}

VkFormat to_vk(VertexFormat format) {
    switch (format) {
    case VertexFormat::Float32:
        return VK_FORMAT_R32_SFLOAT;
    case VertexFormat::Float32x2:
        return VK_FORMAT_R32G32_SFLOAT;
    case VertexFormat::Float32x3:
        return VK_FORMAT_R32G32B32_SFLOAT;
    case VertexFormat::Float32x4:
        return VK_FORMAT_R32G32B32A32_SFLOAT;
    case VertexFormat::Unorm8x4:
        return VK_FORMAT_R8G8B8A8_UNORM;
    case VertexFormat::Uint32:
        return VK_FORMAT_R32_UINT;
    }
    return VK_FORMAT_UNDEFINED;
}

VkBlendFactor to_vk(BlendFactor factor) {
    switch (factor) {
    case BlendFactor::Zero:
        return VK_BLEND_FACTOR_ZERO;
    case BlendFactor::One:
        return VK_BLEND_FACTOR_ONE;
    case BlendFactor::SrcAlpha:
        return VK_BLEND_FACTOR_SRC_ALPHA;
    case BlendFactor::OneMinusSrcAlpha:
        return VK_BLEND_FACTOR_ONE_MINUS_SRC_ALPHA;
    case BlendFactor::DstAlpha:
        return VK_BLEND_FACTOR_DST_ALPHA;
    case BlendFactor::OneMinusDstAlpha:
        return VK_BLEND_FACTOR_ONE_MINUS_DST_ALPHA;
    case BlendFactor::SrcColor:
        return VK_BLEND_FACTOR_SRC_COLOR;
    case BlendFactor::DstColor:
        return VK_BLEND_FACTOR_DST_COLOR;
    }
    return VK_BLEND_FACTOR_ONE;
}

VkBlendOp to_vk(BlendOp op) {
    switch (op) {
    case BlendOp::Add:
        return VK_BLEND_OP_ADD;
    case BlendOp::Subtract:
        return VK_BLEND_OP_SUBTRACT;
    case BlendOp::ReverseSubtract:
        return VK_BLEND_OP_REVERSE_SUBTRACT;
    case BlendOp::Min:
        return VK_BLEND_OP_MIN;
    case BlendOp::Max:
        return VK_BLEND_OP_MAX;
    }
    return VK_BLEND_OP_ADD;
}

VkPrimitiveTopology to_vk(Topology topology) {
    switch (topology) {
    case Topology::TriangleList:
        return VK_PRIMITIVE_TOPOLOGY_TRIANGLE_LIST;
    case Topology::TriangleStrip:
        return VK_PRIMITIVE_TOPOLOGY_TRIANGLE_STRIP;
    case Topology::LineList:
        return VK_PRIMITIVE_TOPOLOGY_LINE_LIST;
    case Topology::LineStrip:
        return VK_PRIMITIVE_TOPOLOGY_LINE_STRIP;
    case Topology::PointList:
        return VK_PRIMITIVE_TOPOLOGY_POINT_LIST;
    }
    return VK_PRIMITIVE_TOPOLOGY_TRIANGLE_LIST;
}

VkDescriptorType to_vk(const BindGroupLayoutEntry& entry) {
    switch (entry.kind) {
    case BindingKind::UniformBuffer:
        return entry.dynamic_offset ? VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER_DYNAMIC : VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER;
    case BindingKind::StorageBuffer:
    case BindingKind::StorageBufferReadOnly:
        return entry.dynamic_offset ? VK_DESCRIPTOR_TYPE_STORAGE_BUFFER_DYNAMIC : VK_DESCRIPTOR_TYPE_STORAGE_BUFFER;
    case BindingKind::SampledTexture:
        return VK_DESCRIPTOR_TYPE_SAMPLED_IMAGE;
    case BindingKind::Sampler:
        return VK_DESCRIPTOR_TYPE_SAMPLER;
    case BindingKind::StorageTexture:
    case BindingKind::StorageTextureReadOnly:
        return VK_DESCRIPTOR_TYPE_STORAGE_IMAGE;
    case BindingKind::BoxTree:
        return VK_DESCRIPTOR_TYPE_ACCELERATION_STRUCTURE_KHR;
    }
    return VK_DESCRIPTOR_TYPE_STORAGE_BUFFER;
}

VkImageAspectFlags aspect(Format format) {
    return is_depth(format) ? VK_IMAGE_ASPECT_DEPTH_BIT : VK_IMAGE_ASPECT_COLOR_BIT;
}

Sync sync_of(Access access, const ShaderStages& shaders) {
    constexpr VkPipelineStageFlags2 kDepth =
        VK_PIPELINE_STAGE_2_EARLY_FRAGMENT_TESTS_BIT | VK_PIPELINE_STAGE_2_LATE_FRAGMENT_TESTS_BIT;
    constexpr VkAccessFlags2 kStorageWrite = VK_ACCESS_2_SHADER_STORAGE_READ_BIT | VK_ACCESS_2_SHADER_STORAGE_WRITE_BIT;
    Sync out;
    const auto map = [&](Access ours, VkPipelineStageFlags2 stages, VkAccessFlags2 theirs) {
        if (!any(access & ours)) return;
        out.stages |= stages;
        out.access |= theirs;
    };
    map(Access::IndirectRead, VK_PIPELINE_STAGE_2_DRAW_INDIRECT_BIT, VK_ACCESS_2_INDIRECT_COMMAND_READ_BIT);
    map(Access::IndexRead, VK_PIPELINE_STAGE_2_INDEX_INPUT_BIT, VK_ACCESS_2_INDEX_READ_BIT);
    map(Access::VertexRead, VK_PIPELINE_STAGE_2_VERTEX_ATTRIBUTE_INPUT_BIT, VK_ACCESS_2_VERTEX_ATTRIBUTE_READ_BIT);
    map(Access::UniformRead, shaders.graphics | shaders.compute, VK_ACCESS_2_UNIFORM_READ_BIT);
    map(Access::SampledReadGraphics, shaders.graphics, VK_ACCESS_2_SHADER_SAMPLED_READ_BIT);
    map(Access::SampledReadCompute, shaders.compute, VK_ACCESS_2_SHADER_SAMPLED_READ_BIT);
    map(Access::StorageReadGraphics, shaders.graphics, VK_ACCESS_2_SHADER_STORAGE_READ_BIT);
    map(Access::StorageReadCompute, shaders.compute, VK_ACCESS_2_SHADER_STORAGE_READ_BIT);
    map(Access::StorageWriteGraphics, shaders.graphics, kStorageWrite);
    map(Access::StorageWriteCompute, shaders.compute, kStorageWrite);
    map(Access::ColorWrite, VK_PIPELINE_STAGE_2_COLOR_ATTACHMENT_OUTPUT_BIT,
        VK_ACCESS_2_COLOR_ATTACHMENT_READ_BIT | VK_ACCESS_2_COLOR_ATTACHMENT_WRITE_BIT);
    map(Access::DepthRead, kDepth, VK_ACCESS_2_DEPTH_STENCIL_ATTACHMENT_READ_BIT);
    map(Access::DepthWrite, kDepth,
        VK_ACCESS_2_DEPTH_STENCIL_ATTACHMENT_READ_BIT | VK_ACCESS_2_DEPTH_STENCIL_ATTACHMENT_WRITE_BIT);
    map(Access::CopyRead, VK_PIPELINE_STAGE_2_ALL_TRANSFER_BIT, VK_ACCESS_2_TRANSFER_READ_BIT);
    map(Access::CopyWrite, VK_PIPELINE_STAGE_2_ALL_TRANSFER_BIT, VK_ACCESS_2_TRANSFER_WRITE_BIT);
    map(Access::HostRead, VK_PIPELINE_STAGE_2_HOST_BIT, VK_ACCESS_2_HOST_READ_BIT);
    constexpr VkPipelineStageFlags2 kBuild = VK_PIPELINE_STAGE_2_ACCELERATION_STRUCTURE_BUILD_BIT_KHR;
    map(Access::BoxesRead, kBuild, VK_ACCESS_2_SHADER_READ_BIT);
    map(Access::BoxTreeWrite, kBuild | VK_PIPELINE_STAGE_2_ALL_TRANSFER_BIT,
        VK_ACCESS_2_ACCELERATION_STRUCTURE_READ_BIT_KHR | VK_ACCESS_2_ACCELERATION_STRUCTURE_WRITE_BIT_KHR |
            VK_ACCESS_2_TRANSFER_WRITE_BIT);
    map(Access::BoxTreeRead, VK_PIPELINE_STAGE_2_RAY_TRACING_SHADER_BIT_KHR,
        VK_ACCESS_2_ACCELERATION_STRUCTURE_READ_BIT_KHR);
    map(Access::Present, VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT, VK_ACCESS_2_NONE);
    return out;
}

VkImageLayout shader_read_layout(const TextureDesc& desc) {
    if (is_depth(desc.format)) return VK_IMAGE_LAYOUT_DEPTH_STENCIL_READ_ONLY_OPTIMAL;
    if (any(desc.usage & (TextureUsage::Storage | TextureUsage::CopySrc))) return VK_IMAGE_LAYOUT_GENERAL;
    return VK_IMAGE_LAYOUT_SHADER_READ_ONLY_OPTIMAL;
}

VkImageLayout layout_of(Access access, const TextureDesc& desc) {
    if (!any(access)) return VK_IMAGE_LAYOUT_UNDEFINED;
    if (any(access & Access::Present)) return VK_IMAGE_LAYOUT_PRESENT_SRC_KHR;
    if (any(access & Access::ColorWrite)) return VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL;
    if (any(access & Access::DepthWrite)) return VK_IMAGE_LAYOUT_DEPTH_STENCIL_ATTACHMENT_OPTIMAL;
    const VkImageLayout read = shader_read_layout(desc);
    if (access == Access::CopyRead && read != VK_IMAGE_LAYOUT_GENERAL) return VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL;
    if (access == Access::CopyWrite && read != VK_IMAGE_LAYOUT_GENERAL) return VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL;
    return read;
}

std::string name(VkResult result) {
    switch (result) {
    case VK_SUCCESS:
        return "VK_SUCCESS";
    case VK_NOT_READY:
        return "VK_NOT_READY";
    case VK_TIMEOUT:
        return "VK_TIMEOUT";
    case VK_INCOMPLETE:
        return "VK_INCOMPLETE";
    case VK_ERROR_OUT_OF_HOST_MEMORY:
        return "out of host memory";
    case VK_ERROR_OUT_OF_DEVICE_MEMORY:
        return "out of device memory";
    case VK_ERROR_INITIALIZATION_FAILED:
        return "VK_ERROR_INITIALIZATION_FAILED";
    case VK_ERROR_DEVICE_LOST:
        return "the device was lost";
    case VK_ERROR_MEMORY_MAP_FAILED:
        return "VK_ERROR_MEMORY_MAP_FAILED";
    case VK_ERROR_LAYER_NOT_PRESENT:
        return "VK_ERROR_LAYER_NOT_PRESENT";
    case VK_ERROR_EXTENSION_NOT_PRESENT:
        return "VK_ERROR_EXTENSION_NOT_PRESENT";
    case VK_ERROR_FEATURE_NOT_PRESENT:
        return "VK_ERROR_FEATURE_NOT_PRESENT";
    case VK_ERROR_INCOMPATIBLE_DRIVER:
        return "VK_ERROR_INCOMPATIBLE_DRIVER";
    case VK_ERROR_TOO_MANY_OBJECTS:
        return "VK_ERROR_TOO_MANY_OBJECTS";
    case VK_ERROR_FORMAT_NOT_SUPPORTED:
        return "the driver does not support the format so";
    case VK_ERROR_FRAGMENTED_POOL:
        return "VK_ERROR_FRAGMENTED_POOL";
    case VK_ERROR_OUT_OF_POOL_MEMORY:
        return "VK_ERROR_OUT_OF_POOL_MEMORY";
    case VK_ERROR_INVALID_SHADER_NV:
        return "the driver refused the shader";
    default:
        return "VkResult " + std::to_string(int(result));
    }
}

Error failure(std::string_view what, VkResult result) {
    const bool out_of_it = result == VK_ERROR_OUT_OF_HOST_MEMORY || result == VK_ERROR_OUT_OF_DEVICE_MEMORY ||
                           result == VK_ERROR_DEVICE_LOST || result == VK_ERROR_TOO_MANY_OBJECTS;
    return {std::string(what) + ": " + name(result), out_of_it ? ErrorKind::OutOfMemory : ErrorKind::Failed};
}

}  // namespace kiln::rhi::vulkan
