// SPDX-License-Identifier: MIT
#include "rhi/null/commands.h"

#include <bit>
#include <cmath>
#include <concepts>
#include <cstring>

namespace kiln::rhi::null {

namespace {

std::string number(std::unsigned_integral auto n) { return std::to_string(n); }
std::string number(float n) {
    char text[32];
    std::snprintf(text, sizeof text, "%g", double(n));
    return text;
}
std::string size_text(Extent e) { return number(e.width) + "x" + number(e.height) + "x" + number(e.depth); }

std::string range_text(const TextureDesc& d, const Subresources& given) {
    const Subresources r = resolved(d, given);
    std::string out;
    if (r.base_mip != 0 || r.mip_count != d.mips) out += " mips " + number(r.base_mip) + "+" + number(r.mip_count);
    if (r.base_layer != 0 || r.layer_count != layer_count(d))
        out += " layers " + number(r.base_layer) + "+" + number(r.layer_count);
    return out;
}

// IEEE 754 binary16, to nearest even.
uint16_t to_half(float f) {
    const uint32_t bits = std::bit_cast<uint32_t>(f);
    const uint32_t sign = bits >> 16 & 0x8000u;
    const float magnitude = std::fabs(f);
    if (!(magnitude <= 65519.99f)) return uint16_t(sign | (std::isnan(f) ? 0x7e00u : 0x7c00u));
    if (magnitude < 6.103515625e-05f) return uint16_t(sign | uint32_t(std::nearbyint(magnitude * 16777216.0f)));
    const uint32_t m = std::bit_cast<uint32_t>(magnitude);
    return uint16_t(sign | ((m + 0xfffu + (m >> 13 & 1u) - (112u << 23)) >> 13));
}

// Bytes of one texel of a clear colour.
std::array<std::byte, 16> texel(Format format, const std::array<float, 4>& v) {
    std::array<std::byte, 16> out{};
    const auto put = [&](auto value, uint32_t at) {
        std::memcpy(out.data() + at * sizeof value, &value, sizeof value);
    };
    for (uint32_t i = 0; i < info(format).channels; ++i) {
        switch (format) {
        case Format::R8Snorm:
            put(int8_t(std::lround(std::clamp(v[i], -1.0f, 1.0f) * 127.0f)), i);
            break;
        case Format::Rgba8Unorm:
            put(uint8_t(std::lround(std::clamp(v[i], 0.0f, 1.0f) * 255.0f)), i);
            break;
        case Format::R16Uint:
            put(uint16_t(std::lround(v[i])), i);
            break;
        case Format::R16Float:
        case Format::Rg16Float:
        case Format::Rgba16Float:
            put(to_half(v[i]), i);
            break;
        case Format::R32Uint:
        case Format::Rg32Uint:
        case Format::Rgba32Uint:
            put(uint32_t(std::llround(v[i])), i);
            break;
        case Format::R32Float:
        case Format::Rgba32Float:
        case Format::Depth32Float:
            put(v[i], i);
            break;
        case Format::R11g11b10Float: {
            // Halves without sign and with their low mantissa bits cut off.
            const auto h = [&](uint32_t c) { return v[c] > 0.0f ? uint32_t(to_half(v[c])) : 0u; };
            put(h(0) >> 4 | (h(1) >> 4) << 11 | (h(2) >> 5) << 22, 0);
            break;
        }
        case Format::Rgba8Srgb:   // never cleared: sampled and copied only
        case Format::Bgra8Unorm:  // never cleared: copied only
        case Format::Undefined:
            break;
        }
    }
    return out;
}

// Calls row(texel row inside the subresource's bytes, row's bytes, row's offset in buffer bytes, layer or slice index).
template <typename F>
void for_each_row(Texture& texture, const TexturePlace& place, Extent size, const RowLayout& rows, F&& row) {
    const Extent whole = mip_extent(texture.desc, place.mip);
    const uint64_t texel_bytes = bytes_per_texel(texture.desc.format);
    const bool volume = texture.desc.dimension == Dimension::D3;
    for (uint32_t z = 0; z < size.depth; ++z) {
        std::vector<std::byte>& bytes = NullDevice::bytes_of(texture, place.mip, volume ? 0 : place.origin.z + z);
        const uint64_t slice = volume ? place.origin.z + z : 0;
        for (uint32_t y = 0; y < size.height; ++y) {
            const uint64_t at =
                ((slice * whole.height + place.origin.y + y) * whole.width + place.origin.x) * texel_bytes;
            const uint64_t length = size.width * texel_bytes;
            if (at + length <= bytes.size())
                row(std::span(bytes).subspan(at, length), rows.bytes_per_layer * z + rows.bytes_per_row * y);
        }
    }
}

}  // namespace

template <typename H>
std::string NullEncoder::named(H handle) {
    const auto* object = device_.find(handle);
    return object ? "'" + object->label + "'" : "stale";
}

std::string NullEncoder::named(const TexturePlace& p) {
    return named(p.texture) + " mip " + number(p.mip) + " at " + number(p.origin.x) + "," + number(p.origin.y) + "," +
           number(p.origin.z);
}

std::string NullEncoder::run() {
    for (const auto& work : work_) work();
    return std::move(text_);
}

ComputePass& NullEncoder::begin_compute(std::string_view label) {
    line("compute '" + std::string(label) + "'");
    indent_ += 2;
    return *this;
}

RenderPass& NullEncoder::begin_render(const RenderPassDesc& desc) {
    const auto load = [](Load l) { return l == Load::Load ? " load" : l == Load::Clear ? " clear" : " any"; };
    std::string text = "render '" + std::string(desc.label) + "'";
    for (const ColorAttachment& c : desc.colors) text += " color " + named(c.view) + load(c.load);
    if (desc.depth.view)
        text += std::string(desc.depth.read_only ? " depth-read " : " depth ") + named(desc.depth.view) +
                load(desc.depth.load);
    line(text);
    indent_ += 2;
    return *this;
}

void NullEncoder::end() {
    indent_ -= 2;
    line("end");
}

void NullEncoder::copy_buffer(BufferHandle src, uint64_t src_offset, BufferHandle dst, uint64_t dst_offset,
                              uint64_t size) {
    line("copy " + named(src) + "+" + number(src_offset) + " -> " + named(dst) + "+" + number(dst_offset) + " " +
         number(size) + " B");
    work_.push_back([=, this] {
        Buffer* from = device_.find(src);
        Buffer* to = device_.find(dst);
        if (!from || !to || src_offset + size > from->bytes.size() || dst_offset + size > to->bytes.size()) return;
        std::memmove(to->bytes.data() + dst_offset, from->bytes.data() + src_offset, size);
    });
}

void NullEncoder::copy_buffer_to_texture(const BufferLayout& src, const TexturePlace& dst, Extent size) {
    line("copy " + named(src.buffer) + "+" + number(src.offset) + " -> " + named(dst) + " " + size_text(size));
    work_.push_back([=, this] {
        Buffer* from = device_.find(src.buffer);
        Texture* to = device_.find(dst.texture);
        if (!from || !to) return;
        const RowLayout rows = row_layout(to->desc.format, size, src.bytes_per_row, src.rows_per_layer);
        if (src.offset + rows.total_bytes > from->bytes.size()) return;
        for_each_row(*to, dst, size, rows, [&](std::span<std::byte> texels, uint64_t at) {
            std::memcpy(texels.data(), from->bytes.data() + src.offset + at, texels.size());
        });
    });
}

void NullEncoder::copy_texture_to_buffer(const TexturePlace& src, const BufferLayout& dst, Extent size) {
    line("copy " + named(src) + " -> " + named(dst.buffer) + "+" + number(dst.offset) + " " + size_text(size));
    work_.push_back([=, this] {
        Texture* from = device_.find(src.texture);
        Buffer* to = device_.find(dst.buffer);
        if (!from || !to) return;
        const RowLayout rows = row_layout(from->desc.format, size, dst.bytes_per_row, dst.rows_per_layer);
        if (dst.offset + rows.total_bytes > to->bytes.size()) return;
        for_each_row(*from, src, size, rows, [&](std::span<std::byte> texels, uint64_t at) {
            std::memcpy(to->bytes.data() + dst.offset + at, texels.data(), texels.size());
        });
    });
}

void NullEncoder::copy_texture(const TexturePlace& src, const TexturePlace& dst, Extent size) {
    line("copy " + named(src) + " -> " + named(dst) + " " + size_text(size));
    work_.push_back([=, this] {
        Texture* from = device_.find(src.texture);
        Texture* to = device_.find(dst.texture);
        if (!from || !to || bytes_per_texel(from->desc.format) != bytes_per_texel(to->desc.format)) return;
        const RowLayout rows = row_layout(from->desc.format, size, 0, 0);
        std::vector<std::byte> between(rows.total_bytes);
        for_each_row(*from, src, size, rows, [&](std::span<std::byte> texels, uint64_t at) {
            std::memcpy(between.data() + at, texels.data(), texels.size());
        });
        for_each_row(*to, dst, size, rows, [&](std::span<std::byte> texels, uint64_t at) {
            std::memcpy(texels.data(), between.data() + at, texels.size());
        });
    });
}

void NullEncoder::clear_buffer(BufferHandle buffer, uint64_t offset, uint64_t size, uint32_t word) {
    line("clear " + named(buffer) + "+" + number(offset) + " " + (size == kWholeSize ? "all" : number(size) + " B") +
         " = " + number(word));
    work_.push_back([=, this] {
        Buffer* b = device_.find(buffer);
        if (!b || offset > b->bytes.size()) return;
        const uint64_t end = size == kWholeSize ? b->bytes.size() : std::min<uint64_t>(b->bytes.size(), offset + size);
        for (uint64_t at = offset; at + 4 <= end; at += 4) std::memcpy(b->bytes.data() + at, &word, 4);
    });
}

void NullEncoder::clear_texture(TextureHandle texture, std::array<float, 4> value, Subresources range) {
    const Texture* t = device_.find(texture);
    line("clear " + named(texture) + (t ? range_text(t->desc, range) : "") + " = " + number(value[0]) + " " +
         number(value[1]) + " " + number(value[2]) + " " + number(value[3]));
    work_.push_back([=, this] {
        Texture* to = device_.find(texture);
        if (!to) return;
        const Subresources r = resolved(to->desc, range);
        const std::array<std::byte, 16> pattern = texel(to->desc.format, value);
        const uint32_t step = bytes_per_texel(to->desc.format);
        for (uint32_t layer = r.base_layer; layer < r.base_layer + r.layer_count; ++layer)
            for (uint32_t mip = r.base_mip; mip < r.base_mip + r.mip_count; ++mip) {
                std::vector<std::byte>& bytes = NullDevice::bytes_of(*to, mip, layer);
                for (size_t at = 0; at + step <= bytes.size(); at += step)
                    std::memcpy(bytes.data() + at, pattern.data(), step);
            }
    });
}

void NullEncoder::build_box_tree(BufferHandle tree, BufferHandle boxes, uint64_t offset, uint32_t count) {
    line("build " + named(tree) + " of " + number(count) + " boxes " + named(boxes) + "+" + number(offset));
}

void NullEncoder::barrier(BarrierKey, std::span<const Barrier> barriers) {
    for (const Barrier& b : barriers) {
        std::string text = "barrier ";
        if (b.buffer) text += named(b.buffer);
        if (b.texture) {
            const Texture* t = device_.find(b.texture);
            text += named(b.texture) + (t ? range_text(t->desc, b.range) : "");
        }
        text += " " + name(b.before) + " -> " + name(b.after);
        if (any(b.alias_before)) text += " after " + name(b.alias_before);
        line(text);
    }
}

void NullEncoder::write_timestamp(QuerySet set, uint32_t index) {
    line("timestamp " + named(set) + " " + number(index));
    work_.push_back([=, this] {
        if (Queries* q = device_.find(set); q && index < q->ticks.size()) q->ticks[index] = device_.tick();
    });
}

void NullEncoder::resolve_queries(QuerySet set, uint32_t first, uint32_t count, BufferHandle dst, uint64_t offset) {
    line("resolve " + named(set) + " " + number(first) + "+" + number(count) + " -> " + named(dst) + "+" +
         number(offset));
    work_.push_back([=, this] {
        const Queries* q = device_.find(set);
        Buffer* to = device_.find(dst);
        if (!q || !to || uint64_t{first} + count > q->ticks.size() || offset + count * 8ull > to->bytes.size()) return;
        std::memcpy(to->bytes.data() + offset, q->ticks.data() + first, count * 8ull);
    });
}

void NullEncoder::set_pipeline(ComputePipeline pipeline) { line("pipeline " + named(pipeline)); }
void NullEncoder::set_pipeline(RenderPipeline pipeline) { line("pipeline " + named(pipeline)); }
void NullEncoder::set_pipeline(TracePipeline pipeline) { line("pipeline " + named(pipeline)); }
void NullEncoder::set_bind_group(uint32_t index, BindGroup group, std::span<const uint32_t> dynamic_offsets) {
    std::string text = "group " + number(index) + " " + named(group);
    for (const uint32_t offset : dynamic_offsets) text += " +" + number(offset);
    line(text);
}
void NullEncoder::set_push(std::span<const std::byte> bytes) { line("push " + number(bytes.size()) + " B"); }
void NullEncoder::dispatch(uint32_t x, uint32_t y, uint32_t z) { line("dispatch " + size_text({x, y, z})); }
void NullEncoder::dispatch_indirect(BufferHandle buffer, uint64_t offset) {
    line("dispatch indirect " + named(buffer) + "+" + number(offset));
}
void NullEncoder::trace(uint32_t width, uint32_t height) { line("trace " + number(width) + "x" + number(height)); }
void NullEncoder::set_vertex_buffer(uint32_t slot, BufferHandle buffer, uint64_t offset) {
    line("vertices " + number(slot) + " " + named(buffer) + "+" + number(offset));
}
void NullEncoder::set_index_buffer(BufferHandle buffer, bool is_32_bit, uint64_t offset) {
    line("indices " + named(buffer) + "+" + number(offset) + (is_32_bit ? " u32" : " u16"));
}
void NullEncoder::set_viewport(float x, float y, float width, float height, float depth_min, float depth_max) {
    line("viewport " + number(x) + " " + number(y) + " " + number(width) + " " + number(height) + " depth " +
         number(depth_min) + ".." + number(depth_max));
}
void NullEncoder::set_scissor(uint32_t x, uint32_t y, uint32_t width, uint32_t height) {
    line("scissor " + number(x) + " " + number(y) + " " + number(width) + " " + number(height));
}
void NullEncoder::set_blend_constant(std::array<float, 4> c) {
    line("blend constant " + number(c[0]) + " " + number(c[1]) + " " + number(c[2]) + " " + number(c[3]));
}
void NullEncoder::draw(uint32_t vertices, uint32_t instances, uint32_t first_vertex, uint32_t first_instance) {
    line("draw " + number(vertices) + " x" + number(instances) + " from " + number(first_vertex) + "," +
         number(first_instance));
}
void NullEncoder::draw_indexed(uint32_t indices, uint32_t instances, uint32_t first_index, int32_t base_vertex,
                               uint32_t first_instance) {
    line("draw indexed " + number(indices) + " x" + number(instances) + " from " + number(first_index) + "," +
         std::to_string(base_vertex) + "," + number(first_instance));
}
void NullEncoder::draw_indirect(BufferHandle buffer, uint64_t offset, uint32_t draws, uint32_t stride) {
    line("draw indirect " + named(buffer) + "+" + number(offset) + " x" + number(draws) + " stride " + number(stride));
}
void NullEncoder::draw_indexed_indirect(BufferHandle buffer, uint64_t offset, uint32_t draws, uint32_t stride) {
    line("draw indexed indirect " + named(buffer) + "+" + number(offset) + " x" + number(draws) + " stride " +
         number(stride));
}
void NullEncoder::draw_mesh_groups(uint32_t x, uint32_t y, uint32_t z) { line("mesh groups " + size_text({x, y, z})); }

}  // namespace kiln::rhi::null
