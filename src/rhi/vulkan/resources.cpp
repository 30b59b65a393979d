// SPDX-License-Identifier: MIT
// Heaps, buffers, textures, views, samplers, query sets: making and unmaking them.
#include "rhi/vulkan/device.h"

#include "base/format.h"

namespace kiln::rhi::vulkan {

namespace {

std::string quoted(std::string_view kind, std::string_view label) { return formatted("{} '{}'", kind, label); }

VkImageViewType view_type(const TextureDesc& texture, const ViewDesc& view) {
    switch (texture.dimension) {
    case Dimension::D1:
        return VK_IMAGE_VIEW_TYPE_1D;
    case Dimension::D3:
        return VK_IMAGE_VIEW_TYPE_3D;
    case Dimension::D2:
        return VK_IMAGE_VIEW_TYPE_2D;
    case Dimension::D2Array:
        return view.range.layer_count > 1 || view.as_array ? VK_IMAGE_VIEW_TYPE_2D_ARRAY : VK_IMAGE_VIEW_TYPE_2D;
    }
    return VK_IMAGE_VIEW_TYPE_2D;
}

VkBufferCreateInfo buffer_info(const BufferDesc& desc) {
    return {.sType = VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO,
            .size = desc.size,
            // write_buffer may fill any buffer of device memory.
            .usage = to_vk(desc.usage) |
                     VkBufferUsageFlags(desc.memory == MemoryKind::Device ? VK_BUFFER_USAGE_TRANSFER_DST_BIT : 0)};
}

}  // namespace

Result<HeapHandle> VulkanDevice::create_heap(const HeapDesc& desc) {
    // Whole granules: what the heap holds never shares one with the images around it.
    const uint64_t granule = std::max<uint64_t>(memory_.granularity(), 64 << 10);
    VkMemoryRequirements need{
        .size = (desc.size + granule - 1) / granule * granule, .alignment = granule, .memoryTypeBits = 0};
    // Types that a plain buffer and a plain image both take; measured on small ones.
    Result<VkBuffer> buffer =
        make_buffer({.size = 1024, .usage = BufferUsage::Storage | BufferUsage::CopySrc | BufferUsage::CopyDst});
    if (!buffer) return buffer.error();
    VkMemoryRequirements of_buffer;
    vk_.vkGetBufferMemoryRequirements(device_, *buffer, &of_buffer);
    vk_.vkDestroyBuffer(device_, *buffer, nullptr);
    const VkImageCreateInfo image_create = image_info({.format = Format::Rgba16Float, .size = {16, 16}});
    VkImage image = VK_NULL_HANDLE;
    if (const VkResult r = vk_.vkCreateImage(device_, &image_create, nullptr, &image); r != VK_SUCCESS)
        return fail(quoted("heap", desc.label), r);
    VkMemoryRequirements of_image;
    vk_.vkGetImageMemoryRequirements(device_, image, &of_image);
    vk_.vkDestroyImage(device_, image, nullptr);
    need.memoryTypeBits = of_buffer.memoryTypeBits & of_image.memoryTypeBits;

    Result<Allocation> memory = memory_.allocate(need, MemoryKind::Device, true, quoted("heap", desc.label));
    if (!memory) return memory.error();
    return heaps_.insert({std::string(desc.label), *memory, 1u << memory->block->type});
}

Result<VkBuffer> VulkanDevice::make_buffer(const BufferDesc& desc) {
    const VkBufferCreateInfo info = buffer_info(desc);
    VkBuffer out = VK_NULL_HANDLE;
    if (const VkResult r = vk_.vkCreateBuffer(device_, &info, nullptr, &out); r != VK_SUCCESS)
        return fail(quoted("buffer", desc.label), r);
    return out;
}

Result<BufferHandle> VulkanDevice::create_buffer(const BufferDesc& desc) {
    if (desc.size == 0) return Error{quoted("buffer", desc.label) + ": size 0"};
    if (any(desc.usage & BufferUsage::BoxTree) && desc.size < box_tree_bytes(1))
        return Error{
            formatted("buffer '{}': {} B, the least box tree takes {}", desc.label, desc.size, box_tree_bytes(1))};
    if (desc.size > limits_.max_buffer)
        return Error{formatted("buffer '{}': {} B, the device allows {}", desc.label, desc.size, limits_.max_buffer),
                     ErrorKind::OutOfMemory};
    Result<VkBuffer> vk = make_buffer(desc);
    if (!vk) return vk.error();
    Buffer b{std::string(desc.label), desc, *vk, {}};
    b.desc.label = {};
    VkMemoryRequirements need;
    vk_.vkGetBufferMemoryRequirements(device_, *vk, &need);
    VkResult bound = VK_SUCCESS;
    Error error;
    if (desc.heap) {
        const Heap* heap = found(heaps_.get(desc.heap), "heap");
        if (!heap || !(heap->type_bits & need.memoryTypeBits) || desc.heap_offset % need.alignment != 0 ||
            desc.heap_offset + need.size > heap->memory.size) {
            vk_.vkDestroyBuffer(device_, *vk, nullptr);
            return Error{quoted("buffer", desc.label) + ": does not fit its heap"};
        }
        bound = vk_.vkBindBufferMemory(device_, *vk, heap->memory.memory, heap->memory.offset + desc.heap_offset);
    } else {
        Result<Allocation> memory = memory_.allocate(need, desc.memory, false, quoted("buffer", desc.label));
        if (!memory) {
            vk_.vkDestroyBuffer(device_, *vk, nullptr);
            return memory.error();
        }
        b.memory = *memory;
        bound = vk_.vkBindBufferMemory(device_, *vk, memory->memory, memory->offset);
    }
    if (bound != VK_SUCCESS) {
        vk_.vkDestroyBuffer(device_, *vk, nullptr);
        memory_.release(b.memory);
        return fail(quoted("buffer", desc.label), bound);
    }
    label(VK_OBJECT_TYPE_BUFFER, *vk, b.label);
    if (any(desc.usage & BufferUsage::BoxTree)) {
        Result<VkAccelerationStructureKHR> top = make_tree(*vk, 0, top_bytes_.tree, true);
        if (!top) {
            vk_.vkDestroyBuffer(device_, *vk, nullptr);
            memory_.release(b.memory);
            return top.error();
        }
        b.top = *top;
    }
    return buffers_.insert(std::move(b));
}

VkImageCreateInfo VulkanDevice::image_info(const TextureDesc& desc) const {
    const bool volume = desc.dimension == Dimension::D3;
    return {.sType = VK_STRUCTURE_TYPE_IMAGE_CREATE_INFO,
            .imageType = desc.dimension == Dimension::D1 ? VK_IMAGE_TYPE_1D
                         : volume                        ? VK_IMAGE_TYPE_3D
                                                         : VK_IMAGE_TYPE_2D,
            .format = to_vk(desc.format),
            .extent = {desc.size.width, desc.size.height, volume ? desc.size.depth : 1},
            .mipLevels = desc.mips,
            .arrayLayers = layer_count(desc),
            .samples = VK_SAMPLE_COUNT_1_BIT,
            .tiling = VK_IMAGE_TILING_OPTIMAL,
            .usage = to_vk(desc.usage),
            .initialLayout = VK_IMAGE_LAYOUT_UNDEFINED};
}

Result<TextureHandle> VulkanDevice::create_texture(const TextureDesc& desc) {
    const std::string what = quoted("texture", desc.label);
    const VkImageCreateInfo info = image_info(desc);
    VkImageFormatProperties can{};
    VkResult r = vkGetPhysicalDeviceImageFormatProperties(adapter_.physical, info.format, info.imageType, info.tiling,
                                                          info.usage, 0, &can);
    if (r != VK_SUCCESS) return fail(formatted("texture '{}' of {}", desc.label, name(desc.format)), r);
    // Some drivers report more for volumes here than they can do.
    const uint32_t most = desc.dimension == Dimension::D3 ? limits_.max_texture_3d : limits_.max_texture_2d;
    const uint32_t largest = std::max({info.extent.width, info.extent.height, info.extent.depth});
    if (largest == 0 ||
        std::min({info.extent.width, info.extent.height, info.extent.depth, info.arrayLayers, desc.mips}) == 0 ||
        largest > most || info.extent.width > can.maxExtent.width || info.extent.height > can.maxExtent.height ||
        info.extent.depth > can.maxExtent.depth || info.arrayLayers > can.maxArrayLayers ||
        desc.mips > full_mip_count(desc))
        return Error{formatted("texture '{}': {}x{}x{} with {} mips is not possible here (at most {} along an edge)",
                               desc.label, desc.size.width, desc.size.height, desc.size.depth, desc.mips, most)};

    VkImage vk = VK_NULL_HANDLE;
    if (r = vk_.vkCreateImage(device_, &info, nullptr, &vk); r != VK_SUCCESS) return fail(what, r);
    Texture t{std::string(desc.label), desc, vk, {}, {}};
    t.desc.label = {};
    VkMemoryRequirements need;
    vk_.vkGetImageMemoryRequirements(device_, vk, &need);
    if (desc.heap) {
        const Heap* heap = found(heaps_.get(desc.heap), "heap");
        if (!heap || !(heap->type_bits & need.memoryTypeBits) || desc.heap_offset % need.alignment != 0 ||
            desc.heap_offset + need.size > heap->memory.size) {
            vk_.vkDestroyImage(device_, vk, nullptr);
            return Error{what + ": does not fit its heap"};
        }
        r = vk_.vkBindImageMemory(device_, vk, heap->memory.memory, heap->memory.offset + desc.heap_offset);
    } else {
        Result<Allocation> memory = memory_.allocate(need, MemoryKind::Device, true, what);
        if (!memory) {
            vk_.vkDestroyImage(device_, vk, nullptr);
            return memory.error();
        }
        t.memory = *memory;
        r = vk_.vkBindImageMemory(device_, vk, memory->memory, memory->offset);
    }
    if (r != VK_SUCCESS) {
        vk_.vkDestroyImage(device_, vk, nullptr);
        memory_.release(t.memory);
        return fail(what, r);
    }
    label(VK_OBJECT_TYPE_IMAGE, vk, t.label);

    const Allocation memory = t.memory;
    const TextureHandle handle = textures_.insert(std::move(t));
    Texture& made = *textures_.get(handle);
    // An image that is only copied can't be looked at.
    constexpr TextureUsage kViewable =
        TextureUsage::Sampled | TextureUsage::Storage | TextureUsage::Color | TextureUsage::Depth;
    if (any(desc.usage & kViewable)) {
        const ViewDesc view{.texture = handle, .range = resolved(desc, {}), .as_array = true};
        Result<VkImageView> whole = make_view(made, view);
        if (!whole) {
            vk_.vkDestroyImage(device_, vk, nullptr);
            memory_.release(memory);
            textures_.remove(handle);
            return whole.error();
        }
        made.whole = views_.insert({made.label, view, made.desc, *whole, true});
    }
    return handle;
}

Result<VkImageView> VulkanDevice::make_view(const Texture& texture, const ViewDesc& desc) {
    const VkImageViewCreateInfo info{
        .sType = VK_STRUCTURE_TYPE_IMAGE_VIEW_CREATE_INFO,
        .image = texture.vk,
        .viewType = view_type(texture.desc, desc),
        .format = to_vk(texture.desc.format),
        .subresourceRange = {aspect(texture.desc.format), desc.range.base_mip, desc.range.mip_count,
                             desc.range.base_layer, desc.range.layer_count}};
    VkImageView out = VK_NULL_HANDLE;
    if (const VkResult r = vk_.vkCreateImageView(device_, &info, nullptr, &out); r != VK_SUCCESS)
        return fail(quoted("view of texture", texture.label), r);
    return out;
}

Result<ViewHandle> VulkanDevice::create_view(const ViewDesc& desc) {
    const Texture* t = find(desc.texture);
    if (!t) return Error{quoted("view", desc.label) + ": stale texture handle"};
    ViewDesc full = desc;
    full.label = {};
    full.range = resolved(t->desc, desc.range);
    const Subresources& r = full.range;
    if (r.mip_count == 0 || r.layer_count == 0 || r.base_mip + r.mip_count > t->desc.mips ||
        r.base_layer + r.layer_count > layer_count(t->desc))
        return Error{formatted("view '{}': beyond the mips or layers of texture '{}'", desc.label, t->label)};
    Result<VkImageView> vk = make_view(*t, full);
    if (!vk) return vk.error();
    label(VK_OBJECT_TYPE_IMAGE_VIEW, *vk, desc.label);
    return views_.insert({std::string(desc.label), full, t->desc, *vk, false});
}

Result<SamplerHandle> VulkanDevice::create_sampler(const SamplerDesc& desc) {
    const auto filter = [](Filter f) { return f == Filter::Linear ? VK_FILTER_LINEAR : VK_FILTER_NEAREST; };
    const VkSamplerAddressMode address = desc.address == AddressMode::Repeat ? VK_SAMPLER_ADDRESS_MODE_REPEAT
                                         : desc.address == AddressMode::MirrorRepeat
                                             ? VK_SAMPLER_ADDRESS_MODE_MIRRORED_REPEAT
                                             : VK_SAMPLER_ADDRESS_MODE_CLAMP_TO_EDGE;
    const VkSamplerCreateInfo info{
        .sType = VK_STRUCTURE_TYPE_SAMPLER_CREATE_INFO,
        .magFilter = filter(desc.mag),
        .minFilter = filter(desc.min),
        .mipmapMode = desc.mip == Filter::Linear ? VK_SAMPLER_MIPMAP_MODE_LINEAR : VK_SAMPLER_MIPMAP_MODE_NEAREST,
        .addressModeU = address,
        .addressModeV = address,
        .addressModeW = address,
        .compareEnable = desc.compare != Compare::Never,
        .compareOp = to_vk(desc.compare),
        .minLod = desc.lod_min,
        .maxLod = desc.lod_max};
    VkSampler vk = VK_NULL_HANDLE;
    if (const VkResult r = vk_.vkCreateSampler(device_, &info, nullptr, &vk); r != VK_SUCCESS)
        return fail(quoted("sampler", desc.label), r);
    label(VK_OBJECT_TYPE_SAMPLER, vk, desc.label);
    return samplers_.insert({std::string(desc.label), vk});
}

Result<QuerySet> VulkanDevice::create_query_set(const QuerySetDesc& desc) {
    if (!caps_.timestamp) return Error{quoted("query set", desc.label) + ": the device has no timestamps"};
    const VkQueryPoolCreateInfo info{.sType = VK_STRUCTURE_TYPE_QUERY_POOL_CREATE_INFO,
                                     .queryType = VK_QUERY_TYPE_TIMESTAMP,
                                     .queryCount = desc.count};
    VkQueryPool vk = VK_NULL_HANDLE;
    if (const VkResult r = vk_.vkCreateQueryPool(device_, &info, nullptr, &vk); r != VK_SUCCESS)
        return fail(quoted("query set", desc.label), r);
    label(VK_OBJECT_TYPE_QUERY_POOL, vk, desc.label);
    return queries_.insert({std::string(desc.label), vk, desc.count});
}

MemoryNeed VulkanDevice::memory_need(const BufferDesc& desc) {
    const VkBufferCreateInfo info = buffer_info(desc);
    Result<VkBuffer> vk = make_buffer(desc);
    if (!vk) return {info.size, 256};
    VkMemoryRequirements need;
    vk_.vkGetBufferMemoryRequirements(device_, *vk, &need);
    vk_.vkDestroyBuffer(device_, *vk, nullptr);
    const uint64_t alignment = std::max(need.alignment, memory_.granularity());
    return {(need.size + alignment - 1) / alignment * alignment, alignment};
}

MemoryNeed VulkanDevice::memory_need(const TextureDesc& desc) {
    const VkImageCreateInfo info = image_info(desc);
    VkImage vk = VK_NULL_HANDLE;
    if (vk_.vkCreateImage(device_, &info, nullptr, &vk) != VK_SUCCESS) return {};
    VkMemoryRequirements need;
    vk_.vkGetImageMemoryRequirements(device_, vk, &need);
    vk_.vkDestroyImage(device_, vk, nullptr);
    const uint64_t alignment = std::max(need.alignment, memory_.granularity());
    return {(need.size + alignment - 1) / alignment * alignment, alignment};
}

ViewHandle VulkanDevice::whole_view(TextureHandle texture) {
    const Texture* t = find(texture);
    return t ? t->whole : ViewHandle{};
}

BufferDesc VulkanDevice::desc(BufferHandle buffer) {
    const Buffer* b = find(buffer);
    return b ? b->desc : BufferDesc{};
}

TextureDesc VulkanDevice::desc(TextureHandle texture) {
    const Texture* t = find(texture);
    return t ? t->desc : TextureDesc{};
}

ViewDesc VulkanDevice::desc(ViewHandle view) {
    const View* v = find(view);
    return v ? v->desc : ViewDesc{};
}

// ---- the end of them

void VulkanDevice::destroy(HeapHandle handle) {
    if (auto h = take(heaps_, handle, "heap"))
        retire(VK_OBJECT_TYPE_DEVICE_MEMORY, VkDeviceMemory(VK_NULL_HANDLE), h->memory);
}

void VulkanDevice::destroy(BufferHandle handle) {
    auto b = take(buffers_, handle, "buffer");
    if (!b) return;
    for (const VkAccelerationStructureKHR tree : {b->top, b->bottom})
        if (tree) retire(VK_OBJECT_TYPE_ACCELERATION_STRUCTURE_KHR, tree);
    retire(VK_OBJECT_TYPE_BUFFER, b->vk, b->memory);
}

void VulkanDevice::destroy(TextureHandle handle) {
    if (const Texture* t = textures_.get(handle); t && t->shown)
        return report_("destroy: the texture of surface '" + t->label + "' is its own; present it");
    auto t = take(textures_, handle, "texture");
    if (!t) return;
    if (t->whole)
        if (auto v = views_.remove(t->whole)) retire(VK_OBJECT_TYPE_IMAGE_VIEW, v->vk);
    retire(VK_OBJECT_TYPE_IMAGE, t->vk, t->memory);
}

void VulkanDevice::destroy(ViewHandle handle) {
    if (const View* v = views_.get(handle); v && v->whole)
        return report_("destroy: '" + v->label + "' is the view that its texture owns");
    if (auto v = take(views_, handle, "view")) retire(VK_OBJECT_TYPE_IMAGE_VIEW, v->vk);
}

void VulkanDevice::destroy(SamplerHandle handle) {
    if (auto s = take(samplers_, handle, "sampler")) retire(VK_OBJECT_TYPE_SAMPLER, s->vk);
}

void VulkanDevice::destroy(QuerySet handle) {
    if (auto q = take(queries_, handle, "query set")) retire(VK_OBJECT_TYPE_QUERY_POOL, q->vk);
}

void VulkanDevice::destroy_now(const Garbage& g) {
    switch (g.type) {
    case VK_OBJECT_TYPE_BUFFER:
        vk_.vkDestroyBuffer(device_, VkBuffer(g.object), nullptr);
        break;
    case VK_OBJECT_TYPE_IMAGE:
        vk_.vkDestroyImage(device_, VkImage(g.object), nullptr);
        break;
    case VK_OBJECT_TYPE_IMAGE_VIEW:
        vk_.vkDestroyImageView(device_, VkImageView(g.object), nullptr);
        break;
    case VK_OBJECT_TYPE_SAMPLER:
        vk_.vkDestroySampler(device_, VkSampler(g.object), nullptr);
        break;
    case VK_OBJECT_TYPE_PIPELINE:
        vk_.vkDestroyPipeline(device_, VkPipeline(g.object), nullptr);
        break;
    case VK_OBJECT_TYPE_PIPELINE_LAYOUT:
        vk_.vkDestroyPipelineLayout(device_, VkPipelineLayout(g.object), nullptr);
        break;
    case VK_OBJECT_TYPE_DESCRIPTOR_SET_LAYOUT:
        vk_.vkDestroyDescriptorSetLayout(device_, VkDescriptorSetLayout(g.object), nullptr);
        break;
    case VK_OBJECT_TYPE_DESCRIPTOR_SET: {
        const VkDescriptorSet set = VkDescriptorSet(g.object);
        vk_.vkFreeDescriptorSets(device_, g.pool, 1, &set);
        break;
    }
    case VK_OBJECT_TYPE_ACCELERATION_STRUCTURE_KHR:
        vk_.vkDestroyAccelerationStructureKHR(device_, VkAccelerationStructureKHR(g.object), nullptr);
        break;
    case VK_OBJECT_TYPE_QUERY_POOL:
        vk_.vkDestroyQueryPool(device_, VkQueryPool(g.object), nullptr);
        break;
    default:
        break;  // memory alone
    }
    memory_.release(g.memory);
}

}  // namespace kiln::rhi::vulkan
