// SPDX-License-Identifier: MIT
#include "rhi/validate/device.h"

#include "base/format.h"
#include "rhi/texture_math.h"
#include "rhi/validate/commands.h"
#include "rhi/validate/rules.h"

namespace kiln::rhi::validate {

ValidateDevice::ValidateDevice(std::unique_ptr<Device> below) : below_(std::move(below)) {
    below_->set_error_sink([this](std::string_view sentence) { report_(sentence); });
}

Error ValidateDevice::refuse(std::string sentence) {
    report_(sentence);
    return Error{std::move(sentence)};
}

ViewHandle ValidateDevice::whole_view(TextureHandle texture) {
    const TextureInfo* t = objects_.textures.find(texture);
    if (!t) {
        report_("whole_view: " + objects_.textures.why_not(texture));
        return {};
    }
    return t->whole;
}

const Reflection* ValidateDevice::reflection(ShaderModule shader) {
    if (objects_.shaders.find(shader)) return below_->reflection(shader);
    report_("reflection: " + objects_.shaders.why_not(shader));
    return nullptr;
}

const Reflection* ValidateDevice::reflection(ComputePipeline pipeline) {
    if (objects_.compute.find(pipeline)) return below_->reflection(pipeline);
    report_("reflection: " + objects_.compute.why_not(pipeline));
    return nullptr;
}

BindGroupLayout ValidateDevice::remember_group_layout(BindGroupLayout handle, const PipelineInfo& pipeline,
                                                      uint32_t index) {
    if (handle && !objects_.group_layouts.find(handle))
        objects_.group_layouts.set(
            handle, {formatted("group {} of '{}'", index, pipeline.label), pipeline.groups[index], true});
    return handle;
}

BindGroupLayout ValidateDevice::group_layout(ComputePipeline pipeline, uint32_t index) {
    const ComputeInfo* p = objects_.compute.find(pipeline);
    if (!p || index >= p->groups.size()) {
        report_(p ? formatted("group_layout: pipeline '{}' has no bind group {}", p->label, index)
                  : "group_layout: " + objects_.compute.why_not(pipeline));
        return {};
    }
    return remember_group_layout(below_->group_layout(pipeline, index), *p, index);
}

BindGroupLayout ValidateDevice::group_layout(RenderPipeline pipeline, uint32_t index) {
    const RenderInfo* p = objects_.render.find(pipeline);
    if (!p || index >= p->groups.size()) {
        report_(p ? formatted("group_layout: pipeline '{}' has no bind group {}", p->label, index)
                  : "group_layout: " + objects_.render.why_not(pipeline));
        return {};
    }
    return remember_group_layout(below_->group_layout(pipeline, index), *p, index);
}

BindGroupLayout ValidateDevice::group_layout(TracePipeline pipeline, uint32_t index) {
    const TraceInfo* p = objects_.traces.find(pipeline);
    if (!p || index >= p->groups.size()) {
        report_(p ? formatted("group_layout: pipeline '{}' has no bind group {}", p->label, index)
                  : "group_layout: " + objects_.traces.why_not(pipeline));
        return {};
    }
    return remember_group_layout(below_->group_layout(pipeline, index), *p, index);
}

uint64_t ValidateDevice::box_tree_bytes(uint32_t boxes) {
    if (caps().rt_pipeline) return below_->box_tree_bytes(boxes);
    report_("box_tree_bytes: the device has no ray-tracing pipelines");
    return 0;
}

BufferDesc ValidateDevice::desc(BufferHandle buffer) {
    if (objects_.buffers.find(buffer)) return below_->desc(buffer);
    report_("desc: " + objects_.buffers.why_not(buffer));
    return {};
}

TextureDesc ValidateDevice::desc(TextureHandle texture) {
    if (objects_.textures.find(texture)) return below_->desc(texture);
    report_("desc: " + objects_.textures.why_not(texture));
    return {};
}

ViewDesc ValidateDevice::desc(ViewHandle view) {
    if (objects_.views.find(view)) return below_->desc(view);
    report_("desc: " + objects_.views.why_not(view));
    return {};
}

Result<void> ValidateDevice::write_buffer(BufferHandle buffer, uint64_t offset, std::span<const std::byte> bytes) {
    const BufferInfo* b = objects_.buffers.find(buffer);
    if (!b) return refuse("write_buffer: " + objects_.buffers.why_not(buffer));
    if (!any(b->desc.usage & BufferUsage::CopyDst))
        return refuse(formatted("write_buffer: '{}' lacks usage CopyDst", b->label));
    if (b->desc.memory != MemoryKind::Device)
        return refuse(formatted("write_buffer: '{}' is not device memory; map it", b->label));
    if (offset % 4 != 0 || bytes.size() % 4 != 0)
        return refuse(
            formatted("write_buffer: {} B at {} of '{}': both must be multiples of 4", bytes.size(), offset, b->label));
    if (offset > b->desc.size || bytes.size() > b->desc.size - offset)
        return refuse(formatted("write_buffer: {} B at {} go past the end of '{}' ({} B)", bytes.size(), offset,
                                b->label, b->desc.size));
    Result<void> done = below_->write_buffer(buffer, offset, bytes);
    if (done && !bytes.empty()) written_buffers_.push_back(buffer);
    return done;
}

Result<void> ValidateDevice::write_texture(const TextureWrite& write, std::span<const std::byte> bytes) {
    const TextureInfo* t = objects_.textures.find(write.place.texture);
    if (!t) return refuse("write_texture: " + objects_.textures.why_not(write.place.texture));
    if (!any(t->desc.usage & TextureUsage::CopyDst))
        return refuse(formatted("write_texture: '{}' lacks usage CopyDst", t->label));
    std::string fault = check_region(*t, write.place, write.size);
    if (fault.empty()) {
        Limits any_row = limits();  // the bytes are the CPU's: rows may lie as they like
        any_row.copy_row_alignment = any_row.copy_offset_alignment = 1;
        fault = check_rows(*t, {.bytes_per_row = write.bytes_per_row, .rows_per_layer = write.rows_per_layer},
                           write.size, bytes.size(), any_row);
    }
    if (fault.empty() && !any(write.after)) fault = "`after` is Undefined";
    if (fault.empty()) fault = check_access(write.after, *t);
    if (!fault.empty()) return refuse("write_texture: " + fault);
    Result<void> done = below_->write_texture(write, bytes);
    if (done) written_textures_.push_back(write);
    return done;
}

std::unique_ptr<CommandEncoder> ValidateDevice::create_encoder(std::string_view label) {
    return std::make_unique<ValidateEncoder>(*this, below_->create_encoder(label), label);
}

Result<SubmitId> ValidateDevice::submit(std::unique_ptr<CommandEncoder> encoder) {
    auto* own = dynamic_cast<ValidateEncoder*>(encoder.get());
    if (!own) return refuse("submit: not an encoder of this device");
    own->finish();
    if (!own->error().empty()) return Error{own->error()};  // reported when it was made

    std::vector<std::string> faults;
    for (const BufferHandle buffer : written_buffers_) tracker_.wrote(buffer);
    for (const TextureWrite& write : written_textures_)
        if (std::string fault = tracker_.wrote(write); !fault.empty()) faults.push_back(std::move(fault));
    written_buffers_.clear();
    written_textures_.clear();
    for (std::string& fault : tracker_.play(own->recording())) faults.push_back(std::move(fault));
    for (const std::string& fault : faults) report_(fault);
    if (!faults.empty()) return Error{faults.front()};

    Result<SubmitId> id = below_->submit(own->take_below());
    if (!id) return id;
    for (const Event& e : own->recording().events)
        if (BufferInfo* b = objects_.buffers.find(e.is_barrier ? e.barrier.buffer : e.use.buffer)) b->last_use = *id;
    return id;
}

Result<void> ValidateDevice::wait(SubmitId id) {
    if (id > below_->last_submit()) return refuse(formatted("wait: submit {} was never made", id));
    return below_->wait(id);
}

Result<std::span<std::byte>> ValidateDevice::map(BufferHandle buffer) {
    BufferInfo* b = objects_.buffers.find(buffer);
    if (!b) return refuse("map: " + objects_.buffers.why_not(buffer));
    if (b->desc.memory == MemoryKind::Device) return refuse(formatted("map: '{}' is in device memory", b->label));
    if (b->mapped) return refuse(formatted("map: '{}' is mapped already", b->label));
    if (!below_->completed(b->last_use))
        return refuse(
            formatted("map: '{}' is used by submit {}, which is not done; wait for it", b->label, b->last_use));
    if (b->desc.memory == MemoryKind::Readback && b->last_use > 0 && !tracker_.ready_for_host(buffer))
        return refuse(formatted("map: '{}' was written by the GPU without a barrier to HostRead", b->label));
    Result<std::span<std::byte>> bytes = below_->map(buffer);
    if (bytes) b->mapped = true;
    return bytes;
}

void ValidateDevice::unmap(BufferHandle buffer) {
    BufferInfo* b = objects_.buffers.find(buffer);
    if (!b) return report_("unmap: " + objects_.buffers.why_not(buffer));
    if (!b->mapped) return report_(formatted("unmap: '{}' is not mapped", b->label));
    b->mapped = false;
    if (b->desc.memory == MemoryKind::Upload) tracker_.wrote(buffer);
    below_->unmap(buffer);
}

}  // namespace kiln::rhi::validate
