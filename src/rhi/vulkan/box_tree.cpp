// SPDX-License-Identifier: MIT
// Box trees and the pipelines that trace rays through them (VK_KHR_acceleration_structure, VK_KHR_ray_tracing_pipeline).
// Vulkan wants two levels: a tree of boxes (bottom) under a tree of instances (top). Ours has one instance with the identity as its
// transform, so both, the record of the instance and the room that building needs lie in the one buffer of usage BoxTree:
//     0              the top tree; its size does not depend on the boxes, so that descriptors may name it for good
//     record_at      VkAccelerationStructureInstanceKHR
//     bottom_at      the bottom tree
//     after it       scratch
#include "rhi/vulkan/device.h"

#include "base/format.h"

#include <algorithm>
#include <cstring>

namespace kiln::rhi::vulkan {

namespace {

constexpr uint64_t kTreeAlignment = 256;  // of a tree's offset in its buffer, by the specification

uint64_t round_up(uint64_t n, uint64_t to) { return (n + to - 1) / to * to; }

// One geometry, and the description of a build of it.
struct Build {
    Build(VkDeviceAddress data, bool top) {
        geometry.flags = VK_GEOMETRY_OPAQUE_BIT_KHR;
        if (top) {
            geometry.geometryType = VK_GEOMETRY_TYPE_INSTANCES_KHR;
            geometry.geometry.instances = {
                .sType = VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_GEOMETRY_INSTANCES_DATA_KHR,
                .data = {.deviceAddress = data}};
        } else {
            geometry.geometryType = VK_GEOMETRY_TYPE_AABBS_KHR;
            geometry.geometry.aabbs = {.sType = VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_GEOMETRY_AABBS_DATA_KHR,
                                       .data = {.deviceAddress = data},
                                       .stride = sizeof(Box)};
        }
        info.type =
            top ? VK_ACCELERATION_STRUCTURE_TYPE_TOP_LEVEL_KHR : VK_ACCELERATION_STRUCTURE_TYPE_BOTTOM_LEVEL_KHR;
        info.flags = VK_BUILD_ACCELERATION_STRUCTURE_PREFER_FAST_TRACE_BIT_KHR;
        info.mode = VK_BUILD_ACCELERATION_STRUCTURE_MODE_BUILD_KHR;
        info.geometryCount = 1;
        info.pGeometries = &geometry;
    }
    Build(const Build&) = delete;
    Build& operator=(const Build&) = delete;

    VkAccelerationStructureGeometryKHR geometry{.sType = VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_GEOMETRY_KHR};
    VkAccelerationStructureBuildGeometryInfoKHR info{
        .sType = VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_BUILD_GEOMETRY_INFO_KHR};
};

static_assert(sizeof(Box) == sizeof(VkAabbPositionsKHR));

}  // namespace

VulkanDevice::TreeBytes VulkanDevice::tree_bytes(uint32_t boxes) const {
    const Build build(0, boxes == 0);
    const uint32_t count = std::max(boxes, 1u);
    VkAccelerationStructureBuildSizesInfoKHR sizes{.sType =
                                                       VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_BUILD_SIZES_INFO_KHR};
    vk_.vkGetAccelerationStructureBuildSizesKHR(device_, VK_ACCELERATION_STRUCTURE_BUILD_TYPE_DEVICE_KHR, &build.info,
                                                &count, &sizes);
    return {sizes.accelerationStructureSize, sizes.buildScratchSize};
}

uint64_t VulkanDevice::box_tree_bytes(uint32_t boxes) {
    if (!caps_.rt_pipeline) return 0;
    const TreeBytes bottom = tree_bytes(std::max(boxes, 1u));
    const uint64_t bottom_at = round_up(top_bytes_.tree, kTreeAlignment) + kTreeAlignment;
    return bottom_at + round_up(bottom.tree, kTreeAlignment) + scratch_alignment_ +
           std::max(bottom.scratch, top_bytes_.scratch);
}

VkDeviceAddress VulkanDevice::address(VkBuffer buffer) const {
    const VkBufferDeviceAddressInfo info{.sType = VK_STRUCTURE_TYPE_BUFFER_DEVICE_ADDRESS_INFO, .buffer = buffer};
    return vk_.vkGetBufferDeviceAddress(device_, &info);
}

Result<VkAccelerationStructureKHR> VulkanDevice::make_tree(VkBuffer buffer, uint64_t offset, uint64_t bytes, bool top) {
    const VkAccelerationStructureCreateInfoKHR info{
        .sType = VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_CREATE_INFO_KHR,
        .buffer = buffer,
        .offset = offset,
        .size = bytes,
        .type = top ? VK_ACCELERATION_STRUCTURE_TYPE_TOP_LEVEL_KHR : VK_ACCELERATION_STRUCTURE_TYPE_BOTTOM_LEVEL_KHR};
    VkAccelerationStructureKHR out = VK_NULL_HANDLE;
    if (const VkResult r = vk_.vkCreateAccelerationStructureKHR(device_, &info, nullptr, &out); r != VK_SUCCESS)
        return fail("box tree", r);
    return out;
}

Result<void> VulkanDevice::record_box_tree(VkCommandBuffer cmd, Buffer& tree, const Buffer& boxes, uint64_t offset,
                                           uint32_t count) {
    if (!tree.top || count == 0 || tree.desc.size < box_tree_bytes(count))
        return Error{formatted("build_box_tree: '{}' has no room for {} boxes", tree.label, count)};
    const uint64_t record_at = round_up(top_bytes_.tree, kTreeAlignment);
    const uint64_t bottom_at = record_at + kTreeAlignment;
    const uint64_t bottom_bytes = tree_bytes(count).tree;
    Result<VkAccelerationStructureKHR> bottom = make_tree(tree.vk, bottom_at, bottom_bytes, false);
    if (!bottom) return bottom.error();
    if (tree.bottom) retire(VK_OBJECT_TYPE_ACCELERATION_STRUCTURE_KHR, tree.bottom);
    tree.bottom = *bottom;

    const VkDeviceAddress base = address(tree.vk);
    const VkDeviceAddress scratch =
        round_up(base + bottom_at + round_up(bottom_bytes, kTreeAlignment), scratch_alignment_);
    const VkAccelerationStructureDeviceAddressInfoKHR at{
        .sType = VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_DEVICE_ADDRESS_INFO_KHR, .accelerationStructure = *bottom};
    VkAccelerationStructureInstanceKHR record{};
    for (int row = 0; row < 3; ++row) record.transform.matrix[row][row] = 1.0f;
    record.mask = 0xff;
    record.accelerationStructureReference = vk_.vkGetAccelerationStructureDeviceAddressKHR(device_, &at);
    vk_.vkCmdUpdateBuffer(cmd, tree.vk, record_at, sizeof record, &record);

    const auto build = [&](VkDeviceAddress data, VkAccelerationStructureKHR to, uint32_t n, bool top) {
        Build b(data, top);
        b.info.dstAccelerationStructure = to;
        b.info.scratchData.deviceAddress = scratch;
        const VkAccelerationStructureBuildRangeInfoKHR range{.primitiveCount = n};
        const VkAccelerationStructureBuildRangeInfoKHR* const ranges[] = {&range};
        vk_.vkCmdBuildAccelerationStructuresKHR(cmd, 1, &b.info, ranges);
    };
    build(address(boxes.vk) + offset, *bottom, count, false);
    // Within the command: the top tree reads the bottom one and the record, in the same scratch.
    constexpr VkAccessFlags2 kTree =
        VK_ACCESS_2_ACCELERATION_STRUCTURE_READ_BIT_KHR | VK_ACCESS_2_ACCELERATION_STRUCTURE_WRITE_BIT_KHR;
    const VkMemoryBarrier2 between{
        .sType = VK_STRUCTURE_TYPE_MEMORY_BARRIER_2,
        .srcStageMask = VK_PIPELINE_STAGE_2_ACCELERATION_STRUCTURE_BUILD_BIT_KHR | VK_PIPELINE_STAGE_2_ALL_TRANSFER_BIT,
        .srcAccessMask = kTree | VK_ACCESS_2_TRANSFER_WRITE_BIT,
        .dstStageMask = VK_PIPELINE_STAGE_2_ACCELERATION_STRUCTURE_BUILD_BIT_KHR,
        .dstAccessMask = kTree | VK_ACCESS_2_SHADER_READ_BIT};
    const VkDependencyInfo dependency{
        .sType = VK_STRUCTURE_TYPE_DEPENDENCY_INFO, .memoryBarrierCount = 1, .pMemoryBarriers = &between};
    vk_.vkCmdPipelineBarrier2(cmd, &dependency);
    build(base + record_at, tree.top, 1, true);
    return {};
}

// ---- pipelines

Result<TracePipeline> VulkanDevice::create_trace_pipeline(const TracePipelineDesc& desc) {
    if (!caps_.rt_pipeline)
        return Error{formatted("pipeline '{}': the device has no ray-tracing pipelines", desc.label)};
    Pipeline p{
        .label = std::string(desc.label), .reflection = {}, .groups = {}, .vk = {}, .layout = {}, .owns_layout = false};
    std::vector<const Reflection*> reflections;
    std::vector<VkPipelineShaderStageCreateInfo> stages;
    for (const ShaderModule module : {desc.raygen, desc.miss, desc.intersection, desc.closest_hit}) {
        const Shader* shader = found(shaders_.get(module), "shader module");
        if (!shader) return Error{formatted("pipeline '{}': stale shader module", desc.label)};
        reflections.push_back(&shader->reflection);
        p.reflection.push_bytes = std::max(p.reflection.push_bytes, shader->reflection.push_bytes);
        stages.push_back({.sType = VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO,
                          .stage = VkShaderStageFlagBits(to_vk(shader->reflection.stage)),
                          .module = shader->vk,
                          .pName = "main"});
    }
    if (Result<void> r = choose_layout(p, desc.layout, reflections); !r) return r.error();

    std::array<VkRayTracingShaderGroupCreateInfoKHR, 3> groups;
    for (VkRayTracingShaderGroupCreateInfoKHR& group : groups)
        group = {.sType = VK_STRUCTURE_TYPE_RAY_TRACING_SHADER_GROUP_CREATE_INFO_KHR,
                 .type = VK_RAY_TRACING_SHADER_GROUP_TYPE_GENERAL_KHR,
                 .generalShader = VK_SHADER_UNUSED_KHR,
                 .closestHitShader = VK_SHADER_UNUSED_KHR,
                 .anyHitShader = VK_SHADER_UNUSED_KHR,
                 .intersectionShader = VK_SHADER_UNUSED_KHR};
    groups[0].generalShader = 0;
    groups[1].generalShader = 1;
    groups[2].type = VK_RAY_TRACING_SHADER_GROUP_TYPE_PROCEDURAL_HIT_GROUP_KHR;
    groups[2].intersectionShader = 2;
    groups[2].closestHitShader = 3;
    const VkRayTracingPipelineCreateInfoKHR info{.sType = VK_STRUCTURE_TYPE_RAY_TRACING_PIPELINE_CREATE_INFO_KHR,
                                                 .stageCount = uint32_t(stages.size()),
                                                 .pStages = stages.data(),
                                                 .groupCount = uint32_t(groups.size()),
                                                 .pGroups = groups.data(),
                                                 .maxPipelineRayRecursionDepth = 1,
                                                 .layout = p.layout};
    VkResult r = vk_.vkCreateRayTracingPipelinesKHR(device_, VK_NULL_HANDLE, pipeline_cache_, 1, &info, nullptr, &p.vk);
    Result<void> filled = r == VK_SUCCESS ? fill_table(p) : fail(formatted("pipeline '{}'", desc.label), r);
    if (!filled) {
        vk_.vkDestroyPipeline(device_, p.vk, nullptr);
        if (p.owns_layout) vk_.vkDestroyPipelineLayout(device_, p.layout, nullptr);
        return filled.error();
    }
    label(VK_OBJECT_TYPE_PIPELINE, p.vk, p.label);
    ++pipelines_created_;
    return traces_.insert(std::move(p));
}

Result<void> VulkanDevice::fill_table(Pipeline& p) {
    const uint32_t handle = trace_limits_.shaderGroupHandleSize;
    const uint64_t stride = round_up(handle, std::max(trace_limits_.shaderGroupHandleAlignment, 1u));
    const uint64_t step = round_up(stride, std::max(trace_limits_.shaderGroupBaseAlignment, 1u));
    const std::string what = formatted("table of pipeline '{}'", p.label);
    std::vector<std::byte> handles(size_t{handle} * p.groups_in_table.size());
    VkResult r = vk_.vkGetRayTracingShaderGroupHandlesKHR(device_, p.vk, 0, uint32_t(p.groups_in_table.size()),
                                                          handles.size(), handles.data());
    if (r != VK_SUCCESS) return fail(what, r);
    const VkBufferCreateInfo create{
        .sType = VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO,
        .size = step * (p.groups_in_table.size() + 1),  // the first record begins where the alignment allows
        .usage = VK_BUFFER_USAGE_SHADER_BINDING_TABLE_BIT_KHR | VK_BUFFER_USAGE_SHADER_DEVICE_ADDRESS_BIT};
    if (r = vk_.vkCreateBuffer(device_, &create, nullptr, &p.table); r != VK_SUCCESS) return fail(what, r);
    VkMemoryRequirements need;
    vk_.vkGetBufferMemoryRequirements(device_, p.table, &need);
    Result<Allocation> memory = memory_.allocate(need, MemoryKind::Upload, false, what);
    if (!memory) {
        vk_.vkDestroyBuffer(device_, p.table, nullptr);
        return memory.error();
    }
    p.table_memory = *memory;
    if (r = vk_.vkBindBufferMemory(device_, p.table, memory->memory, memory->offset); r != VK_SUCCESS) {
        vk_.vkDestroyBuffer(device_, p.table, nullptr);
        memory_.release(*memory);
        return fail(what, r);
    }
    const VkDeviceAddress base = address(p.table);
    const VkDeviceAddress first = round_up(base, step);
    for (size_t i = 0; i < p.groups_in_table.size(); ++i) {
        std::memcpy(memory->mapped + (first - base) + i * step, handles.data() + i * handle, handle);
        // The region of ray generation is one record: its stride is its size.
        p.groups_in_table[i] = {first + i * step, stride, stride};
    }
    return {};
}

void VulkanDevice::destroy(TracePipeline handle) {
    auto p = take(traces_, handle, "trace pipeline");
    if (!p) return;
    retire(VK_OBJECT_TYPE_PIPELINE, p->vk);
    retire(VK_OBJECT_TYPE_BUFFER, p->table, p->table_memory);
    if (p->owns_layout) retire(VK_OBJECT_TYPE_PIPELINE_LAYOUT, p->layout);
}

}  // namespace kiln::rhi::vulkan
