// SPDX-License-Identifier: MIT
#include "rhi/vulkan/device.h"

#include "base/format.h"
#include "rhi/vulkan/commands.h"
#include "rhi/vulkan/pipeline_cache.h"

namespace kiln::rhi::vulkan {

Result<std::unique_ptr<Device>> VulkanDevice::create(std::unique_ptr<Instance> instance, const Adapter& adapter,
                                                     bool use_pipeline_cache) {
    std::unique_ptr<VulkanDevice> out(new VulkanDevice(std::move(instance), adapter));
    if (Result<void> ready = out->init(use_pipeline_cache); !ready) return ready.error();
    return std::unique_ptr<Device>(std::move(out));
}

VulkanDevice::VulkanDevice(std::unique_ptr<Instance> instance, Adapter adapter)
    : instance_(std::move(instance)), adapter_(std::move(adapter)) {
    instance_->report_to(&report_);
}

Result<void> VulkanDevice::init(bool use_pipeline_cache) {
    const VkPhysicalDevice physical = adapter_.physical;
    VkPhysicalDeviceVulkan13Features has13{.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_3_FEATURES};
    VkPhysicalDeviceVulkan12Features has12{.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_2_FEATURES,
                                           .pNext = &has13};
    VkPhysicalDeviceVulkan11Features has11{.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_1_FEATURES,
                                           .pNext = &has12};
    VkPhysicalDeviceFeatures2 has{.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FEATURES_2, .pNext = &has11};
    vkGetPhysicalDeviceFeatures2(physical, &has);

    // Only what the interface can reach, so that validation catches whatever slips past it.
    VkPhysicalDeviceVulkan13Features want13{.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_3_FEATURES};
    want13.dynamicRendering = VK_TRUE;
    want13.synchronization2 = VK_TRUE;
    want13.maintenance4 = has13.maintenance4;
    VkPhysicalDeviceVulkan12Features want12{.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_2_FEATURES,
                                            .pNext = &want13};
    want12.timelineSemaphore = VK_TRUE;
    want12.bufferDeviceAddress = adapter_.info.rt_pipeline;
    want12.scalarBlockLayout = has12.scalarBlockLayout;
    want12.shaderBufferInt64Atomics = has12.shaderBufferInt64Atomics;
    VkPhysicalDeviceVulkan11Features want11{.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_1_FEATURES,
                                            .pNext = &want12};
    want11.shaderDrawParameters = has11.shaderDrawParameters;
    VkPhysicalDeviceFeatures2 want{.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FEATURES_2, .pNext = &want11};
    want.features.shaderStorageImageExtendedFormats = has.features.shaderStorageImageExtendedFormats;
    want.features.shaderInt64 = has.features.shaderInt64;
    want.features.multiDrawIndirect = has.features.multiDrawIndirect;
    want.features.drawIndirectFirstInstance = has.features.drawIndirectFirstInstance;
    want.features.fragmentStoresAndAtomics = has.features.fragmentStoresAndAtomics;
    want.features.vertexPipelineStoresAndAtomics = has.features.vertexPipelineStoresAndAtomics;
    want.features.independentBlend = has.features.independentBlend;
    std::vector<const char*> extensions;
    VkPhysicalDeviceRayTracingPipelineFeaturesKHR rays{
        .sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_RAY_TRACING_PIPELINE_FEATURES_KHR, .rayTracingPipeline = VK_TRUE};
    VkPhysicalDeviceAccelerationStructureFeaturesKHR trees{
        .sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_ACCELERATION_STRUCTURE_FEATURES_KHR,
        .pNext = &rays,
        .accelerationStructure = VK_TRUE};
    VkPhysicalDeviceMeshShaderFeaturesEXT mesh{.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_MESH_SHADER_FEATURES_EXT,
                                               .meshShader = VK_TRUE};
    caps_.rt_pipeline = adapter_.info.rt_pipeline;
    caps_.mesh_shader = adapter_.info.mesh_shader;
    if (caps_.rt_pipeline) {
        extensions.insert(extensions.end(), kTraceExtensions.begin(), kTraceExtensions.end());
        rays.pNext = want.pNext;
        want.pNext = &trees;
        stages_.compute |= VK_PIPELINE_STAGE_2_RAY_TRACING_SHADER_BIT_KHR;
        stages_.push |=
            to_vk(ShaderStage::RayGen | ShaderStage::Miss | ShaderStage::Intersection | ShaderStage::ClosestHit);
    }
    if (caps_.mesh_shader) {
        extensions.insert(extensions.end(), kMeshExtensions.begin(), kMeshExtensions.end());
        mesh.pNext = want.pNext;
        want.pNext = &mesh;
        stages_.graphics |= VK_PIPELINE_STAGE_2_MESH_SHADER_BIT_EXT;
        stages_.push |= to_vk(ShaderStage::Mesh);
    }
    if (instance_->windows().destroy) extensions.push_back(VK_KHR_SWAPCHAIN_EXTENSION_NAME);
    caps_.storage_r16f = has.features.shaderStorageImageExtendedFormats;
    caps_.int64_buffer_atomics = has12.shaderBufferInt64Atomics && has.features.shaderInt64;
    caps_.multi_draw_indirect = has.features.multiDrawIndirect;

    const float priority = 1.0f;
    const VkDeviceQueueCreateInfo queue{.sType = VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO,
                                        .queueFamilyIndex = adapter_.queue_family,
                                        .queueCount = 1,
                                        .pQueuePriorities = &priority};
    const VkDeviceCreateInfo info{.sType = VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO,
                                  .pNext = &want,
                                  .queueCreateInfoCount = 1,
                                  .pQueueCreateInfos = &queue,
                                  .enabledExtensionCount = uint32_t(extensions.size()),
                                  .ppEnabledExtensionNames = extensions.data()};
    if (const VkResult r = vkCreateDevice(physical, &info, nullptr, &device_); r != VK_SUCCESS) {
        Error error = failure("device '" + adapter_.info.name + "'", r);
        error.kind = ErrorKind::NoDevice;
        return error;
    }
    volkLoadDeviceTable(&vk_, device_);
    vk_.vkGetDeviceQueue(device_, adapter_.queue_family, 0, &queue_);
    memory_.init(physical, device_, &vk_, caps_.rt_pipeline);
    uploads_.init(device_, &vk_, &memory_);
    find_caps();

    const VkSemaphoreTypeCreateInfo timeline{.sType = VK_STRUCTURE_TYPE_SEMAPHORE_TYPE_CREATE_INFO,
                                             .semaphoreType = VK_SEMAPHORE_TYPE_TIMELINE};
    const VkSemaphoreCreateInfo semaphore{.sType = VK_STRUCTURE_TYPE_SEMAPHORE_CREATE_INFO, .pNext = &timeline};
    if (const VkResult r = vk_.vkCreateSemaphore(device_, &semaphore, nullptr, &timeline_); r != VK_SUCCESS)
        return failure("timeline semaphore", r);

    std::vector<std::byte> kept;
    if (const std::string folder = cache_folder(); use_pipeline_cache && !folder.empty()) {
        pipeline_cache_path_ = cache_path(folder, adapter_.properties);
        kept = load_cache(pipeline_cache_path_);
    }
    VkPipelineCacheCreateInfo cache{.sType = VK_STRUCTURE_TYPE_PIPELINE_CACHE_CREATE_INFO,
                                    .initialDataSize = kept.size(),
                                    .pInitialData = kept.data()};
    VkResult r = vk_.vkCreatePipelineCache(device_, &cache, nullptr, &pipeline_cache_);
    if (r != VK_SUCCESS && !kept.empty()) {  // the checksum is right but the driver won't have it
        cache.initialDataSize = 0;
        r = vk_.vkCreatePipelineCache(device_, &cache, nullptr, &pipeline_cache_);
    }
    return r == VK_SUCCESS ? Result<void>() : failure("pipeline cache", r);
}

void VulkanDevice::find_caps() {
    const VkPhysicalDevice physical = adapter_.physical;
    const VkPhysicalDeviceLimits& l = adapter_.properties.limits;
    uint32_t count = 0;
    vkGetPhysicalDeviceQueueFamilyProperties(physical, &count, nullptr);
    std::vector<VkQueueFamilyProperties> families(count);
    vkGetPhysicalDeviceQueueFamilyProperties(physical, &count, families.data());
    caps_.timestamp = families[adapter_.queue_family].timestampValidBits > 0;

    const auto can = [&](Format format, VkFormatFeatureFlags wanted) {
        VkFormatProperties p;
        vkGetPhysicalDeviceFormatProperties(physical, to_vk(format), &p);
        return (p.optimalTilingFeatures & wanted) == wanted;
    };
    for (const Format f : {Format::R16Float, Format::R16Uint, Format::Rg16Float, Format::Rg32Uint, Format::R8Snorm,
                           Format::R11g11b10Float})
        caps_.storage_r16f = caps_.storage_r16f && can(f, VK_FORMAT_FEATURE_STORAGE_IMAGE_BIT);
    caps_.float32_filter = can(Format::R32Float, VK_FORMAT_FEATURE_SAMPLED_IMAGE_FILTER_LINEAR_BIT) &&
                           can(Format::Rgba32Float, VK_FORMAT_FEATURE_SAMPLED_IMAGE_FILTER_LINEAR_BIT);

    VkPhysicalDeviceVulkan11Properties p11{.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_1_PROPERTIES};
    VkPhysicalDeviceVulkan13Properties p13{.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_3_PROPERTIES,
                                           .pNext = &p11};
    VkPhysicalDeviceProperties2 properties{.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2, .pNext = &p13};
    VkPhysicalDeviceAccelerationStructurePropertiesKHR trees{
        .sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_ACCELERATION_STRUCTURE_PROPERTIES_KHR};
    trace_limits_ = {.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_RAY_TRACING_PIPELINE_PROPERTIES_KHR, .pNext = &trees};
    if (caps_.rt_pipeline) p11.pNext = &trace_limits_;
    vkGetPhysicalDeviceProperties2(physical, &properties);
    if (caps_.rt_pipeline) {
        trace_limits_.pNext = nullptr;
        scratch_alignment_ = std::max<uint64_t>(1, trees.minAccelerationStructureScratchOffsetAlignment);
        top_bytes_ = tree_bytes(0);
    }
    limits_.timestamp_period_ns = double(l.timestampPeriod);
    limits_.max_storage_binding = l.maxStorageBufferRange;
    limits_.max_buffer =
        p13.maxBufferSize ? std::min(p13.maxBufferSize, p11.maxMemoryAllocationSize) : p11.maxMemoryAllocationSize;
    limits_.max_texture_2d = l.maxImageDimension2D;
    limits_.max_texture_3d = l.maxImageDimension3D;
    limits_.subgroup_size = p11.subgroupSize;
}

VulkanDevice::~VulkanDevice() {
    if (device_) {
        vk_.vkDeviceWaitIdle(device_);
        if (!pipeline_cache_path_.empty() && pipelines_created_ > 0 && !lost_) {
            size_t size = 0;
            vk_.vkGetPipelineCacheData(device_, pipeline_cache_, &size, nullptr);
            std::vector<std::byte> bytes(size);
            if (size > 0 && vk_.vkGetPipelineCacheData(device_, pipeline_cache_, &size, bytes.data()) == VK_SUCCESS)
                save_cache(pipeline_cache_path_, std::span(bytes).first(size));
        }
        // What the user left is destroyed too: live_handle_count() told them; the driver should not have to.
        const auto sweep = [&](auto& map) { map.for_each([&](auto handle, auto&) { destroy(handle); }); };
        sweep(surfaces_);
        sweep(groups_);
        sweep(compute_);
        sweep(render_);
        sweep(traces_);
        sweep(layouts_);
        group_layouts_.for_each(
            [&](BindGroupLayout, GroupLayout& l) { vk_.vkDestroyDescriptorSetLayout(device_, l.vk, nullptr); });
        sweep(shaders_);
        sweep(samplers_);
        views_.for_each([&](ViewHandle h, View& v) {
            if (!v.whole) destroy(h);
        });
        sweep(textures_);
        sweep(buffers_);
        sweep(heaps_);
        sweep(queries_);
        for (const Garbage& g : garbage_) destroy_now(g);
        for (const VkDescriptorPool pool : set_pools_) vk_.vkDestroyDescriptorPool(device_, pool, nullptr);
        for (const Running& r : running_) vk_.vkDestroyCommandPool(device_, r.slot.pool, nullptr);
        for (const CommandSlot& slot : idle_slots_) vk_.vkDestroyCommandPool(device_, slot.pool, nullptr);
        uploads_.shutdown();
        memory_.shutdown();
        vk_.vkDestroyPipelineCache(device_, pipeline_cache_, nullptr);
        vk_.vkDestroySemaphore(device_, timeline_, nullptr);
        vk_.vkDestroyDevice(device_, nullptr);
    }
    instance_.reset();  // ahead of report_, to which it may still have something to say
}

Error VulkanDevice::fail(std::string_view what, VkResult result) {
    if (result == VK_ERROR_DEVICE_LOST) lost_ = true;
    return failure(what, result);
}

SubmitId VulkanDevice::finished() {
    uint64_t value = finished_;
    const VkResult r = vk_.vkGetSemaphoreCounterValue(device_, timeline_, &value);
    if (r == VK_ERROR_DEVICE_LOST) lost_ = true;
    if (r == VK_SUCCESS && value <= last_submit_) finished_ = std::max(finished_, value);
    return finished_;
}

void VulkanDevice::collect() {
    const SubmitId done = finished();
    while (!garbage_.empty() && garbage_.front().after <= done) {
        destroy_now(garbage_.front());
        garbage_.pop_front();
    }
    while (!running_.empty() && running_.front().id <= done) {
        vk_.vkResetCommandPool(device_, running_.front().slot.pool, 0);
        idle_slots_.push_back(running_.front().slot);
        running_.pop_front();
    }
    uploads_.recycle(done);
}

bool VulkanDevice::completed(SubmitId id) { return id <= finished_ || id <= finished(); }

Result<void> VulkanDevice::wait(SubmitId id) {
    if (id > last_submit_) return Error{formatted("wait: submit {} was never made", id)};
    const VkSemaphoreWaitInfo info{
        .sType = VK_STRUCTURE_TYPE_SEMAPHORE_WAIT_INFO, .semaphoreCount = 1, .pSemaphores = &timeline_, .pValues = &id};
    // No time limit of ours: a software device may take a minute; a hung one is reported by its driver as lost.
    if (const VkResult r = vk_.vkWaitSemaphores(device_, &info, UINT64_MAX); r != VK_SUCCESS) return fail("wait", r);
    collect();
    return {};
}

Result<CommandSlot> VulkanDevice::take_slot() {
    if (idle_slots_.empty()) collect();
    CommandSlot slot;
    if (!idle_slots_.empty()) {
        slot = idle_slots_.back();
        idle_slots_.pop_back();
    } else {
        const VkCommandPoolCreateInfo pool{.sType = VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO,
                                           .flags = VK_COMMAND_POOL_CREATE_TRANSIENT_BIT,
                                           .queueFamilyIndex = adapter_.queue_family};
        if (const VkResult r = vk_.vkCreateCommandPool(device_, &pool, nullptr, &slot.pool); r != VK_SUCCESS)
            return fail("command pool", r);
        const VkCommandBufferAllocateInfo buffer{.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO,
                                                 .commandPool = slot.pool,
                                                 .level = VK_COMMAND_BUFFER_LEVEL_PRIMARY,
                                                 .commandBufferCount = 1};
        if (const VkResult r = vk_.vkAllocateCommandBuffers(device_, &buffer, &slot.buffer); r != VK_SUCCESS) {
            vk_.vkDestroyCommandPool(device_, slot.pool, nullptr);
            return fail("command buffer", r);
        }
    }
    const VkCommandBufferBeginInfo begin{.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO,
                                         .flags = VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT};
    if (const VkResult r = vk_.vkBeginCommandBuffer(slot.buffer, &begin); r != VK_SUCCESS) {
        idle_slots_.push_back(slot);
        return fail("command buffer", r);
    }
    return slot;
}

void VulkanDevice::give_back(CommandSlot slot) {
    --open_encoders_;
    if (!slot.pool) return;
    vk_.vkResetCommandPool(device_, slot.pool, 0);
    idle_slots_.push_back(slot);
}

std::unique_ptr<CommandEncoder> VulkanDevice::create_encoder(std::string_view text) {
    Result<CommandSlot> slot = take_slot();
    ++open_encoders_;
    auto out = std::make_unique<VulkanEncoder>(*this, slot ? *slot : CommandSlot{}, text);
    if (!slot) out->fail(slot.error());
    return out;
}

Result<SubmitId> VulkanDevice::submit(std::unique_ptr<CommandEncoder> encoder) {
    auto* own = dynamic_cast<VulkanEncoder*>(encoder.get());
    if (!own) return Error{"submit: not an encoder of this device"};
    collect();
    Result<CommandSlot> main = own->finish();
    if (!main) return main.error();  // the encoder gives its slot back
    std::vector<CommandSlot> slots;
    if (!uploads_.empty()) {
        Result<CommandSlot> slot = take_slot();
        if (!slot) return slot.error();
        uploads_.record(slot->buffer, last_submit_ + 1);
        slots.push_back(*slot);
        if (const VkResult r = vk_.vkEndCommandBuffer(slot->buffer); r != VK_SUCCESS) return fail("uploads", r);
    }
    slots.push_back(*main);
    own->release();
    --open_encoders_;

    VkCommandBufferSubmitInfo commands[2];
    for (size_t i = 0; i < slots.size(); ++i)
        commands[i] = {.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_SUBMIT_INFO, .commandBuffer = slots[i].buffer};
    const VkSemaphoreSubmitInfo signal{.sType = VK_STRUCTURE_TYPE_SEMAPHORE_SUBMIT_INFO,
                                       .semaphore = timeline_,
                                       .value = last_submit_ + 1,
                                       .stageMask = VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT};
    std::vector<VkSemaphoreSubmitInfo> waits;
    for (const VkSemaphore arrival : arrivals_)
        waits.push_back({.sType = VK_STRUCTURE_TYPE_SEMAPHORE_SUBMIT_INFO,
                         .semaphore = arrival,
                         .stageMask = VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT});
    const VkSubmitInfo2 info{.sType = VK_STRUCTURE_TYPE_SUBMIT_INFO_2,
                             .waitSemaphoreInfoCount = uint32_t(waits.size()),
                             .pWaitSemaphoreInfos = waits.data(),
                             .commandBufferInfoCount = uint32_t(slots.size()),
                             .pCommandBufferInfos = commands,
                             .signalSemaphoreInfoCount = 1,
                             .pSignalSemaphoreInfos = &signal};
    const VkResult r = vk_.vkQueueSubmit2(queue_, 1, &info, VK_NULL_HANDLE);
    if (r != VK_SUCCESS) {
        for (const CommandSlot& slot : slots) {
            vk_.vkResetCommandPool(device_, slot.pool, 0);
            idle_slots_.push_back(slot);
        }
        return fail("submit", r);
    }
    arrivals_.clear();
    ++last_submit_;
    for (const CommandSlot& slot : slots) running_.push_back({last_submit_, slot});
    return last_submit_;
}

Result<void> VulkanDevice::write_buffer(BufferHandle buffer, uint64_t offset, std::span<const std::byte> bytes) {
    const Buffer* b = find(buffer);
    if (!b) return Error{"write_buffer: stale buffer handle"};
    if (offset > b->desc.size || bytes.size() > b->desc.size - offset)
        return Error{formatted("write_buffer: {} B at {} go past the end of '{}' ({} B)", bytes.size(), offset,
                               b->label, b->desc.size)};
    return uploads_.to_buffer(b->vk, offset, bytes);
}

Result<void> VulkanDevice::write_texture(const TextureWrite& write, std::span<const std::byte> bytes) {
    const Texture* t = find(write.place.texture);
    if (!t) return Error{"write_texture: stale texture handle"};
    const RowLayout rows = row_layout(t->desc.format, write.size, write.bytes_per_row, write.rows_per_layer);
    if (rows.total_bytes == 0) return {};
    if (bytes.size() < rows.total_bytes)
        return Error{formatted("write_texture: '{}' needs {} B, got {}", t->label, rows.total_bytes, bytes.size())};
    Uploads::ImageTarget target{.image = t->vk, .region = image_region(t->desc, write.place, write.size)};
    target.region.bufferRowLength = write.bytes_per_row / bytes_per_texel(t->desc.format);
    target.region.bufferImageHeight = write.rows_per_layer;
    target.before = sync_of(write.before, stages_);
    target.after = sync_of(write.after, stages_);
    target.layout_before = layout_of(write.before, t->desc);
    target.layout_after = layout_of(write.after, t->desc);
    return uploads_.to_image(target, bytes.first(rows.total_bytes));
}

Result<std::span<std::byte>> VulkanDevice::map(BufferHandle buffer) {
    const Buffer* b = find(buffer);
    if (!b) return Error{"map: stale buffer handle"};
    if (!b->memory.mapped) return Error{formatted("map: '{}' is in device memory", b->label)};
    return std::span(b->memory.mapped, b->desc.size);
}

void VulkanDevice::set_label(VkObjectType type, uint64_t object, std::string_view text) {
    if (!instance_->debug() || text.empty()) return;
    const std::string terminated(text);
    const VkDebugUtilsObjectNameInfoEXT info{.sType = VK_STRUCTURE_TYPE_DEBUG_UTILS_OBJECT_NAME_INFO_EXT,
                                             .objectType = type,
                                             .objectHandle = object,
                                             .pObjectName = terminated.c_str()};
    instance_->set_name(device_, &info);
}

MemoryStats VulkanDevice::memory_stats() const {
    MemoryStats out = memory_.stats();
    out.resources = buffers_.size() + textures_.size();
    return out;
}

uint32_t VulkanDevice::live_handle_count() const {
    uint32_t count = heaps_.size() + buffers_.size() + textures_.size() + samplers_.size() + shaders_.size() +
                     groups_.size() + layouts_.size() + compute_.size() + render_.size() + traces_.size() +
                     queries_.size() + surfaces_.size();
    views_.for_each([&](ViewHandle, const View& v) { count += v.whole ? 0 : 1; });
    group_layouts_.for_each([&](BindGroupLayout, const GroupLayout& l) { count += l.owned ? 0 : 1; });
    return count;
}

std::string VulkanDevice::live_handles() const {
    std::string out;
    const auto list = [&](const auto& map, std::string_view kind) {
        map.for_each([&](auto, const auto& object) { out += formatted("{} '{}'\n", kind, object.label); });
    };
    list(heaps_, "heap");
    list(buffers_, "buffer");
    list(textures_, "texture");
    views_.for_each([&](ViewHandle, const View& v) {
        if (!v.whole) out += formatted("view '{}'\n", v.label);
    });
    list(samplers_, "sampler");
    list(shaders_, "shader module");
    group_layouts_.for_each([&](BindGroupLayout, const GroupLayout& l) {
        if (!l.owned) out += formatted("bind group layout '{}'\n", l.label);
    });
    list(groups_, "bind group");
    list(layouts_, "pipeline layout");
    list(compute_, "compute pipeline");
    list(render_, "render pipeline");
    list(traces_, "trace pipeline");
    list(queries_, "query set");
    list(surfaces_, "surface");
    return out;
}

}  // namespace kiln::rhi::vulkan
