// SPDX-License-Identifier: MIT
#include "rhi/null/device.h"

#include "rhi/null/commands.h"

#include <cstring>

namespace kiln::rhi::null {

NullDevice::NullDevice() {
    info_ = {.backend = "null", .name = "null", .driver = "none", .api = "none", .kind = DeviceKind::Other};
    caps_ = {
        .timestamp = true, .storage_r16f = true, .mesh_shader = true, .rt_pipeline = true, .multi_draw_indirect = true};
    limits_.max_buffer = 4ull << 30;
}

ViewHandle NullDevice::whole_view(TextureHandle texture) {
    const Texture* t = find(texture);
    return t ? t->whole : ViewHandle{};
}

const Reflection* NullDevice::reflection(ShaderModule shader) {
    const Shader* s = found(shaders_.get(shader), "shader module");
    return s ? &s->reflection : nullptr;
}

const Reflection* NullDevice::reflection(ComputePipeline pipeline) {
    const Pipeline* p = find(pipeline);
    return p ? &p->reflection : nullptr;
}

BindGroupLayout NullDevice::group_layout(ComputePipeline pipeline, uint32_t index) {
    const Pipeline* p = find(pipeline);
    return p && index < p->groups.size() ? p->groups[index] : BindGroupLayout{};
}

BindGroupLayout NullDevice::group_layout(RenderPipeline pipeline, uint32_t index) {
    const Pipeline* p = find(pipeline);
    return p && index < p->groups.size() ? p->groups[index] : BindGroupLayout{};
}

BindGroupLayout NullDevice::group_layout(TracePipeline pipeline, uint32_t index) {
    const Pipeline* p = find(pipeline);
    return p && index < p->groups.size() ? p->groups[index] : BindGroupLayout{};
}

BufferDesc NullDevice::desc(BufferHandle buffer) {
    const Buffer* b = find(buffer);
    return b ? b->desc : BufferDesc{};
}

TextureDesc NullDevice::desc(TextureHandle texture) {
    const Texture* t = find(texture);
    return t ? t->desc : TextureDesc{};
}

ViewDesc NullDevice::desc(ViewHandle view) {
    const View* v = find(view);
    return v ? v->desc : ViewDesc{};
}

Result<void> NullDevice::write_buffer(BufferHandle buffer, uint64_t offset, std::span<const std::byte> bytes) {
    Buffer* b = find(buffer);
    if (!b) return Error{"write_buffer: stale buffer handle"};
    if (offset > b->bytes.size() || bytes.size() > b->bytes.size() - offset)
        return Error{"write_buffer: past the end of '" + b->label + "'"};
    // A span may be empty and its data null.
    if (!bytes.empty()) std::memcpy(b->bytes.data() + offset, bytes.data(), bytes.size());
    line("write '" + b->label + "'+" + std::to_string(offset) + " " + std::to_string(bytes.size()) + " B");
    return {};
}

Result<void> NullDevice::write_texture(const TextureWrite& write, std::span<const std::byte> bytes) {
    // Through the encoder's copy, so there is one walk over rows.
    const Texture* t = find(write.place.texture);
    if (!t) return Error{"write_texture: stale texture handle"};
    const RowLayout rows = row_layout(t->desc.format, write.size, write.bytes_per_row, write.rows_per_layer);
    if (bytes.size() < rows.total_bytes) return Error{"write_texture: too few bytes for '" + t->label + "'"};
    const BufferHandle staging =
        buffers_.insert({.label = "staging", .desc = {}, .bytes = {bytes.begin(), bytes.end()}});
    NullEncoder encoder(*this, "write");
    encoder.copy_buffer_to_texture(
        {.buffer = staging, .bytes_per_row = write.bytes_per_row, .rows_per_layer = write.rows_per_layer}, write.place,
        write.size);
    encoder.run();
    buffers_.remove(staging);
    line("write '" + t->label + "' mip " + std::to_string(write.place.mip) + " " + name(write.before) + " -> " +
         name(write.after));
    return {};
}

std::unique_ptr<CommandEncoder> NullDevice::create_encoder(std::string_view label) {
    return std::make_unique<NullEncoder>(*this, label);
}

Result<SubmitId> NullDevice::submit(std::unique_ptr<CommandEncoder> encoder) {
    auto* own = dynamic_cast<NullEncoder*>(encoder.get());
    if (!own) return Error{"submit: not an encoder of this device"};
    ++submits_;
    line("submit " + std::to_string(submits_) + " '" + own->label() + "'");
    trace_ += own->run();
    return submits_;
}

Result<void> NullDevice::wait(SubmitId id) {
    if (id > submits_) return Error{"wait: submit " + std::to_string(id) + " was never made"};
    return {};
}

Result<std::span<std::byte>> NullDevice::map(BufferHandle buffer) {
    Buffer* b = find(buffer);
    if (!b) return Error{"map: stale buffer handle"};
    if (b->desc.memory == MemoryKind::Device) return Error{"map: '" + b->label + "' is in device memory"};
    line("map '" + b->label + "'");
    return std::span(b->bytes);
}

void NullDevice::unmap(BufferHandle buffer) {
    if (const Buffer* b = find(buffer)) line("unmap '" + b->label + "'");
}

MemoryStats NullDevice::memory_stats() const {
    MemoryStats out;
    buffers_.for_each([&](BufferHandle, const Buffer& b) {
        out.used_bytes += b.bytes.size();
        ++out.resources;
    });
    textures_.for_each([&](TextureHandle, const Texture& t) {
        for (const auto& bytes : t.subresources) out.used_bytes += bytes.size();
        ++out.resources;
    });
    out.device_bytes = out.used_bytes;
    out.peak_used_bytes = std::max(out.used_bytes, peak_bytes_);
    return out;
}

uint32_t NullDevice::live_handle_count() const {
    uint32_t count = heaps_.size() + buffers_.size() + textures_.size() + samplers_.size() + shaders_.size() +
                     groups_.size() + layouts_.size() + compute_.size() + render_.size() + trace_pipelines_.size() +
                     queries_.size() + surfaces_.size();
    views_.for_each([&](ViewHandle, const View& v) { count += v.whole ? 0 : 1; });
    group_layouts_.for_each([&](BindGroupLayout, const GroupLayout& l) { count += l.owned ? 0 : 1; });
    return count;
}

std::string NullDevice::live_handles() const {
    std::string out;
    const auto list = [&](const auto& map, std::string_view kind) {
        map.for_each([&](auto, const auto& object) { out += std::string(kind) + " '" + object.label + "'\n"; });
    };
    list(heaps_, "heap");
    list(buffers_, "buffer");
    list(textures_, "texture");
    views_.for_each([&](ViewHandle, const View& v) {
        if (!v.whole) out += "view '" + v.label + "'\n";
    });
    list(samplers_, "sampler");
    list(shaders_, "shader module");
    group_layouts_.for_each([&](BindGroupLayout, const GroupLayout& l) {
        if (!l.owned) out += "bind group layout '" + l.label + "'\n";
    });
    list(groups_, "bind group");
    list(layouts_, "pipeline layout");
    list(compute_, "compute pipeline");
    list(render_, "render pipeline");
    list(trace_pipelines_, "trace pipeline");
    list(queries_, "query set");
    list(surfaces_, "surface");
    return out;
}

}  // namespace kiln::rhi::null
