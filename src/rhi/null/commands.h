// SPDX-License-Identifier: MIT
// Records commands as text and as work on host bytes, done at submit.
#pragma once

#include "rhi/null/device.h"

namespace kiln::rhi::null {

class NullEncoder final : public CommandEncoder, private ComputePass, private RenderPass {
public:
    NullEncoder(NullDevice& device, std::string_view label) : device_(device), label_(label) {}

    ComputePass& begin_compute(std::string_view label) override;
    RenderPass& begin_render(const RenderPassDesc& desc) override;
    void copy_buffer(BufferHandle src, uint64_t src_offset, BufferHandle dst, uint64_t dst_offset,
                     uint64_t size) override;
    void copy_buffer_to_texture(const BufferLayout& src, const TexturePlace& dst, Extent size) override;
    void copy_texture_to_buffer(const TexturePlace& src, const BufferLayout& dst, Extent size) override;
    void copy_texture(const TexturePlace& src, const TexturePlace& dst, Extent size) override;
    void clear_buffer(BufferHandle buffer, uint64_t offset, uint64_t size, uint32_t word) override;
    void clear_texture(TextureHandle texture, std::array<float, 4> value, Subresources range) override;
    void build_box_tree(BufferHandle tree, BufferHandle boxes, uint64_t offset, uint32_t count) override;
    void barrier(BarrierKey, std::span<const Barrier> barriers) override;
    void write_timestamp(QuerySet set, uint32_t index) override;
    void resolve_queries(QuerySet set, uint32_t first, uint32_t count, BufferHandle dst, uint64_t offset) override;
    void push_label(std::string_view label) override { line("label '" + std::string(label) + "'"); }
    void pop_label() override { line("end label"); }

    // For submit(): does the work and hands over the text.
    std::string run();
    const std::string& label() const { return label_; }

private:
    // ComputePass and RenderPass
    void set_pipeline(ComputePipeline pipeline) override;
    void set_pipeline(RenderPipeline pipeline) override;
    void set_pipeline(TracePipeline pipeline) override;
    void set_bind_group(uint32_t index, BindGroup group, std::span<const uint32_t> dynamic_offsets) override;
    void set_push(std::span<const std::byte> bytes) override;
    void dispatch(uint32_t x, uint32_t y, uint32_t z) override;
    void dispatch_indirect(BufferHandle buffer, uint64_t offset) override;
    void trace(uint32_t width, uint32_t height) override;
    void set_vertex_buffer(uint32_t slot, BufferHandle buffer, uint64_t offset) override;
    void set_index_buffer(BufferHandle buffer, bool is_32_bit, uint64_t offset) override;
    void set_viewport(float x, float y, float width, float height, float depth_min, float depth_max) override;
    void set_scissor(uint32_t x, uint32_t y, uint32_t width, uint32_t height) override;
    void set_blend_constant(std::array<float, 4> rgba) override;
    void draw(uint32_t vertices, uint32_t instances, uint32_t first_vertex, uint32_t first_instance) override;
    void draw_indexed(uint32_t indices, uint32_t instances, uint32_t first_index, int32_t base_vertex,
                      uint32_t first_instance) override;
    void draw_indirect(BufferHandle buffer, uint64_t offset, uint32_t draws, uint32_t stride) override;
    void draw_indexed_indirect(BufferHandle buffer, uint64_t offset, uint32_t draws, uint32_t stride) override;
    void draw_mesh_groups(uint32_t x, uint32_t y, uint32_t z) override;
    void end() override;

    void line(const std::string& text) { text_ += std::string(indent_, ' ') + text + '\n'; }
    template <typename H>
    std::string named(H handle);
    std::string named(const TexturePlace& place);

    NullDevice& device_;
    std::string label_;
    std::string text_;
    size_t indent_ = 2;
    std::vector<std::function<void()>> work_;
};

}  // namespace kiln::rhi::null
