// SPDX-License-Identifier: MIT
// Checks commands as they are recorded, notes who touches what for the tracker, and passes good ones on. After the first
// fault the encoder passes nothing on: submit() answers with that fault.
#pragma once

#include "rhi/validate/device.h"

namespace kiln::rhi::validate {

class ValidateEncoder final : public CommandEncoder, private ComputePass, private RenderPass {
public:
    ValidateEncoder(ValidateDevice& device, std::unique_ptr<CommandEncoder> below, std::string_view label);

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
    void barrier(BarrierKey key, std::span<const Barrier> barriers) override;
    void write_timestamp(QuerySet set, uint32_t index) override;
    void resolve_queries(QuerySet set, uint32_t first, uint32_t count, BufferHandle dst, uint64_t offset) override;
    void push_label(std::string_view label) override;
    void pop_label() override;

    // For submit().
    void finish();
    const std::string& error() const { return error_; }
    const Recording& recording() const { return recording_; }
    std::unique_ptr<CommandEncoder> take_below() { return std::move(below_); }

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

    enum class In : uint8_t { Nothing, Compute, Render };

    // Starts a step called `text`; false when nothing may be recorded here any more.
    bool step(std::string text, In where);
    // Reports `sentence` if there is one. True when all is well.
    bool good(const std::string& sentence);
    bool fault(const std::string& sentence) { return good(sentence), false; }
    template <typename H, typename T>
    T* find(Table<H, T>& table, H handle) {
        T* out = table.find(handle);
        if (!out) fault(table.why_not(handle));
        return out;
    }
    void note(const Use& use);       // a use by this step alone
    bool scope_add(const Use& use);  // a use by the running dispatch or render pass
    void scope_end();
    bool bind_all(const PipelineInfo& pipeline, bool compute);
    bool indirect(BufferHandle buffer, uint64_t offset, uint64_t bytes);
    bool ready_to_draw(bool indexed, bool mesh = false);
    Use whole(BufferHandle b, Access a) const { return {.buffer = b, .texture = {}, .range = {}, .access = a}; }
    Use part(const TexturePlace& place, const TextureInfo& t, Extent size, Access a) const;

    struct BoundGroup {
        BindGroup group;
        std::vector<uint32_t> offsets;
    };

    ValidateDevice& device_;
    Objects& objects_;
    std::unique_ptr<CommandEncoder> below_;
    std::string label_;
    std::string error_;
    Recording recording_;

    In in_ = In::Nothing;
    bool finished_ = false;
    int labels_ = 0;
    std::string pass_;
    uint32_t steps_in_pass_ = 0;
    ComputePass* compute_below_ = nullptr;
    RenderPass* render_below_ = nullptr;

    std::vector<Use> scope_;
    ComputePipeline compute_;
    RenderPipeline render_;
    TracePipeline trace_;
    std::array<BoundGroup, kMaxBindGroups> groups_;
    uint32_t push_bytes_ = 0;
    std::vector<Format> color_formats_;
    Format depth_format_ = Format::Undefined;
    bool depth_read_only_ = false;
    std::vector<BufferHandle> vertex_buffers_;
    BufferHandle index_buffer_;
};

}  // namespace kiln::rhi::validate
