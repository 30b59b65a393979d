// SPDX-License-Identifier: MIT
// The null device: real bytes, readable trace.
#include "rhi_test.h"

#include "shaders/rhi_add.spv.h"

namespace kiln::rhi {

TEST_F(NullTest, BytesTravelThroughBuffersAndTextures) {
    Device& d = *device_;
    const BufferHandle a = must(d.create_buffer({.size = 1024, .label = "a"}));
    const TextureHandle v = must(
        d.create_texture({.dimension = Dimension::D3, .format = Format::R16Uint, .size = {4, 3, 2}, .label = "v"}));
    const TextureHandle w = must(
        d.create_texture({.dimension = Dimension::D3, .format = Format::R16Uint, .size = {4, 3, 2}, .label = "w"}));
    const BufferHandle back = must(d.create_buffer(
        {.size = 1024, .usage = BufferUsage::CopyDst, .memory = MemoryKind::Readback, .label = "back"}));
    std::vector<uint16_t> texels(24);
    for (uint16_t i = 0; i < 24; ++i) texels[i] = uint16_t(1000 + i);
    must(d.write_buffer(a, 32, bytes_of(texels)));
    auto e = d.create_encoder("travel");
    barrier(*e, {.texture = v, .after = Access::CopyWrite});
    barrier(*e, {.texture = w, .after = Access::CopyWrite});
    e->copy_buffer_to_texture({.buffer = a, .offset = 32}, {.texture = v}, {4, 3, 2});
    e->clear_texture(w, {9, 0, 0, 0});
    barrier(*e, {.texture = v, .before = Access::CopyWrite, .after = Access::CopyRead});
    barrier(*e, {.texture = w, .before = Access::CopyWrite, .after = Access::CopyWrite});
    e->copy_texture({.texture = v, .origin = {1, 0, 1}}, {.texture = w, .origin = {0, 1, 0}}, {2, 2, 1});
    barrier(*e, {.texture = w, .before = Access::CopyWrite, .after = Access::CopyRead});
    e->copy_texture_to_buffer({.texture = w}, {.buffer = back, .bytes_per_row = 16}, {4, 3, 1});
    barrier(*e, {.buffer = back, .before = Access::CopyWrite, .after = Access::HostRead});
    must(d.wait(must(d.submit(std::move(e)))));
    const std::vector<uint16_t> seen = mapped<uint16_t>(d, back, 24);
    // Slice 1 of v begins at 1012; its texel (1, 0) goes to (0, 1) of w.
    const std::vector<uint16_t> expected{9, 9, 9, 9, 0,    0,    0, 0, 1013, 1014, 9, 9,
                                         0, 0, 0, 0, 1017, 1018, 9, 9, 0,    0,    0, 0};
    EXPECT_EQ(seen, expected);
    for (const BufferHandle b : {a, back}) d.destroy(b);
    d.destroy(v);
    d.destroy(w);
}

TEST_F(NullTest, TraceReadsLikeTheFrame) {
    Device& d = *device_;
    const BufferHandle in = must(d.create_buffer({.size = 256, .label = "in"}));
    const BufferHandle out = must(d.create_buffer({.size = 256, .label = "out"}));
    const ShaderModule shader = must(d.create_shader_module({.spirv = kRhiAddSpv, .label = "add"}));
    const ComputePipeline p = must(d.create_compute_pipeline({.shader = shader, .label = "add"}));
    const BindGroupEntry entries[] = {{.binding = 0, .buffer = in}, {.binding = 1, .buffer = out}};
    const BindGroup g =
        must(d.create_bind_group({.layout = d.group_layout(p, 0), .entries = entries, .label = "in out"}));
    const std::string before = d.trace();
    auto e = d.create_encoder("frame");
    ComputePass& pass = e->begin_compute("add");
    pass.set_pipeline(p);
    pass.set_bind_group(0, g);
    pass.set_push_struct(std::array<uint32_t, 4>{});
    pass.dispatch(4);
    pass.end();
    barrier(*e,
            {.buffer = out, .before = Access::StorageWriteCompute, .after = Access::CopyRead | Access::UniformRead});
    EXPECT_FALSE(d.submit(std::move(e)));  // no Uniform usage: refused
    e = d.create_encoder("frame");
    ComputePass& again = e->begin_compute("add");
    again.set_pipeline(p);
    again.set_bind_group(0, g);
    again.set_push_struct(std::array<uint32_t, 4>{});
    again.dispatch(4);
    again.end();
    barrier(
        *e,
        {.buffer = out, .before = Access::StorageWriteCompute, .after = Access::CopyRead | Access::StorageReadCompute});
    must(d.submit(std::move(e)));
    EXPECT_TRUE(complained("lacks the usage for UniformRead"));
    EXPECT_EQ(d.trace().substr(before.size()),
              "submit 1 'frame'\n"
              "  compute 'add'\n"
              "    pipeline 'add'\n"
              "    group 0 'in out'\n"
              "    push 16 B\n"
              "    dispatch 4x1x1\n"
              "  end\n"
              "  barrier 'out' StorageWriteCompute -> StorageReadCompute|CopyRead\n");
}

// Groups are shared between pipelines, so their layouts must be the same object when their entries are.
TEST_F(NullTest, EqualBindingsShareOneLayout) {
    Device& d = *device_;
    const ShaderModule shader = must(d.create_shader_module({.spirv = kRhiAddSpv, .label = "add"}));
    const ComputePipeline p = must(d.create_compute_pipeline({.shader = shader, .label = "one"}));
    const ComputePipeline q = must(d.create_compute_pipeline({.shader = shader, .label = "two"}));
    EXPECT_EQ(d.group_layout(p, 0), d.group_layout(q, 0));
    EXPECT_EQ(d.pipelines_created(), 2u);
    d.destroy(shader);
    d.destroy(p);
    d.destroy(q);
}

}  // namespace kiln::rhi
