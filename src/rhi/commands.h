// SPDX-License-Identifier: MIT
// Recording of GPU work. An encoder records; Device::submit hands it to the queue. Commands run in order of recording,
// submissions in order of submission; memory is made visible between them by barriers only, and only the render graph
// makes barriers. One thread a recording. Wrong use is reported to the device's error sink and makes submit() fail.
#pragma once

#include "rhi/types.h"

#include <memory>

namespace kiln::render {
class Graph;
}

namespace kiln::rhi {

// Whoever makes barriers owns all of them: only the graph can make this key (and the tests of this module).
class BarrierKey {
    BarrierKey() {}
    friend class kiln::render::Graph;
    friend struct BarrierKeyForTests;
};

// Work touching the resource as `before` finishes, and its writes are visible, ahead of later work touching it as `after`.
// Exactly one of buffer and texture. The rules, which the validate decorator holds everyone to:
//  - a buffer that was just made (outside a heap) or written by write_buffer is settled: its first use needs no barrier, nor
//    do further reads. Everything else becomes usable by a barrier: with before = Undefined the old contents are lost;
//  - after a barrier the resource may be used as `after` says and no other way: a write once, reads any number of times;
//  - `before` of a buffer holds every access since its last barrier (or more); of a texture it is exactly that barrier's
//    `after`, or `after` of the write_texture since, because the texture's layout follows from it. Accesses that
//    before = Undefined would forget go to alias_before.
struct Barrier {
    BufferHandle buffer = {};
    TextureHandle texture = {};
    Subresources range = {};  // textures
    Access before = Access::Undefined;
    Access after = Access::Undefined;
    // With before = Undefined: accesses to finish first, of the resource itself or of those that had its memory before.
    Access alias_before = Access::Undefined;
};

struct BufferLayout {
    BufferHandle buffer = {};
    uint64_t offset = 0;
    uint32_t bytes_per_row = 0;   // 0: rows follow each other tightly
    uint32_t rows_per_layer = 0;  // 0: layers or slices follow each other tightly
};

struct Origin {
    uint32_t x = 0;
    uint32_t y = 0;
    uint32_t z = 0;  // slice of a D3 texture, layer of a D2Array
};

struct TexturePlace {
    TextureHandle texture = {};
    uint32_t mip = 0;
    Origin origin = {};
};

enum class Load : uint8_t { Load, Clear, DontCare };
enum class Store : uint8_t { Store, DontCare };

struct ColorAttachment {
    ViewHandle view = {};
    Load load = Load::Clear;
    Store store = Store::Store;
    std::array<float, 4> clear{};
};

struct DepthAttachment {
    ViewHandle view = {};  // none: no depth
    Load load = Load::Clear;
    Store store = Store::Store;
    float clear = 0.0f;      // far, in reversed depth
    bool read_only = false;  // then Access::DepthRead, and the texture may also be sampled in the pass
};

struct RenderPassDesc {
    std::span<const ColorAttachment> colors = {};
    DepthAttachment depth = {};
    std::string_view label = {};
};

class ComputePass {
public:
    virtual ~ComputePass() = default;
    virtual void set_pipeline(ComputePipeline pipeline) = 0;
    virtual void set_bind_group(uint32_t index, BindGroup group, std::span<const uint32_t> dynamic_offsets = {}) = 0;
    virtual void set_push(std::span<const std::byte> bytes) = 0;
    virtual void dispatch(uint32_t groups_x, uint32_t groups_y = 1, uint32_t groups_z = 1) = 0;
    virtual void dispatch_indirect(BufferHandle buffer, uint64_t offset) = 0;  // three uint32 group counts
    virtual void set_pipeline(TracePipeline pipeline) = 0;                     // in the place of a compute pipeline
    virtual void trace(uint32_t width, uint32_t height) = 0;
    virtual void end() = 0;

    template <typename T>
    void set_push_struct(const T& value) {
        set_push(std::as_bytes(std::span(&value, 1)));
    }
};

class RenderPass {
public:
    virtual ~RenderPass() = default;
    virtual void set_pipeline(RenderPipeline pipeline) = 0;
    virtual void set_bind_group(uint32_t index, BindGroup group, std::span<const uint32_t> dynamic_offsets = {}) = 0;
    virtual void set_push(std::span<const std::byte> bytes) = 0;
    virtual void set_vertex_buffer(uint32_t slot, BufferHandle buffer, uint64_t offset = 0) = 0;
    virtual void set_index_buffer(BufferHandle buffer, bool is_32_bit = true, uint64_t offset = 0) = 0;
    // Pixels, origin top left. Default: the whole attachment.
    virtual void set_viewport(float x, float y, float width, float height, float depth_min = 0,
                              float depth_max = 1) = 0;
    virtual void set_scissor(uint32_t x, uint32_t y, uint32_t width, uint32_t height) = 0;
    virtual void set_blend_constant(std::array<float, 4> rgba) = 0;
    virtual void draw(uint32_t vertices, uint32_t instances = 1, uint32_t first_vertex = 0,
                      uint32_t first_instance = 0) = 0;
    virtual void draw_indexed(uint32_t indices, uint32_t instances = 1, uint32_t first_index = 0,
                              int32_t base_vertex = 0, uint32_t first_instance = 0) = 0;
    virtual void draw_indirect(BufferHandle buffer, uint64_t offset, uint32_t draws = 1, uint32_t stride = 16) = 0;
    virtual void draw_indexed_indirect(BufferHandle buffer, uint64_t offset, uint32_t draws = 1,
                                       uint32_t stride = 20) = 0;
    // Workgroups of a pipeline with a mesh shader. Their triangles keep the order of the groups, x first.
    virtual void draw_mesh_groups(uint32_t groups_x, uint32_t groups_y = 1, uint32_t groups_z = 1) = 0;
    virtual void end() = 0;

    template <typename T>
    void set_push_struct(const T& value) {
        set_push(std::as_bytes(std::span(&value, 1)));
    }
};

class CommandEncoder {
public:
    virtual ~CommandEncoder() = default;

    // One pass at a time; nothing else is recorded until its end(). The reference lives until then.
    virtual ComputePass& begin_compute(std::string_view label) = 0;
    virtual RenderPass& begin_render(const RenderPassDesc& desc) = 0;

    // Sizes and offsets in bytes, multiples of 4 between buffers. Access: CopyRead of source, CopyWrite of destination.
    virtual void copy_buffer(BufferHandle src, uint64_t src_offset, BufferHandle dst, uint64_t dst_offset,
                             uint64_t size) = 0;
    virtual void copy_buffer_to_texture(const BufferLayout& src, const TexturePlace& dst, Extent size) = 0;
    virtual void copy_texture_to_buffer(const TexturePlace& src, const BufferLayout& dst, Extent size) = 0;
    virtual void copy_texture(const TexturePlace& src, const TexturePlace& dst, Extent size) = 0;
    // CopyWrite. Fills with a repeated 32-bit word.
    virtual void clear_buffer(BufferHandle buffer, uint64_t offset = 0, uint64_t size = kWholeSize,
                              uint32_t word = 0) = 0;
    // CopyWrite. Components as the format reads them: float formats take floats, uint formats the numbers rounded.
    virtual void clear_texture(TextureHandle texture, std::array<float, 4> value = {}, Subresources range = {}) = 0;

    // Makes `tree` one of `count` (at least 1) boxes from `offset` (a multiple of 8) of `boxes`: a shader finds them by
    // gl_PrimitiveID. What the tree was before is gone. BoxesRead of boxes, BoxTreeWrite of tree.
    virtual void build_box_tree(BufferHandle tree, BufferHandle boxes, uint64_t offset, uint32_t count) = 0;

    virtual void barrier(BarrierKey, std::span<const Barrier> barriers) = 0;

    virtual void write_timestamp(QuerySet set, uint32_t index) = 0;
    // 64-bit ticks (Limits::timestamp_period_ns each) into a QueryResolve buffer; CopyWrite. offset: multiple of 8.
    virtual void resolve_queries(QuerySet set, uint32_t first, uint32_t count, BufferHandle dst, uint64_t offset) = 0;

    virtual void push_label(std::string_view label) = 0;
    virtual void pop_label() = 0;
};

}  // namespace kiln::rhi
