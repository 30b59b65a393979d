// SPDX-License-Identifier: MIT
#include "rhi/validate/rules.h"

#include "base/format.h"
#include "rhi/binding_counts.h"
#include "rhi/texture_math.h"

#include <bit>

namespace kiln::rhi::validate {

namespace {

struct Needed {
    Access access;
    BufferUsage buffer;    // None: buffers can't be accessed so
    TextureUsage texture;  // None: textures can't
};

constexpr Needed kNeeded[] = {
    {Access::IndirectRead, BufferUsage::Indirect, TextureUsage::None},
    {Access::IndexRead, BufferUsage::Index, TextureUsage::None},
    {Access::VertexRead, BufferUsage::Vertex, TextureUsage::None},
    {Access::UniformRead, BufferUsage::Uniform, TextureUsage::None},
    {Access::SampledReadGraphics, BufferUsage::None, TextureUsage::Sampled},
    {Access::SampledReadCompute, BufferUsage::None, TextureUsage::Sampled},
    {Access::StorageReadGraphics, BufferUsage::Storage, TextureUsage::Storage},
    {Access::StorageReadCompute, BufferUsage::Storage, TextureUsage::Storage},
    {Access::StorageWriteGraphics, BufferUsage::Storage, TextureUsage::Storage},
    {Access::StorageWriteCompute, BufferUsage::Storage, TextureUsage::Storage},
    {Access::ColorWrite, BufferUsage::None, TextureUsage::Color},
    {Access::DepthRead, BufferUsage::None, TextureUsage::Depth},
    {Access::DepthWrite, BufferUsage::None, TextureUsage::Depth},
    {Access::CopyRead, BufferUsage::CopySrc, TextureUsage::CopySrc},
    {Access::BoxesRead, BufferUsage::Boxes, TextureUsage::None},
    {Access::BoxTreeWrite, BufferUsage::BoxTree, TextureUsage::None},
    {Access::BoxTreeRead, BufferUsage::BoxTree, TextureUsage::None},
    {Access::CopyWrite, BufferUsage::CopyDst | BufferUsage::QueryResolve, TextureUsage::CopyDst},
};

std::string check_set(Access access) {
    if (writes(access) && !std::has_single_bit(uint32_t(access)))
        return formatted("{}: a write stands alone", name(access));
    return {};
}

}  // namespace

std::string check_access(Access access, const BufferInfo& b) {
    if (std::string fault = check_set(access); !fault.empty()) return fault;
    for (const Needed& n : kNeeded)
        if (any(access & n.access) && !any(b.desc.usage & n.buffer))
            return formatted("buffer '{}' lacks the usage for {}", b.label, name(n.access));
    if (any(access & Access::HostRead) && b.desc.memory != MemoryKind::Readback)
        return formatted("buffer '{}' is not readback memory", b.label);
    if (any(access & Access::Present)) return formatted("buffer '{}' can't be presented", b.label);
    return {};
}

std::string check_access(Access access, const TextureInfo& t) {
    if (std::string fault = check_set(access); !fault.empty()) return fault;
    for (const Needed& n : kNeeded)
        if (any(access & n.access) && !any(t.desc.usage & n.texture))
            return formatted("texture '{}' lacks the usage for {}", t.label, name(n.access));
    if (any(access & Access::HostRead) || (any(access & Access::Present) && !t.shown))
        return formatted("texture '{}' can't be accessed as {}", t.label, name(access));
    if (is_depth(t.desc.format) && any(access & Access::CopyRead) && access != Access::CopyRead)
        return formatted("texture '{}': CopyRead of a depth texture stands alone", t.label);
    return {};
}

std::string check_region(const TextureInfo& t, const TexturePlace& p, Extent size) {
    if (p.mip >= t.desc.mips) return formatted("texture '{}' has no mip {}", t.label, p.mip);
    const Extent e = mip_extent(t.desc, p.mip);
    const auto fits = [](uint32_t at, uint32_t length, uint32_t whole) { return at <= whole && length <= whole - at; };
    if (!fits(p.origin.x, size.width, e.width) || !fits(p.origin.y, size.height, e.height) ||
        !fits(p.origin.z, size.depth, e.depth))
        return formatted("{}x{}x{} at {},{},{} goes past mip {} of texture '{}' ({}x{}x{})", size.width, size.height,
                         size.depth, p.origin.x, p.origin.y, p.origin.z, p.mip, t.label, e.width, e.height, e.depth);
    if (size.width == 0 || size.height == 0 || size.depth == 0)
        return formatted("texture '{}': an empty copy", t.label);
    return {};
}

std::string check_rows(const TextureInfo& t, const BufferLayout& l, Extent size, uint64_t buffer_bytes,
                       const Limits& limits) {
    const uint32_t texel = bytes_per_texel(t.desc.format);
    if (l.bytes_per_row != 0 && (l.bytes_per_row % texel != 0 || l.bytes_per_row < size.width * texel))
        return formatted("bytes_per_row {}: not whole texels of {} B, or less than the {} texels of a row",
                         l.bytes_per_row, texel, size.width);
    if (l.bytes_per_row % limits.copy_row_alignment != 0)
        return formatted("bytes_per_row {} is not a multiple of {}", l.bytes_per_row, limits.copy_row_alignment);
    if (l.rows_per_layer != 0 && l.rows_per_layer < size.height)
        return formatted("rows_per_layer {} is less than the {} rows of the copy", l.rows_per_layer, size.height);
    if (l.offset % texel != 0 || l.offset % limits.copy_offset_alignment != 0)
        return formatted("buffer offset {} is not a multiple of the texel's {} B and of {}", l.offset, texel,
                         limits.copy_offset_alignment);
    const RowLayout rows = row_layout(t.desc.format, size, l.bytes_per_row, l.rows_per_layer);
    if (l.offset > buffer_bytes || rows.total_bytes > buffer_bytes - l.offset)
        return formatted("{} B at offset {} go past the end of the buffer ({} B)", rows.total_bytes, l.offset,
                         buffer_bytes);
    return {};
}

std::string check_counts(std::span<const std::vector<BindGroupLayoutEntry>> groups) {
    if (groups.size() > kMaxBindGroups)
        return formatted("{} bind groups, the floor is {}", groups.size(), kMaxBindGroups);
    for (const ShaderStage stage : kStages) {
        BindingCounts counts;
        for (const auto& entries : groups)
            for (const BindGroupLayoutEntry& e : entries)
                if (any(e.stages & stage)) counts.add(e.kind);
        for (const BindingCounts::Row& row : counts.rows())
            if (row.is > row.most) return formatted("{} {} in a stage, the floor is {}", row.is, row.what, row.most);
    }
    return {};
}

bool overlap(const Subresources& a, const Subresources& b) {
    return a.base_mip < b.base_mip + b.mip_count && b.base_mip < a.base_mip + a.mip_count &&
           a.base_layer < b.base_layer + b.layer_count && b.base_layer < a.base_layer + a.layer_count;
}

Access access_of(const BindGroupLayoutEntry& slot, bool compute) {
    switch (slot.kind) {
    case BindingKind::UniformBuffer:
        return Access::UniformRead;
    case BindingKind::StorageBuffer:
    case BindingKind::StorageTexture:
        return compute ? Access::StorageWriteCompute : Access::StorageWriteGraphics;
    case BindingKind::StorageBufferReadOnly:
    case BindingKind::StorageTextureReadOnly:
        return compute ? Access::StorageReadCompute : Access::StorageReadGraphics;
    case BindingKind::SampledTexture:
        return compute ? Access::SampledReadCompute : Access::SampledReadGraphics;
    case BindingKind::BoxTree:
        return Access::BoxTreeRead;
    case BindingKind::Sampler:
        break;
    }
    return Access::Undefined;
}

}  // namespace kiln::rhi::validate
