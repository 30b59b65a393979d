// SPDX-License-Identifier: MIT
// The floor as a check on one shader, and the bind group layouts that a pipeline's shaders ask for.
#include "rhi/binding_counts.h"
#include "rhi/spirv_reflect.h"

#include <algorithm>

namespace kiln::rhi {

namespace {

bool granted(std::string_view capability, const Caps& caps) {
    if (capability == "StorageImageExtendedFormats") return caps.storage_r16f;
    if (capability == "Int64" || capability == "Int64Atomics") return caps.int64_buffer_atomics;
    if (capability == "RuntimeDescriptorArray" || capability == "ShaderNonUniform" ||
        capability == "SampledImageArrayDynamicIndexing" || capability == "StorageImageArrayDynamicIndexing")
        return caps.bindless;
    if (capability == "PhysicalStorageBufferAddresses") return caps.buffer_address;
    if (capability == "RayTracingKHR") return caps.rt_pipeline;
    if (capability == "MeshShadingEXT") return caps.mesh_shader;
    return false;
}

bool is_storage_texture(const ReflectedBinding& b) {
    return b.kind == BindingKind::StorageTexture || b.kind == BindingKind::StorageTextureReadOnly;
}

}  // namespace

std::vector<std::string> check_floor(const Reflection& r, const Caps& caps) {
    std::vector<std::string> out;
    const auto at_most = [&](uint64_t is, uint64_t most, std::string_view what) {
        if (is > most)
            out.push_back(std::string(what) + ": " + std::to_string(is) + ", the floor is " + std::to_string(most));
    };
    BindingCounts counts;
    for (const ReflectedBinding& b : r.bindings) {
        at_most(b.set + 1ull, kMaxBindGroups, "bind groups");
        if (b.array_count != 1 && !caps.bindless) out.push_back("binding '" + b.name + "' is an array of resources");
        counts.add(b.kind);
        if (b.kind == BindingKind::UniformBuffer)
            at_most(b.block_size, kMaxUniformBinding, "bytes of uniform block '" + b.name + "'");
        if (!is_storage_texture(b)) continue;
        if (b.format == Format::Undefined) {
            out.push_back("storage texture '" + b.name + "' has no format that the engine knows");
        } else if (!info(b.format).core_storage && !caps.storage_r16f) {
            out.push_back("storage texture '" + b.name + "' has format " + std::string(name(b.format)) +
                          ", which not every device can store to");
        } else if (b.kind == BindingKind::StorageTexture && !b.write_only && b.format != Format::R32Float &&
                   b.format != Format::R32Uint) {
            out.push_back("storage texture '" + b.name + "' is read and written; only R32Float and R32Uint may be" +
                          " (declare it writeonly or readonly)");
        }
    }
    for (const BindingCounts::Row& row : counts.rows()) at_most(row.is, row.most, row.what);
    at_most(r.push_bytes, kMaxPushBytes, "bytes of push data");
    at_most(uint64_t{r.workgroup[0]} * r.workgroup[1] * r.workgroup[2], kMaxWorkgroupThreads, "threads a workgroup");
    at_most(r.shared_bytes, kMaxWorkgroupShared, "bytes of workgroup memory");
    for (const std::string& capability : r.beyond_floor)
        if (!granted(capability, caps)) out.push_back("needs " + capability);
    return out;
}

Result<std::vector<BindGroupLayoutEntry>> layout_entries(std::span<const Reflection* const> shaders, uint32_t set) {
    std::vector<BindGroupLayoutEntry> out;
    for (const Reflection* shader : shaders) {
        for (const ReflectedBinding& b : shader->bindings) {
            if (b.set != set) continue;
            const BindGroupLayoutEntry entry{.binding = b.binding,
                                             .kind = b.kind,
                                             .stages = b.stages,
                                             .format = b.format,
                                             .dimension = b.dimension,
                                             .sample_type = b.sample_type};
            const auto same =
                std::find_if(out.begin(), out.end(), [&](const auto& e) { return e.binding == b.binding; });
            if (same == out.end()) {
                out.push_back(entry);
                continue;
            }
            same->stages |= b.stages;
            const auto is_buffer = [](BindingKind k) {
                return k == BindingKind::StorageBuffer || k == BindingKind::StorageBufferReadOnly;
            };
            if (is_buffer(same->kind) && is_buffer(entry.kind)) {
                if (entry.kind == BindingKind::StorageBuffer) same->kind = BindingKind::StorageBuffer;
            } else if (same->kind != entry.kind || same->format != entry.format || same->dimension != entry.dimension) {
                return Error{"shaders disagree on set " + std::to_string(set) + " binding " +
                                 std::to_string(b.binding) + ": " + std::string(name(same->kind)) + " in one, " +
                                 std::string(name(entry.kind)) + " ('" + b.name + "') in another",
                             ErrorKind::Failed};
            }
        }
    }
    std::sort(out.begin(), out.end(), [](const auto& a, const auto& b) { return a.binding < b.binding; });
    return out;
}

}  // namespace kiln::rhi
