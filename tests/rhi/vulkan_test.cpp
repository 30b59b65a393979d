// SPDX-License-Identifier: MIT
// The Vulkan backend on a real (or software) device, with the driver's validation and synchronisation validation on.
#include "rhi/vulkan/device.h"
#include "rhi_test.h"

#include "shaders/rhi_add.spv.h"
#include "shaders/rhi_count.spv.h"
#include "shaders/rhi_triangle_frag.spv.h"
#include "shaders/rhi_triangle_vert.spv.h"
#include "shaders/rhi_volume_sample.spv.h"
#include "shaders/rhi_volume_write.spv.h"

#include <cmath>

namespace kiln::rhi {

using VulkanGpu = VulkanTest;

struct AddPush {
    uint32_t scale, offset, count, pad;
};

TEST_F(VulkanGpu, ComputeComesBackRight) {
    Device& d = *device_;
    constexpr uint32_t kCount = 1000;
    std::vector<uint32_t> input(kCount);
    for (uint32_t i = 0; i < kCount; ++i) input[i] = i * 7;
    const BufferHandle in = must(d.create_buffer({.size = kCount * 4, .label = "in"}));
    const BufferHandle out = must(d.create_buffer({.size = kCount * 4, .label = "out"}));
    const BufferHandle back = must(d.create_buffer(
        {.size = kCount * 4, .usage = BufferUsage::CopyDst, .memory = MemoryKind::Readback, .label = "back"}));
    const ShaderModule shader = must(d.create_shader_module({.spirv = kRhiAddSpv, .label = "add"}));
    const ComputePipeline pipeline = must(d.create_compute_pipeline({.shader = shader, .label = "add"}));
    d.destroy(shader);
    const BindGroupEntry entries[] = {{.binding = 0, .buffer = in}, {.binding = 1, .buffer = out}};
    const BindGroup group =
        must(d.create_bind_group({.layout = d.group_layout(pipeline, 0), .entries = entries, .label = "add"}));

    must(d.write_buffer(in, 0, bytes_of(input)));
    auto e = d.create_encoder("add");
    ComputePass& pass = e->begin_compute("add");
    pass.set_bind_group(0, group);
    pass.set_push_struct(AddPush{3, 11, kCount, 0});
    pass.set_pipeline(pipeline);
    pass.dispatch((kCount + 63) / 64);
    pass.end();
    barrier(*e, {.buffer = out, .before = Access::StorageWriteCompute, .after = Access::CopyRead});
    e->copy_buffer(out, 0, back, 0, kCount * 4);
    barrier(*e, {.buffer = back, .before = Access::CopyWrite, .after = Access::HostRead});
    const SubmitId id = must(d.submit(std::move(e)));
    // Allowed at once: the device keeps them until the submit is done.
    d.destroy(in);
    d.destroy(group);
    d.destroy(pipeline);
    must(d.wait(id));
    EXPECT_TRUE(d.completed(id));
    const std::vector<uint32_t> result = mapped<uint32_t>(d, back, kCount);
    for (uint32_t i = 0; i < kCount; ++i) ASSERT_EQ(result[i], input[i] * 3 + 11) << i;
    d.destroy(out);
    d.destroy(back);
}

// The half-precision storage texture is the brick atlas; linear sampling of a volume is the march.
TEST_F(VulkanGpu, VolumeOfHalvesIsWrittenCopiedAndSampledSmoothly) {
    Device& d = *device_;
    if (!d.caps().storage_r16f) GTEST_SKIP() << "no storage textures of R16Float";
    const Extent size{20, 12, 8};
    const TextureHandle volume = must(
        d.create_texture({.dimension = Dimension::D3, .format = Format::R16Float, .size = size, .label = "volume"}));
    const BufferHandle back = must(d.create_buffer({.size = size.width * size.height * size.depth * 2,
                                                    .usage = BufferUsage::CopyDst,
                                                    .memory = MemoryKind::Readback,
                                                    .label = "texels"}));
    const ShaderModule write = must(d.create_shader_module({.spirv = kRhiVolumeWriteSpv, .label = "write"}));
    const ShaderModule sample = must(d.create_shader_module({.spirv = kRhiVolumeSampleSpv, .label = "sample"}));
    const ComputePipeline writer = must(d.create_compute_pipeline({.shader = write, .label = "write"}));
    const ComputePipeline sampler_pipeline = must(d.create_compute_pipeline({.shader = sample, .label = "sample"}));
    const SamplerHandle smooth = must(d.create_sampler({.label = "smooth"}));

    // Places in texels (a texel's middle is at +0.5), inside the middles of the outermost texels.
    std::vector<std::array<float, 4>> places;
    std::vector<float> expected;
    for (int i = 0; i < 200; ++i) {
        const float x = 0.5f + float(i % 19) + 0.37f, y = 0.5f + float(i % 11) * 0.9f, z = 0.5f + float(i % 7) * 0.71f;
        places.push_back({x / float(size.width), y / float(size.height), z / float(size.depth), 0});
        expected.push_back((x - 0.5f) + 10 * (y - 0.5f) + 100 * (z - 0.5f));
    }
    const BufferHandle at = must(d.create_buffer({.size = places.size() * 16, .label = "places"}));
    const BufferHandle values = must(d.create_buffer({.size = places.size() * 4, .label = "values"}));
    const BufferHandle values_back = must(d.create_buffer(
        {.size = places.size() * 4, .usage = BufferUsage::CopyDst, .memory = MemoryKind::Readback, .label = "values"}));
    must(d.write_buffer(at, 0, bytes_of(places)));

    const BindGroupEntry write_entries[] = {{.binding = 0, .view = d.whole_view(volume)}};
    const BindGroupEntry sample_entries[] = {{.binding = 0, .view = d.whole_view(volume)},
                                             {.binding = 1, .sampler = smooth},
                                             {.binding = 2, .buffer = at},
                                             {.binding = 3, .buffer = values}};
    const BindGroup write_group =
        must(d.create_bind_group({.layout = d.group_layout(writer, 0), .entries = write_entries}));
    const BindGroup sample_group =
        must(d.create_bind_group({.layout = d.group_layout(sampler_pipeline, 0), .entries = sample_entries}));

    auto e = d.create_encoder("volume");
    barrier(*e, {.texture = volume, .after = Access::StorageWriteCompute});
    ComputePass& w = e->begin_compute("write");
    w.set_pipeline(writer);
    w.set_bind_group(0, write_group);
    w.dispatch(5, 3, 2);
    w.end();
    barrier(*e, {.texture = volume,
                 .before = Access::StorageWriteCompute,
                 .after = Access::SampledReadCompute | Access::CopyRead});
    ComputePass& s = e->begin_compute("sample");
    s.set_pipeline(sampler_pipeline);
    s.set_bind_group(0, sample_group);
    s.dispatch(4);
    s.end();
    e->copy_texture_to_buffer({.texture = volume}, {.buffer = back}, size);
    barrier(*e, {.buffer = values, .before = Access::StorageWriteCompute, .after = Access::CopyRead});
    e->copy_buffer(values, 0, values_back, 0, places.size() * 4);
    barrier(*e, {.buffer = back, .before = Access::CopyWrite, .after = Access::HostRead});
    barrier(*e, {.buffer = values_back, .before = Access::CopyWrite, .after = Access::HostRead});
    must(d.wait(must(d.submit(std::move(e)))));

    const std::vector<uint16_t> texels = mapped<uint16_t>(d, back, size.width * size.height * size.depth);
    // 1 + 10 * 2 + 100 * 3 = 321 = 1.25390625 * 2^8: exponent 8 + 15, mantissa 0.25390625 * 1024.
    EXPECT_EQ(texels[1 + 20 * (2 + 12 * 3)], 23 << 10 | 260);
    const std::vector<float> seen = mapped<float>(d, values_back, places.size());
    for (size_t i = 0; i < seen.size(); ++i) EXPECT_NEAR(seen[i], expected[i], 0.5f) << i;

    d.destroy(write_group);
    d.destroy(sample_group);
    for (const BufferHandle b : {back, at, values, values_back}) d.destroy(b);
    d.destroy(volume);
    d.destroy(smooth);
    d.destroy(writer);
    d.destroy(sampler_pipeline);
    d.destroy(write);
    d.destroy(sample);
}

// A dispatch whose size another dispatch wrote, and atomics.
TEST_F(VulkanGpu, IndirectDispatchCountsEveryThread) {
    Device& d = *device_;
    const BufferHandle total = must(d.create_buffer({.size = 4, .label = "total"}));
    BufferHandle groups[2];
    for (BufferHandle& b : groups)
        b = must(
            d.create_buffer({.size = 12, .usage = BufferUsage::Storage | BufferUsage::Indirect, .label = "groups"}));
    const BufferHandle back = must(
        d.create_buffer({.size = 4, .usage = BufferUsage::CopyDst, .memory = MemoryKind::Readback, .label = "back"}));
    const ShaderModule shader = must(d.create_shader_module({.spirv = kRhiCountSpv, .label = "count"}));
    const ComputePipeline pipeline = must(d.create_compute_pipeline({.shader = shader, .label = "count"}));
    BindGroup bound[2];
    for (int i = 0; i < 2; ++i) {
        const BindGroupEntry entries[] = {{.binding = 0, .buffer = total}, {.binding = 1, .buffer = groups[i]}};
        bound[i] =
            must(d.create_bind_group({.layout = d.group_layout(pipeline, 0), .entries = entries, .label = "count"}));
    }
    auto e = d.create_encoder("count");
    e->clear_buffer(total);
    for (int i = 0; i < 2; ++i) {
        barrier(*e, {.buffer = total,
                     .before = i == 0 ? Access::CopyWrite : Access::StorageWriteCompute,
                     .after = Access::StorageWriteCompute});
        ComputePass& pass = e->begin_compute("count");
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, bound[i]);
        pass.set_push_struct(5u);
        if (i == 0) {
            pass.dispatch(3);
        } else {
            pass.dispatch_indirect(groups[0], 0);
        }
        pass.end();
        if (i == 0)
            barrier(*e, {.buffer = groups[0], .before = Access::StorageWriteCompute, .after = Access::IndirectRead});
    }
    barrier(*e, {.buffer = total, .before = Access::StorageWriteCompute, .after = Access::CopyRead});
    e->copy_buffer(total, 0, back, 0, 4);
    barrier(*e, {.buffer = back, .before = Access::CopyWrite, .after = Access::HostRead});
    must(d.wait(must(d.submit(std::move(e)))));
    EXPECT_EQ(mapped<uint32_t>(d, back, 1)[0], 32u * (3 + 5 * 2));
    for (const BufferHandle b : {total, groups[0], groups[1], back}) d.destroy(b);
    for (const BindGroup g : bound) d.destroy(g);
    d.destroy(pipeline);
    d.destroy(shader);
}

TEST_F(VulkanGpu, TextureCopiesMoveEveryMipAndLayer) {
    Device& d = *device_;
    const TextureDesc desc{
        .dimension = Dimension::D2Array, .format = Format::Rgba8Unorm, .size = {8, 8, 3}, .mips = 2, .label = "a"};
    const TextureHandle a = must(d.create_texture(desc));
    TextureDesc other = desc;
    other.label = "b";
    const TextureHandle b = must(d.create_texture(other));
    const BufferHandle back = must(d.create_buffer(
        {.size = 3 * 4 * 4 * 4, .usage = BufferUsage::CopyDst, .memory = MemoryKind::Readback, .label = "back"}));
    std::vector<std::vector<uint32_t>> texels(3);
    for (uint32_t layer = 0; layer < 3; ++layer) {
        for (uint32_t i = 0; i < 16; ++i) texels[layer].push_back(layer << 8 | i);
        must(d.write_texture({.place = {a, 1, {0, 0, layer}}, .size = {4, 4}, .after = Access::CopyRead},
                             bytes_of(texels[layer])));
    }
    auto e = d.create_encoder("copies");
    barrier(*e, {.texture = b, .after = Access::CopyWrite});
    e->copy_texture({a, 1, {}}, {b, 1, {}}, {4, 4, 3});
    barrier(*e, {.texture = b,
                 .range = {.base_mip = 1, .mip_count = 1},
                 .before = Access::CopyWrite,
                 .after = Access::CopyRead});
    e->copy_texture_to_buffer({b, 1, {}}, {.buffer = back}, {4, 4, 3});
    barrier(*e, {.buffer = back, .before = Access::CopyWrite, .after = Access::HostRead});
    must(d.wait(must(d.submit(std::move(e)))));
    const std::vector<uint32_t> seen = mapped<uint32_t>(d, back, 48);
    for (uint32_t layer = 0; layer < 3; ++layer)
        for (uint32_t i = 0; i < 16; ++i) EXPECT_EQ(seen[layer * 16 + i], texels[layer][i]);
    d.destroy(a);
    d.destroy(b);
    d.destroy(back);
}

TEST_F(VulkanGpu, ClearsAndOddRowsArriveAsAsked) {
    Device& d = *device_;
    const TextureHandle t = must(d.create_texture({.format = Format::R32Uint, .size = {5, 3}, .label = "odd"}));
    const BufferHandle source = must(d.create_buffer({.size = 256, .label = "source"}));
    const BufferHandle back = must(
        d.create_buffer({.size = 256, .usage = BufferUsage::CopyDst, .memory = MemoryKind::Readback, .label = "back"}));
    auto e = d.create_encoder("clears");
    e->clear_buffer(source, 0, kWholeSize, 0x01020304);
    barrier(*e, {.texture = t, .after = Access::CopyWrite});
    e->clear_texture(t, {7, 0, 0, 0});
    barrier(*e, {.texture = t, .before = Access::CopyWrite, .after = Access::CopyWrite});
    barrier(*e, {.buffer = source, .before = Access::CopyWrite, .after = Access::CopyRead});
    e->copy_buffer_to_texture({.buffer = source, .offset = 16}, {.texture = t, .origin = {1, 1}}, {3, 1});
    barrier(*e, {.texture = t, .before = Access::CopyWrite, .after = Access::CopyRead});
    e->copy_texture_to_buffer({.texture = t}, {.buffer = back, .bytes_per_row = 32}, {5, 3});
    barrier(*e, {.buffer = back, .before = Access::CopyWrite, .after = Access::HostRead});
    must(d.wait(must(d.submit(std::move(e)))));
    const std::vector<uint32_t> seen = mapped<uint32_t>(d, back, 24);
    for (uint32_t y = 0; y < 3; ++y)
        for (uint32_t x = 0; x < 5; ++x) {
            const bool copied = y == 1 && x >= 1 && x < 4;
            EXPECT_EQ(seen[y * 8 + x], copied ? 0x01020304u : 7u) << x << " " << y;
        }
    d.destroy(t);
    d.destroy(source);
    d.destroy(back);
}

TEST_F(VulkanGpu, LaterWritesOfOneFrameWin) {
    Device& d = *device_;
    const BufferHandle b = must(d.create_buffer({.size = 64, .label = "b"}));
    const BufferHandle back = must(
        d.create_buffer({.size = 64, .usage = BufferUsage::CopyDst, .memory = MemoryKind::Readback, .label = "back"}));
    must(d.write_buffer(b, 0, bytes_of(std::vector<uint32_t>(16, 1))));
    must(d.write_buffer(b, 16, bytes_of(std::vector<uint32_t>(4, 2))));
    must(d.write_buffer(b, 20, bytes_of(std::vector<uint32_t>(1, 3))));
    auto e = d.create_encoder("writes");
    e->copy_buffer(b, 0, back, 0, 64);
    barrier(*e, {.buffer = back, .before = Access::CopyWrite, .after = Access::HostRead});
    must(d.wait(must(d.submit(std::move(e)))));
    const std::vector<uint32_t> expected{1, 1, 1, 1, 2, 3, 2, 2, 1, 1, 1, 1, 1, 1, 1, 1};
    EXPECT_EQ(mapped<uint32_t>(d, back, 16), expected);
    d.destroy(b);
    d.destroy(back);
}

// destroy() may come while the GPU still works with the object, and ahead of the submit that carries a queue write.
TEST_F(VulkanGpu, WhatIsDestroyedWhileInUseLivesOn) {
    Device& d = *device_;
    const BufferHandle big = must(d.create_buffer({.size = 64 << 20, .label = "big"}));
    auto e = d.create_encoder("long");
    for (uint32_t i = 0; i < 8; ++i) {
        e->clear_buffer(big, 0, kWholeSize, i);
        barrier(*e, {.buffer = big, .before = Access::CopyWrite, .after = Access::CopyWrite});
    }
    const SubmitId id = must(d.submit(std::move(e)));
    d.destroy(big);
    EXPECT_EQ(d.live_handle_count(), 0u);
    must(d.submit(d.create_encoder("collects")));
    must(d.wait(id));

    const BufferHandle written = must(d.create_buffer({.size = 64, .label = "written"}));
    must(d.write_buffer(written, 0, bytes_of(std::vector<uint32_t>(16, 1))));
    d.destroy(written);
    must(d.wait(must(d.submit(d.create_encoder("carries the write")))));
}

TEST_F(VulkanGpu, TimestampsRiseAndStayInsideTheWait) {
    Device& d = *device_;
    if (!d.caps().timestamp) GTEST_SKIP() << "no timestamps";
    const QuerySet set = must(d.create_query_set({.count = 4, .label = "times"}));
    const BufferHandle big = must(d.create_buffer({.size = 8 << 20, .label = "big"}));
    const BufferHandle ticks = must(
        d.create_buffer({.size = 32, .usage = BufferUsage::QueryResolve | BufferUsage::CopySrc, .label = "ticks"}));
    const BufferHandle back = must(
        d.create_buffer({.size = 32, .usage = BufferUsage::CopyDst, .memory = MemoryKind::Readback, .label = "back"}));
    for (int frame = 0; frame < 2; ++frame) {
        auto e = d.create_encoder("times");
        if (frame > 0) {
            barrier(*e, {.buffer = big, .before = Access::CopyWrite, .after = Access::CopyWrite});
            barrier(*e, {.buffer = ticks, .before = Access::CopyRead, .after = Access::CopyWrite});
            barrier(*e, {.buffer = back, .before = Access::HostRead, .after = Access::CopyWrite});
        }
        e->write_timestamp(set, 1);
        e->clear_buffer(big, 0, kWholeSize, uint32_t(frame));
        e->write_timestamp(set, 2);
        e->resolve_queries(set, 1, 2, ticks, 8);
        barrier(*e, {.buffer = ticks, .before = Access::CopyWrite, .after = Access::CopyRead});
        e->copy_buffer(ticks, 0, back, 0, 32);
        barrier(*e, {.buffer = back, .before = Access::CopyWrite, .after = Access::HostRead});
        must(d.wait(must(d.submit(std::move(e)))));
        const std::vector<uint64_t> seen = mapped<uint64_t>(d, back, 4);
        const double ms = double(seen[2] - seen[1]) * d.limits().timestamp_period_ns * 1e-6;
        EXPECT_GT(seen[2], seen[1]);
        EXPECT_LT(ms, 60e3);
    }
    d.destroy(set);
    d.destroy(big);
    d.destroy(ticks);
    d.destroy(back);
}

TEST_F(VulkanGpu, TriangleStandsUprightInItsCorner) {
    Device& d = *device_;
    struct Vertex {
        float x, y, r, g, b;
    };
    const std::vector<Vertex> vertices{{-1, -1, 1, 0, 0}, {1, -1, 1, 0, 0}, {-1, 1, 1, 0, 0}};
    const VertexAttribute attributes[] = {{0, VertexFormat::Float32x2, 0}, {1, VertexFormat::Float32x3, 8}};
    const VertexBufferLayout layout[] = {{.stride = sizeof(Vertex), .attributes = attributes}};
    const ColorTarget targets[] = {{.format = Format::Rgba8Unorm}};
    const ShaderModule vert = must(d.create_shader_module({.spirv = kRhiTriangleVertSpv, .label = "triangle.vert"}));
    const ShaderModule frag = must(d.create_shader_module({.spirv = kRhiTriangleFragSpv, .label = "triangle.frag"}));
    // Counter-clockwise with +y up, so culling the back must leave it.
    const RenderPipeline pipeline = must(d.create_render_pipeline({.vertex = vert,
                                                                   .fragment = frag,
                                                                   .vertex_buffers = layout,
                                                                   .cull = Cull::Back,
                                                                   .colors = targets,
                                                                   .depth = {.format = Format::Depth32Float},
                                                                   .label = "triangle"}));
    const uint32_t n = 16;
    const TextureHandle color = must(d.create_texture({.format = Format::Rgba8Unorm,
                                                       .size = {n, n},
                                                       .usage = TextureUsage::Color | TextureUsage::CopySrc,
                                                       .label = "color"}));
    const TextureHandle depth = must(d.create_texture({.format = Format::Depth32Float,
                                                       .size = {n, n},
                                                       .usage = TextureUsage::Depth | TextureUsage::CopySrc,
                                                       .label = "depth"}));
    const BufferHandle points = must(d.create_buffer(
        {.size = sizeof(Vertex) * 3, .usage = BufferUsage::Vertex | BufferUsage::CopyDst, .label = "vertices"}));
    const BufferHandle back = must(d.create_buffer(
        {.size = n * n * 4, .usage = BufferUsage::CopyDst, .memory = MemoryKind::Readback, .label = "back"}));
    const BufferHandle depth_back = must(d.create_buffer(
        {.size = n * n * 4, .usage = BufferUsage::CopyDst, .memory = MemoryKind::Readback, .label = "depth back"}));
    must(d.write_buffer(points, 0, bytes_of(vertices)));

    auto e = d.create_encoder("triangle");
    const Barrier both[] = {{.texture = color, .after = Access::ColorWrite},
                            {.texture = depth, .after = Access::DepthWrite}};
    e->barrier(BarrierKeyForTests::key(), both);
    const ColorAttachment attachments[] = {{.view = d.whole_view(color), .clear = {0, 0, 1, 1}}};
    RenderPass& pass =
        e->begin_render({.colors = attachments, .depth = {.view = d.whole_view(depth)}, .label = "triangle"});
    pass.set_pipeline(pipeline);
    pass.set_vertex_buffer(0, points);
    pass.set_push_struct(1.0f);
    pass.draw(3);
    pass.end();
    barrier(*e, {.texture = color, .before = Access::ColorWrite, .after = Access::CopyRead});
    barrier(*e, {.texture = depth, .before = Access::DepthWrite, .after = Access::CopyRead});
    e->copy_texture_to_buffer({.texture = color}, {.buffer = back}, {n, n});
    e->copy_texture_to_buffer({.texture = depth}, {.buffer = depth_back}, {n, n});
    barrier(*e, {.buffer = back, .before = Access::CopyWrite, .after = Access::HostRead});
    barrier(*e, {.buffer = depth_back, .before = Access::CopyWrite, .after = Access::HostRead});
    must(d.wait(must(d.submit(std::move(e)))));

    const std::vector<uint32_t> pixels = mapped<uint32_t>(d, back, n * n);
    const std::vector<float> depths = mapped<float>(d, depth_back, n * n);
    for (uint32_t y = 0; y < n; ++y)
        for (uint32_t x = 0; x < n; ++x) {
            if (x == y) continue;       // the long edge
            const bool inside = x < y;  // row 0 is the top: the lower left half
            EXPECT_EQ(pixels[y * n + x], inside ? 0xff0000ffu : 0xffff0000u) << x << " " << y;
            EXPECT_EQ(depths[y * n + x], inside ? 0.5f : 0.0f) << x << " " << y;
        }
    for (const BufferHandle b : {points, back, depth_back}) d.destroy(b);
    d.destroy(color);
    d.destroy(depth);
    d.destroy(pipeline);
    d.destroy(vert);
    d.destroy(frag);
}

TEST_F(VulkanGpu, MemoryComesBackAndTooMuchIsAnError) {
    Device& d = *device_;
    const uint64_t before = d.memory_stats().used_bytes;
    std::vector<BufferHandle> buffers;
    for (int i = 0; i < 300; ++i)
        buffers.push_back(must(d.create_buffer({.size = 10000 + uint64_t(i) * 1000, .label = "many"})));
    EXPECT_LE(d.memory_stats().blocks, 8u);
    EXPECT_GE(d.memory_stats().used_bytes, before + 300 * 10000);
    Result<BufferHandle> huge = d.create_buffer({.size = 1ull << 50, .label = "huge"});
    ASSERT_FALSE(huge);
    EXPECT_EQ(huge.error().kind, ErrorKind::OutOfMemory) << huge.error().message;
    // Ask for buffers of 1 GiB until the device refuses: an answer, not a crash, and what exists goes on working.
    std::vector<BufferHandle> large;
    Error last;
    for (int i = 0; i < 4096 && last.message.empty(); ++i) {
        Result<BufferHandle> b =
            d.create_buffer({.size = std::min<uint64_t>(1ull << 30, d.limits().max_buffer), .label = "large"});
        if (b) {
            large.push_back(*b);
        } else {
            last = b.error();
        }
    }
    EXPECT_EQ(last.kind, ErrorKind::OutOfMemory) << last.message;
    for (const BufferHandle b : buffers) d.destroy(b);
    for (const BufferHandle b : large) d.destroy(b);
    must(d.submit(d.create_encoder("nothing")));
    must(d.wait_idle());
    must(d.submit(d.create_encoder("nothing")));  // collects
    EXPECT_EQ(d.memory_stats().used_bytes, before);
}

// The other tests are only worth something if the driver's layer does speak up. Without the decorator in front, a copy
// past the end of a buffer and a missing barrier get as far as the driver.
TEST_F(VulkanGpu, DriverValidationIsListening) {
    auto instance = vulkan::Instance::create(true);
    ASSERT_TRUE(instance);
    if (!(*instance)->validating()) GTEST_SKIP() << "VK_LAYER_KHRONOS_validation is not installed";
    const vulkan::Adapter adapter = must((*instance)->choose("auto"));
    auto made = vulkan::VulkanDevice::create(std::move(*instance), adapter, false);
    ASSERT_TRUE(made);
    Device& d = **made;
    std::string heard;
    d.set_error_sink([&](std::string_view sentence) { heard += std::string(sentence) + "\n"; });
    const BufferHandle a = must(d.create_buffer({.size = 64, .label = "a"}));
    const BufferHandle b = must(d.create_buffer({.size = 64, .label = "b"}));
    const BufferHandle c = must(d.create_buffer({.size = 64, .label = "c"}));
    auto e = d.create_encoder("no barrier");
    e->copy_buffer(a, 0, b, 0, 64);
    e->copy_buffer(b, 0, c, 0, 64);
    must(d.submit(std::move(e)));
    EXPECT_NE(heard.find("READ_AFTER_WRITE"), std::string::npos) << heard;
    heard.clear();
    auto past = d.create_encoder("past the end");
    past->copy_buffer(a, 32, c, 0, 64);
    past.reset();  // never submitted
    EXPECT_NE(heard.find("VUID-"), std::string::npos) << heard;
    must(d.wait_idle());
    for (const BufferHandle x : {a, b, c}) d.destroy(x);
}

}  // namespace kiln::rhi
