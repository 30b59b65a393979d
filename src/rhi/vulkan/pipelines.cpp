// SPDX-License-Identifier: MIT
// Shaders, bind groups, pipelines.
#include "rhi/vulkan/device.h"

#include "base/format.h"

namespace kiln::rhi::vulkan {

namespace {

constexpr uint32_t kSetsPerPool = 256;

bool is_buffer(BindingKind kind) {
    return kind == BindingKind::UniformBuffer || kind == BindingKind::StorageBuffer ||
           kind == BindingKind::StorageBufferReadOnly;
}

// Specialisation constants as Vulkan wants them; keeps the arrays they point to.
struct Specialization {
    explicit Specialization(std::span<const SpecConstant> constants) {
        for (const SpecConstant& c : constants) {
            entries.push_back({c.id, uint32_t(values.size() * 4), 4});
            values.push_back(c.bits);
        }
        info = {uint32_t(entries.size()), entries.data(), values.size() * 4, values.data()};
    }
    std::vector<VkSpecializationMapEntry> entries;
    std::vector<uint32_t> values;
    VkSpecializationInfo info;
};

}  // namespace

Result<ShaderModule> VulkanDevice::create_shader_module(const ShaderModuleDesc& desc) {
    Result<Reflection> reflection = reflect_spirv(desc.spirv);
    if (!reflection)
        return Error{formatted("shader module '{}': {}", desc.label, reflection.error().message), ErrorKind::Input};
    const VkShaderModuleCreateInfo info{.sType = VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO,
                                        .codeSize = desc.spirv.size_bytes(),
                                        .pCode = desc.spirv.data()};
    VkShaderModule vk = VK_NULL_HANDLE;
    if (const VkResult r = vk_.vkCreateShaderModule(device_, &info, nullptr, &vk); r != VK_SUCCESS)
        return fail(formatted("shader module '{}'", desc.label), r);
    label(VK_OBJECT_TYPE_SHADER_MODULE, vk, desc.label);
    return shaders_.insert({std::string(desc.label), vk, std::move(*reflection)});
}

Result<BindGroupLayout> VulkanDevice::create_bind_group_layout(const BindGroupLayoutDesc& desc) {
    return make_group_layout(desc, false);
}

Result<BindGroupLayout> VulkanDevice::make_group_layout(const BindGroupLayoutDesc& desc, bool owned) {
    std::vector<VkDescriptorSetLayoutBinding> bindings;
    for (const BindGroupLayoutEntry& e : desc.entries)
        bindings.push_back(
            {.binding = e.binding, .descriptorType = to_vk(e), .descriptorCount = 1, .stageFlags = to_vk(e.stages)});
    const VkDescriptorSetLayoutCreateInfo info{.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO,
                                               .bindingCount = uint32_t(bindings.size()),
                                               .pBindings = bindings.data()};
    VkDescriptorSetLayout vk = VK_NULL_HANDLE;
    if (const VkResult r = vk_.vkCreateDescriptorSetLayout(device_, &info, nullptr, &vk); r != VK_SUCCESS)
        return fail(formatted("bind group layout '{}'", desc.label), r);
    label(VK_OBJECT_TYPE_DESCRIPTOR_SET_LAYOUT, vk, desc.label);
    return group_layouts_.insert({std::string(desc.label), {desc.entries.begin(), desc.entries.end()}, vk, owned});
}

Result<VkDescriptorSet> VulkanDevice::allocate_set(VkDescriptorSetLayout layout, VkDescriptorPool& pool) {
    VkDescriptorSetAllocateInfo info{
        .sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO, .descriptorSetCount = 1, .pSetLayouts = &layout};
    VkDescriptorSet out = VK_NULL_HANDLE;
    VkResult r = VK_ERROR_OUT_OF_POOL_MEMORY;
    for (size_t i = set_pools_.size(); i-- > 0;) {
        info.descriptorPool = pool = set_pools_[i];
        r = vk_.vkAllocateDescriptorSets(device_, &info, &out);
        if (r == VK_SUCCESS) return out;
        if (r != VK_ERROR_OUT_OF_POOL_MEMORY && r != VK_ERROR_FRAGMENTED_POOL) return fail("bind group", r);
    }
    // Room for the fullest groups that the floor allows, on average a quarter of that.
    std::vector<VkDescriptorPoolSize> sizes{
        {VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER, 2 * kSetsPerPool},
        {VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, 8 * kSetsPerPool},
        {VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER_DYNAMIC, kSetsPerPool},
        {VK_DESCRIPTOR_TYPE_STORAGE_BUFFER_DYNAMIC, kSetsPerPool},
        {VK_DESCRIPTOR_TYPE_SAMPLED_IMAGE, 8 * kSetsPerPool},
        {VK_DESCRIPTOR_TYPE_SAMPLER, 2 * kSetsPerPool},
        {VK_DESCRIPTOR_TYPE_STORAGE_IMAGE, 4 * kSetsPerPool},
    };
    if (caps_.rt_pipeline) sizes.push_back({VK_DESCRIPTOR_TYPE_ACCELERATION_STRUCTURE_KHR, kSetsPerPool / 8});
    const VkDescriptorPoolCreateInfo create{.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO,
                                            .flags = VK_DESCRIPTOR_POOL_CREATE_FREE_DESCRIPTOR_SET_BIT,
                                            .maxSets = kSetsPerPool,
                                            .poolSizeCount = uint32_t(sizes.size()),
                                            .pPoolSizes = sizes.data()};
    if (r = vk_.vkCreateDescriptorPool(device_, &create, nullptr, &pool); r != VK_SUCCESS) return fail("bind group", r);
    set_pools_.push_back(pool);
    info.descriptorPool = pool;
    if (r = vk_.vkAllocateDescriptorSets(device_, &info, &out); r != VK_SUCCESS) return fail("bind group", r);
    return out;
}

Result<BindGroup> VulkanDevice::create_bind_group(const BindGroupDesc& desc) {
    const std::string what = formatted("bind group '{}'", desc.label);
    const GroupLayout* layout = found(group_layouts_.get(desc.layout), "bind group layout");
    if (!layout) return Error{what + ": stale layout"};

    std::vector<VkDescriptorBufferInfo> buffers(desc.entries.size());
    std::vector<VkDescriptorImageInfo> images(desc.entries.size());
    std::vector<VkWriteDescriptorSetAccelerationStructureKHR> trees(desc.entries.size());
    std::vector<VkWriteDescriptorSet> writes;
    for (size_t i = 0; i < desc.entries.size(); ++i) {
        const BindGroupEntry& entry = desc.entries[i];
        const auto slot = std::find_if(layout->entries.begin(), layout->entries.end(),
                                       [&](const BindGroupLayoutEntry& e) { return e.binding == entry.binding; });
        if (slot == layout->entries.end())
            return Error{formatted("{}: the layout has no binding {}", what, entry.binding)};
        VkWriteDescriptorSet write{.sType = VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET,
                                   .dstBinding = entry.binding,
                                   .descriptorCount = 1,
                                   .descriptorType = to_vk(*slot)};
        if (is_buffer(slot->kind)) {
            const Buffer* b = find(entry.buffer);
            if (!b || entry.offset >= b->desc.size)
                return Error{formatted("{}: binding {} has no buffer or starts past its end", what, entry.binding)};
            buffers[i] = {b->vk, entry.offset, std::min(entry.size, b->desc.size - entry.offset)};
            write.pBufferInfo = &buffers[i];
        } else if (slot->kind == BindingKind::BoxTree) {
            const Buffer* b = find(entry.buffer);
            if (!b || !b->top) return Error{formatted("{}: binding {} has no box tree", what, entry.binding)};
            trees[i] = {.sType = VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET_ACCELERATION_STRUCTURE_KHR,
                        .accelerationStructureCount = 1,
                        .pAccelerationStructures = &b->top};
            write.pNext = &trees[i];
        } else if (slot->kind == BindingKind::Sampler) {
            const Sampler* s = found(samplers_.get(entry.sampler), "sampler");
            if (!s) return Error{formatted("{}: binding {} has no sampler", what, entry.binding)};
            images[i].sampler = s->vk;
            write.pImageInfo = &images[i];
        } else {
            const View* v = find(entry.view);
            if (!v) return Error{formatted("{}: binding {} has no view", what, entry.binding)};
            images[i].imageView = v->vk;
            images[i].imageLayout =
                slot->kind == BindingKind::SampledTexture ? shader_read_layout(v->texture) : VK_IMAGE_LAYOUT_GENERAL;
            write.pImageInfo = &images[i];
        }
        writes.push_back(write);
    }
    if (writes.size() != layout->entries.size())
        return Error{formatted("{}: {} entries for a layout of {}", what, writes.size(), layout->entries.size())};

    VkDescriptorPool pool = VK_NULL_HANDLE;
    Result<VkDescriptorSet> set = allocate_set(layout->vk, pool);
    if (!set) return set.error();
    for (VkWriteDescriptorSet& write : writes) write.dstSet = *set;
    vk_.vkUpdateDescriptorSets(device_, uint32_t(writes.size()), writes.data(), 0, nullptr);
    label(VK_OBJECT_TYPE_DESCRIPTOR_SET, *set, desc.label);
    return groups_.insert({std::string(desc.label), *set, pool});
}

Result<VkPipelineLayout> VulkanDevice::make_layout(std::span<const BindGroupLayout> groups, uint32_t push_bytes) {
    std::vector<VkDescriptorSetLayout> sets;
    for (const BindGroupLayout handle : groups) {
        const GroupLayout* l = found(group_layouts_.get(handle), "bind group layout");
        if (!l) return Error{"pipeline layout: stale bind group layout"};
        sets.push_back(l->vk);
    }
    const VkPushConstantRange push{stages_.push, 0, push_bytes};
    const VkPipelineLayoutCreateInfo info{.sType = VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO,
                                          .setLayoutCount = uint32_t(sets.size()),
                                          .pSetLayouts = sets.data(),
                                          .pushConstantRangeCount = push_bytes > 0 ? 1u : 0u,
                                          .pPushConstantRanges = &push};
    VkPipelineLayout out = VK_NULL_HANDLE;
    if (const VkResult r = vk_.vkCreatePipelineLayout(device_, &info, nullptr, &out); r != VK_SUCCESS)
        return fail("pipeline layout", r);
    return out;
}

Result<PipelineLayout> VulkanDevice::create_pipeline_layout(const PipelineLayoutDesc& desc) {
    Result<VkPipelineLayout> vk = make_layout(desc.groups, desc.push_bytes);
    if (!vk) return vk.error();
    label(VK_OBJECT_TYPE_PIPELINE_LAYOUT, *vk, desc.label);
    return layouts_.insert({std::string(desc.label), {desc.groups.begin(), desc.groups.end()}, *vk});
}

Result<void> VulkanDevice::choose_layout(Pipeline& out, PipelineLayout wanted,
                                         std::span<const Reflection* const> shaders) {
    if (wanted) {
        const Layout* l = found(layouts_.get(wanted), "pipeline layout");
        if (!l) return Error{formatted("pipeline '{}': stale layout", out.label)};
        out.groups = l->groups;
        out.layout = l->vk;
        out.owns_layout = false;
        return {};
    }
    auto groups =
        auto_layouts_.groups(shaders, [&](const BindGroupLayoutDesc& d) { return make_group_layout(d, true); });
    if (!groups) return Error{formatted("pipeline '{}': {}", out.label, groups.error().message), groups.error().kind};
    Result<VkPipelineLayout> vk = make_layout(*groups, out.reflection.push_bytes);
    if (!vk) return Error{formatted("pipeline '{}': {}", out.label, vk.error().message), vk.error().kind};
    out.groups = std::move(*groups);
    out.layout = *vk;
    out.owns_layout = true;
    return {};
}

Result<ComputePipeline> VulkanDevice::create_compute_pipeline(const ComputePipelineDesc& desc) {
    const Shader* shader = found(shaders_.get(desc.shader), "shader module");
    if (!shader) return Error{formatted("pipeline '{}': stale shader module", desc.label)};
    if (shader->reflection.stage != ShaderStage::Compute)
        return Error{formatted("pipeline '{}': '{}' is not a compute shader", desc.label, shader->label)};
    Pipeline p{.label = std::string(desc.label),
               .reflection = shader->reflection,
               .groups = {},
               .vk = {},
               .layout = {},
               .owns_layout = false};
    const Reflection* const reflections[] = {&shader->reflection};
    if (Result<void> r = choose_layout(p, desc.layout, reflections); !r) return r.error();

    const std::string entry(desc.entry);
    const Specialization special(desc.constants);
    const VkComputePipelineCreateInfo info{
        .sType = VK_STRUCTURE_TYPE_COMPUTE_PIPELINE_CREATE_INFO,
        .stage = {.sType = VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO,
                  .stage = VK_SHADER_STAGE_COMPUTE_BIT,
                  .module = shader->vk,
                  .pName = entry.c_str(),
                  .pSpecializationInfo = desc.constants.empty() ? nullptr : &special.info},
        .layout = p.layout};
    const VkResult r = vk_.vkCreateComputePipelines(device_, pipeline_cache_, 1, &info, nullptr, &p.vk);
    if (r != VK_SUCCESS) {
        if (p.owns_layout) vk_.vkDestroyPipelineLayout(device_, p.layout, nullptr);
        return fail(formatted("pipeline '{}'", desc.label), r);
    }
    label(VK_OBJECT_TYPE_PIPELINE, p.vk, p.label);
    ++pipelines_created_;
    return compute_.insert(std::move(p));
}

Result<RenderPipeline> VulkanDevice::create_render_pipeline(const RenderPipelineDesc& desc) {
    if (!draws()) return Error{formatted("pipeline '{}': the device's queue doesn't draw", desc.label)};
    struct Stage {
        VkShaderStageFlagBits bit;
        const Shader* shader;
        std::string entry;
    };
    std::vector<Stage> modules;
    bool stale = false;
    const auto add = [&](VkShaderStageFlagBits bit, ShaderModule module, std::string_view entry) {
        const Shader* shader = found(shaders_.get(module), "shader module");
        stale = stale || !shader;
        modules.push_back({bit, shader, std::string(entry)});
    };
    if (desc.mesh) {
        if (!caps_.mesh_shader) return Error{formatted("pipeline '{}': the device has no mesh shaders", desc.label)};
        add(VK_SHADER_STAGE_MESH_BIT_EXT, desc.mesh, "main");
    } else {
        add(VK_SHADER_STAGE_VERTEX_BIT, desc.vertex, desc.vertex_entry);
    }
    if (desc.fragment) add(VK_SHADER_STAGE_FRAGMENT_BIT, desc.fragment, desc.fragment_entry);
    if (stale) return Error{formatted("pipeline '{}': stale shader module", desc.label)};
    if (desc.colors.size() > kMaxColorTargets)
        return Error{formatted("pipeline '{}': too many colour targets", desc.label)};

    Pipeline p{.label = std::string(desc.label),
               .reflection = modules[0].shader->reflection,
               .groups = {},
               .vk = {},
               .layout = {},
               .owns_layout = false};
    std::vector<const Reflection*> reflections;
    for (const Stage& m : modules) {
        reflections.push_back(&m.shader->reflection);
        p.reflection.push_bytes = std::max(p.reflection.push_bytes, m.shader->reflection.push_bytes);
    }
    if (Result<void> r = choose_layout(p, desc.layout, reflections); !r) return r.error();

    const Specialization special(desc.constants);
    std::vector<VkPipelineShaderStageCreateInfo> stages;
    for (const Stage& m : modules)
        stages.push_back({.sType = VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO,
                          .stage = m.bit,
                          .module = m.shader->vk,
                          .pName = m.entry.c_str(),
                          .pSpecializationInfo = &special.info});

    std::vector<VkVertexInputBindingDescription> bindings;
    std::vector<VkVertexInputAttributeDescription> attributes;
    for (const VertexBufferLayout& b : desc.vertex_buffers) {
        const uint32_t slot = uint32_t(bindings.size());
        bindings.push_back(
            {slot, b.stride, b.per_instance ? VK_VERTEX_INPUT_RATE_INSTANCE : VK_VERTEX_INPUT_RATE_VERTEX});
        for (const VertexAttribute& a : b.attributes)
            attributes.push_back({a.location, slot, to_vk(a.format), a.offset});
    }
    const VkPipelineVertexInputStateCreateInfo input{.sType = VK_STRUCTURE_TYPE_PIPELINE_VERTEX_INPUT_STATE_CREATE_INFO,
                                                     .vertexBindingDescriptionCount = uint32_t(bindings.size()),
                                                     .pVertexBindingDescriptions = bindings.data(),
                                                     .vertexAttributeDescriptionCount = uint32_t(attributes.size()),
                                                     .pVertexAttributeDescriptions = attributes.data()};
    const VkPipelineInputAssemblyStateCreateInfo assembly{
        .sType = VK_STRUCTURE_TYPE_PIPELINE_INPUT_ASSEMBLY_STATE_CREATE_INFO, .topology = to_vk(desc.topology)};
    const VkPipelineViewportStateCreateInfo viewport{
        .sType = VK_STRUCTURE_TYPE_PIPELINE_VIEWPORT_STATE_CREATE_INFO, .viewportCount = 1, .scissorCount = 1};
    const VkPipelineRasterizationStateCreateInfo raster{
        .sType = VK_STRUCTURE_TYPE_PIPELINE_RASTERIZATION_STATE_CREATE_INFO,
        .polygonMode = VK_POLYGON_MODE_FILL,
        .cullMode = desc.cull == Cull::None   ? VkCullModeFlags(VK_CULL_MODE_NONE)
                    : desc.cull == Cull::Back ? VkCullModeFlags(VK_CULL_MODE_BACK_BIT)
                                              : VkCullModeFlags(VK_CULL_MODE_FRONT_BIT),
        // The viewport turns the picture over and, with it, the way round; both together leave it as the user means it.
        .frontFace = desc.front_is_counter_clockwise ? VK_FRONT_FACE_COUNTER_CLOCKWISE : VK_FRONT_FACE_CLOCKWISE,
        .lineWidth = 1.0f};
    const VkPipelineMultisampleStateCreateInfo samples{
        .sType = VK_STRUCTURE_TYPE_PIPELINE_MULTISAMPLE_STATE_CREATE_INFO,
        .rasterizationSamples = VK_SAMPLE_COUNT_1_BIT};
    const VkPipelineDepthStencilStateCreateInfo depth{
        .sType = VK_STRUCTURE_TYPE_PIPELINE_DEPTH_STENCIL_STATE_CREATE_INFO,
        .depthTestEnable = desc.depth.format != Format::Undefined,
        .depthWriteEnable = desc.depth.write,
        .depthCompareOp = to_vk(desc.depth.compare)};
    std::vector<VkPipelineColorBlendAttachmentState> blends;
    std::vector<VkFormat> formats;
    for (const ColorTarget& c : desc.colors) {
        blends.push_back({.blendEnable = c.blend,
                          .srcColorBlendFactor = to_vk(c.color.src),
                          .dstColorBlendFactor = to_vk(c.color.dst),
                          .colorBlendOp = to_vk(c.color.op),
                          .srcAlphaBlendFactor = to_vk(c.alpha.src),
                          .dstAlphaBlendFactor = to_vk(c.alpha.dst),
                          .alphaBlendOp = to_vk(c.alpha.op),
                          .colorWriteMask = c.write_mask});
        formats.push_back(to_vk(c.format));
    }
    const VkPipelineColorBlendStateCreateInfo blend{.sType = VK_STRUCTURE_TYPE_PIPELINE_COLOR_BLEND_STATE_CREATE_INFO,
                                                    .attachmentCount = uint32_t(blends.size()),
                                                    .pAttachments = blends.data()};
    const VkDynamicState dynamics[] = {VK_DYNAMIC_STATE_VIEWPORT, VK_DYNAMIC_STATE_SCISSOR,
                                       VK_DYNAMIC_STATE_BLEND_CONSTANTS};
    const VkPipelineDynamicStateCreateInfo dynamic{.sType = VK_STRUCTURE_TYPE_PIPELINE_DYNAMIC_STATE_CREATE_INFO,
                                                   .dynamicStateCount = uint32_t(std::size(dynamics)),
                                                   .pDynamicStates = dynamics};
    const VkPipelineRenderingCreateInfo rendering{.sType = VK_STRUCTURE_TYPE_PIPELINE_RENDERING_CREATE_INFO,
                                                  .colorAttachmentCount = uint32_t(formats.size()),
                                                  .pColorAttachmentFormats = formats.data(),
                                                  .depthAttachmentFormat = to_vk(desc.depth.format)};
    const VkGraphicsPipelineCreateInfo info{.sType = VK_STRUCTURE_TYPE_GRAPHICS_PIPELINE_CREATE_INFO,
                                            .pNext = &rendering,
                                            .stageCount = uint32_t(stages.size()),
                                            .pStages = stages.data(),
                                            .pVertexInputState = desc.mesh ? nullptr : &input,
                                            .pInputAssemblyState = desc.mesh ? nullptr : &assembly,
                                            .pViewportState = &viewport,
                                            .pRasterizationState = &raster,
                                            .pMultisampleState = &samples,
                                            .pDepthStencilState = &depth,
                                            .pColorBlendState = &blend,
                                            .pDynamicState = &dynamic,
                                            .layout = p.layout};
    const VkResult r = vk_.vkCreateGraphicsPipelines(device_, pipeline_cache_, 1, &info, nullptr, &p.vk);
    if (r != VK_SUCCESS) {
        if (p.owns_layout) vk_.vkDestroyPipelineLayout(device_, p.layout, nullptr);
        return fail(formatted("pipeline '{}'", desc.label), r);
    }
    label(VK_OBJECT_TYPE_PIPELINE, p.vk, p.label);
    ++pipelines_created_;
    return render_.insert(std::move(p));
}

const Reflection* VulkanDevice::reflection(ShaderModule shader) {
    const Shader* s = found(shaders_.get(shader), "shader module");
    return s ? &s->reflection : nullptr;
}

const Reflection* VulkanDevice::reflection(ComputePipeline pipeline) {
    const Pipeline* p = find(pipeline);
    return p ? &p->reflection : nullptr;
}

BindGroupLayout VulkanDevice::group_layout(ComputePipeline pipeline, uint32_t index) {
    const Pipeline* p = find(pipeline);
    return p && index < p->groups.size() ? p->groups[index] : BindGroupLayout{};
}

BindGroupLayout VulkanDevice::group_layout(RenderPipeline pipeline, uint32_t index) {
    const Pipeline* p = find(pipeline);
    return p && index < p->groups.size() ? p->groups[index] : BindGroupLayout{};
}

BindGroupLayout VulkanDevice::group_layout(TracePipeline pipeline, uint32_t index) {
    const Pipeline* p = find(pipeline);
    return p && index < p->groups.size() ? p->groups[index] : BindGroupLayout{};
}

void VulkanDevice::destroy(ShaderModule handle) {
    // Pipelines keep what they need; nothing on the queue looks at a module.
    if (auto s = take(shaders_, handle, "shader module")) vk_.vkDestroyShaderModule(device_, s->vk, nullptr);
}

void VulkanDevice::destroy(BindGroupLayout handle) {
    if (const GroupLayout* l = group_layouts_.get(handle); l && l->owned)
        return report_("destroy: this bind group layout belongs to the pipelines that made it");
    if (auto l = take(group_layouts_, handle, "bind group layout")) retire(VK_OBJECT_TYPE_DESCRIPTOR_SET_LAYOUT, l->vk);
}

void VulkanDevice::destroy(BindGroup handle) {
    if (auto g = take(groups_, handle, "bind group")) retire(VK_OBJECT_TYPE_DESCRIPTOR_SET, g->vk, {}, g->pool);
}

void VulkanDevice::destroy(PipelineLayout handle) {
    if (auto l = take(layouts_, handle, "pipeline layout")) retire(VK_OBJECT_TYPE_PIPELINE_LAYOUT, l->vk);
}

void VulkanDevice::destroy(ComputePipeline handle) {
    auto p = take(compute_, handle, "compute pipeline");
    if (!p) return;
    retire(VK_OBJECT_TYPE_PIPELINE, p->vk);
    if (p->owns_layout) retire(VK_OBJECT_TYPE_PIPELINE_LAYOUT, p->layout);
}

void VulkanDevice::destroy(RenderPipeline handle) {
    auto p = take(render_, handle, "render pipeline");
    if (!p) return;
    retire(VK_OBJECT_TYPE_PIPELINE, p->vk);
    if (p->owns_layout) retire(VK_OBJECT_TYPE_PIPELINE_LAYOUT, p->layout);
}

}  // namespace kiln::rhi::vulkan
