// SPDX-License-Identifier: MIT
// Every rule of the validate decorator, broken once, on the null device: what is said must name the fault, the broken call
// must fail, and the same work done right must pass in silence.
#include "rhi_test.h"

#include "shaders/rhi_add.spv.h"
#include "shaders/rhi_triangle_frag.spv.h"
#include "shaders/rhi_triangle_vert.spv.h"
#include "shaders/rhi_volume_sample.spv.h"
#include "shaders/rhi_volume_write.spv.h"

#include <functional>

namespace kiln::rhi {

namespace {

// A little of everything, ready to be misused.
struct World {
    Device& d;
    BufferHandle a = must(d.create_buffer({.size = 4096, .label = "a"}));
    BufferHandle b = must(d.create_buffer({.size = 4096, .label = "b"}));
    BufferHandle uniform =
        must(d.create_buffer({.size = 256, .usage = BufferUsage::Uniform | BufferUsage::CopyDst, .label = "uniform"}));
    BufferHandle indirect =
        must(d.create_buffer({.size = 64, .usage = BufferUsage::Indirect | BufferUsage::CopyDst, .label = "indirect"}));
    BufferHandle back = must(d.create_buffer(
        {.size = 4096, .usage = BufferUsage::CopyDst, .memory = MemoryKind::Readback, .label = "back"}));
    BufferHandle up = must(
        d.create_buffer({.size = 4096, .usage = BufferUsage::CopySrc, .memory = MemoryKind::Upload, .label = "up"}));
    BufferHandle ticks = must(d.create_buffer({.size = 64, .usage = BufferUsage::QueryResolve, .label = "ticks"}));
    TextureHandle volume = must(d.create_texture(
        {.dimension = Dimension::D3, .format = Format::R16Float, .size = {8, 8, 8}, .label = "volume"}));
    TextureHandle mips =
        must(d.create_texture({.format = Format::Rgba16Float, .size = {16, 16}, .mips = 3, .label = "mips"}));
    TextureHandle color = must(d.create_texture({.format = Format::Rgba8Unorm,
                                                 .size = {16, 16},
                                                 .usage = TextureUsage::Color | TextureUsage::CopySrc,
                                                 .label = "color"}));
    TextureHandle depth = must(d.create_texture(
        {.format = Format::Depth32Float, .size = {16, 16}, .usage = TextureUsage::Depth, .label = "depth"}));
    SamplerHandle sampler = must(d.create_sampler({.label = "sampler"}));
    QuerySet queries = must(d.create_query_set({.count = 4, .label = "queries"}));
    ShaderModule add_shader = must(d.create_shader_module({.spirv = kRhiAddSpv, .label = "add"}));
    ShaderModule write_shader = must(d.create_shader_module({.spirv = kRhiVolumeWriteSpv, .label = "write"}));
    ShaderModule vert = must(d.create_shader_module({.spirv = kRhiTriangleVertSpv, .label = "vert"}));
    ShaderModule frag = must(d.create_shader_module({.spirv = kRhiTriangleFragSpv, .label = "frag"}));
    ComputePipeline add = must(d.create_compute_pipeline({.shader = add_shader, .label = "add"}));
    ComputePipeline write = must(d.create_compute_pipeline({.shader = write_shader, .label = "write"}));
    BindGroup add_group = group(add, {{.binding = 0, .buffer = a}, {.binding = 1, .buffer = b}});
    BindGroup write_group = group(write, {{.binding = 0, .view = d.whole_view(volume)}});

    BindGroup group(ComputePipeline p, std::vector<BindGroupEntry> entries) {
        Result<BindGroup> made =
            d.create_bind_group({.layout = d.group_layout(p, 0), .entries = entries, .label = "group"});
        return made ? *made : BindGroup{};
    }
    RenderPipeline triangle(Format format = Format::Rgba8Unorm) {
        const VertexAttribute attributes[] = {{0, VertexFormat::Float32x2, 0}, {1, VertexFormat::Float32x3, 8}};
        const VertexBufferLayout layout[] = {{.stride = 20, .attributes = attributes}};
        const ColorTarget targets[] = {{.format = format}};
        Result<RenderPipeline> made = d.create_render_pipeline({.vertex = vert,
                                                                .fragment = frag,
                                                                .vertex_buffers = layout,
                                                                .colors = targets,
                                                                .depth = {.format = Format::Depth32Float},
                                                                .label = "triangle"});
        return made ? *made : RenderPipeline{};
    }

    std::unique_ptr<CommandEncoder> e = d.create_encoder("frame");
    void submit() { static_cast<void>(d.submit(std::move(e))); }
    void dispatch(ComputePipeline p, BindGroup g, uint32_t groups = 1) {
        ComputePass& pass = e->begin_compute("pass");
        pass.set_pipeline(p);
        pass.set_bind_group(0, g);
        pass.set_push_struct(std::array<uint32_t, 4>{1, 1, 1, 1});
        pass.dispatch(groups);
        pass.end();
    }
    void bar(const Barrier& b_) { barrier(*e, b_); }
};

struct Rule {
    const char* name;
    const char* says;  // part of the sentence; null: all is well and nothing is said
    std::function<void(World&)> act;
};

void PrintTo(const Rule& r, std::ostream* out) { *out << r.name; }

#define MAKE(call) static_cast<void>(w.d.call)

const Rule kRules[] = {
    // ---- descriptions
    {"BufferOfNothing", "size is 0", [](World& w) { MAKE(create_buffer({.size = 0})); }},
    {"BufferForNothing", "no usage", [](World& w) { MAKE(create_buffer({.size = 4, .usage = BufferUsage::None})); }},
    {"ReadbackForStorage", "readback memory is for",
     [](World& w) { MAKE(create_buffer({.size = 4, .memory = MemoryKind::Readback})); }},
    {"UploadForStorage", "upload memory is for",
     [](World& w) { MAKE(create_buffer({.size = 4, .memory = MemoryKind::Upload})); }},
    {"TextureTooLarge", "beyond the floor of 8192",
     [](World& w) {
         MAKE(create_texture({.size = {8193, 1}}));
     }},
    {"VolumeTooLarge", "beyond the floor of 2048",
     [](World& w) {
         MAKE(create_texture({.dimension = Dimension::D3, .size = {4, 4, 2049}}));
     }},
    {"TooManyLayers", "257 layers",
     [](World& w) {
         MAKE(create_texture({.dimension = Dimension::D2Array, .size = {4, 4, 257}}));
     }},
    {"FlatTextureWithDepth", "use D2Array or D3",
     [](World& w) {
         MAKE(create_texture({.size = {4, 4, 2}}));
     }},
    {"TooManyMips", "4 mips, there can be 3",
     [](World& w) {
         MAKE(create_texture({.size = {7, 4}, .mips = 4}));
     }},
    {"TextureWithoutFormat", "no format", [](World& w) { MAKE(create_texture({.format = Format::Undefined})); }},
    {"DepthAsStorage", "can't be a storage texture",
     [](World& w) { MAKE(create_texture({.format = Format::Depth32Float})); }},
    {"DepthAsColor", "as a colour attachment",
     [](World& w) { MAKE(create_texture({.format = Format::Depth32Float, .usage = TextureUsage::Color})); }},
    {"ViewBeyondMips", "beyond texture 'mips'",
     [](World& w) { MAKE(create_view({.texture = w.mips, .range = {.base_mip = 2, .mip_count = 2}})); }},
    {"SamplerUpsideDown", "lod_min", [](World& w) { MAKE(create_sampler({.lod_min = 2, .lod_max = 1})); }},
    {"QuerySetOfNothing", "0 queries", [](World& w) { MAKE(create_query_set({.count = 0})); }},
    {"NotSpirv", nullptr,
     [](World& w) {
         const std::vector<uint32_t> junk{1, 2, 3, 4, 5, 6};
         EXPECT_FALSE(w.d.create_shader_module({.spirv = junk}));
     }},
    {"LayoutBindingTwice", "binding 3 twice",
     [](World& w) {
         const BindGroupLayoutEntry e[] = {{.binding = 3}, {.binding = 3}};
         MAKE(create_bind_group_layout({.entries = e}));
     }},
    {"LayoutTooManyStorageBuffers", "9 storage buffers in a stage, the floor is 8",
     [](World& w) {
         std::vector<BindGroupLayoutEntry> e(9);
         for (uint32_t i = 0; i < 9; ++i) e[i].binding = i;
         MAKE(create_bind_group_layout({.entries = e}));
     }},
    {"LayoutTooManyStorageTextures", "5 storage textures in a stage, the floor is 4",
     [](World& w) {
         std::vector<BindGroupLayoutEntry> e(5);
         for (uint32_t i = 0; i < 5; ++i)
             e[i] = {.binding = i, .kind = BindingKind::StorageTexture, .format = Format::R32Float};
         MAKE(create_bind_group_layout({.entries = e}));
     }},
    {"PipelineLayoutTooManyGroups", "5 bind groups, the floor is 4",
     [](World& w) {
         const BindGroupLayout l = w.d.group_layout(w.add, 0);
         const BindGroupLayout groups[] = {l, l, l, l, l};
         MAKE(create_pipeline_layout({.groups = groups}));
     }},
    {"PipelineLayoutPushTooLarge", "68 B of push data",
     [](World& w) { MAKE(create_pipeline_layout({.push_bytes = 68})); }},
    {"PipelineLayoutTooSmall", "no fitting entry for set 0 binding 0",
     [](World& w) {
         const PipelineLayout l = must(w.d.create_pipeline_layout({.push_bytes = 64, .label = "bare"}));
         MAKE(create_compute_pipeline({.shader = w.add_shader, .layout = l}));
         w.d.destroy(l);
     }},
    {"ComputePipelineOfAFragmentShader", "not a compute shader",
     [](World& w) { MAKE(create_compute_pipeline({.shader = w.frag})); }},
    {"RenderPipelineUpsideDown", "is not a vertex shader",
     [](World& w) { MAKE(create_render_pipeline({.vertex = w.frag, .fragment = w.vert})); }},
    {"VertexPastStride", "ends past the stride of 12",
     [](World& w) {
         const VertexAttribute attributes[] = {{0, VertexFormat::Float32x2, 8}};
         const VertexBufferLayout layout[] = {{.stride = 12, .attributes = attributes}};
         const ColorTarget targets[] = {{}};
         MAKE(create_render_pipeline(
             {.vertex = w.vert, .fragment = w.frag, .vertex_buffers = layout, .colors = targets}));
     }},

    // ---- bind groups
    {"GroupLacksABinding", "binding 1 (StorageBuffer) is missing",
     [](World& w) { w.group(w.add, {{.binding = 0, .buffer = w.a}}); }},
    {"GroupOfAWrongUsage", "lacks usage Storage",
     [](World& w) {
         w.group(w.add, {{.binding = 0, .buffer = w.uniform}, {.binding = 1, .buffer = w.b}});
     }},
    {"GroupWithoutABuffer", "no buffer is given",
     [](World& w) {
         w.group(w.add, {{.binding = 0, .view = w.d.whole_view(w.volume)}, {.binding = 1, .buffer = w.b}});
     }},
    {"GroupOffsetUnaligned", "not a multiple of 256",
     [](World& w) {
         w.group(w.add, {{.binding = 0, .buffer = w.a, .offset = 16}, {.binding = 1, .buffer = w.b}});
     }},
    {"GroupPastTheEnd", "go past the end of buffer 'a'",
     [](World& w) {
         w.group(w.add, {{.binding = 0, .buffer = w.a, .offset = 256, .size = 4096}, {.binding = 1, .buffer = w.b}});
     }},
    {"GroupBeyondTheFloor", "the floor is 134217728",
     [](World& w) {
         const BufferHandle large = must(w.d.create_buffer({.size = (128 << 20) + 4, .label = "large"}));
         w.group(w.add, {{.binding = 0, .buffer = large}, {.binding = 1, .buffer = w.b}});
         w.d.destroy(large);
     }},
    {"GroupOfAWrongFormat", "texture 'float' is R32Float, the shader stores R16Float",
     [](World& w) {
         const TextureHandle t = must(w.d.create_texture(
             {.dimension = Dimension::D3, .format = Format::R32Float, .size = {4, 4, 4}, .label = "float"}));
         w.group(w.write, {{.binding = 0, .view = w.d.whole_view(t)}});
         w.d.destroy(t);
     }},
    {"GroupOfAWrongDimension", "another dimension",
     [](World& w) { w.group(w.write, {{.binding = 0, .view = w.d.whole_view(w.mips)}}); }},
    {"GroupOfSeveralMips", "must be of one mip",
     [](World& w) {
         const TextureHandle t = must(w.d.create_texture(
             {.dimension = Dimension::D3, .format = Format::R16Float, .size = {4, 4, 4}, .mips = 2, .label = "t"}));
         w.group(w.write, {{.binding = 0, .view = w.d.whole_view(t)}});
         w.d.destroy(t);
     }},

    // ---- queue writes and mapping
    {"WriteUnaligned", "multiples of 4", [](World& w) { MAKE(write_buffer(w.a, 2, std::vector<std::byte>(4))); }},
    {"WritePastTheEnd", "go past the end of 'a'",
     [](World& w) { MAKE(write_buffer(w.a, 4092, std::vector<std::byte>(8))); }},
    {"WriteToUploadMemory", "lacks usage CopyDst",
     [](World& w) { MAKE(write_buffer(w.up, 0, std::vector<std::byte>(8))); }},
    {"WriteTexturePastTheEdge", "goes past mip 1",
     [](World& w) {
         MAKE(write_texture({.place = {w.mips, 1, {4, 0, 0}}, .size = {8, 8}}, std::vector<std::byte>(4096)));
     }},
    {"WriteTextureTooFewBytes", "past the end of the buffer",
     [](World& w) {
         MAKE(write_texture({.place = {w.mips, 1, {}}, .size = {8, 8}}, std::vector<std::byte>(511)));
     }},
    {"WriteTextureFromAWrongState", "said to be in SampledReadCompute before",
     [](World& w) {
         MAKE(write_texture({.place = {w.mips, 1, {}}, .size = {8, 8}, .before = Access::SampledReadCompute},
                            std::vector<std::byte>(512)));
         w.submit();
     }},
    {"MapDeviceMemory", "in device memory", [](World& w) { MAKE(map(w.a)); }},
    {"MapTwice", "is mapped already",
     [](World& w) {
         MAKE(map(w.up));
         MAKE(map(w.up));
         w.d.unmap(w.up);
     }},
    {"UnmapUnmapped", "is not mapped", [](World& w) { w.d.unmap(w.up); }},
    {"UseWhileMapped", "is mapped while the GPU uses it",
     [](World& w) {
         MAKE(map(w.up));
         w.e->copy_buffer(w.up, 0, w.a, 0, 16);
         w.submit();
         w.d.unmap(w.up);
     }},
    {"MapWithoutHostRead", "without a barrier to HostRead",
     [](World& w) {
         w.e->copy_buffer(w.a, 0, w.back, 0, 16);
         w.submit();
         MAKE(map(w.back));
     }},
    {"WaitForNothing", "was never made", [](World& w) { MAKE(wait(77)); }},

    // ---- life
    {"DestroyTwice", "buffer 'once' was destroyed",
     [](World& w) {
         const BufferHandle x = must(w.d.create_buffer({.size = 4, .label = "once"}));
         w.d.destroy(x);
         w.d.destroy(x);
     }},
    {"StaleHandleOfAReusedSlot", "its slot now holds 'new'",
     [](World& w) {
         const BufferHandle old = must(w.d.create_buffer({.size = 4, .label = "old"}));
         w.d.destroy(old);
         const BufferHandle fresh = must(w.d.create_buffer({.size = 4, .label = "new"}));
         EXPECT_EQ(old.index, fresh.index);
         w.e->clear_buffer(old);
         w.d.destroy(fresh);
     }},
    {"UseOfADestroyedGroup", "bind group 'group' was destroyed",
     [](World& w) {
         const BindGroup g = w.group(w.add, {{.binding = 0, .buffer = w.a}, {.binding = 1, .buffer = w.b}});
         w.d.destroy(g);
         w.dispatch(w.add, g);
     }},
    {"GroupWhoseBufferIsGone", "buffer 'short' was destroyed",
     [](World& w) {
         const BufferHandle x = must(w.d.create_buffer({.size = 256, .label = "short"}));
         const BindGroup g = w.group(w.add, {{.binding = 0, .buffer = x}, {.binding = 1, .buffer = w.b}});
         w.d.destroy(x);
         w.dispatch(w.add, g);
         w.d.destroy(g);
     }},
    {"DestroyedBetweenRecordingAndSubmit", "was destroyed between recording and submit",
     [](World& w) {
         const BufferHandle x = must(w.d.create_buffer({.size = 256, .label = "short"}));
         w.e->clear_buffer(x);
         w.d.destroy(x);
         w.submit();
     }},
    {"WholeViewIsTheTextures", "goes with it", [](World& w) { w.d.destroy(w.d.whole_view(w.volume)); }},
    {"AutoLayoutIsThePipelines", "belongs to the pipelines", [](World& w) { w.d.destroy(w.d.group_layout(w.add, 0)); }},
    {"HeapWithTenants", "still holds resources",
     [](World& w) {
         const HeapHandle h = must(w.d.create_heap({.size = 65536, .label = "heap"}));
         const BufferHandle x = must(w.d.create_buffer({.size = 256, .heap = h, .label = "tenant"}));
         w.d.destroy(h);
         w.d.destroy(x);
         w.d.destroy(h);
     }},
    {"HeapTooSmall", "go past the end of heap",
     [](World& w) {
         const HeapHandle h = must(w.d.create_heap({.size = 4096, .label = "heap"}));
         MAKE(create_buffer({.size = 256, .heap = h, .heap_offset = 4096}));
         w.d.destroy(h);
     }},

    // ---- recording
    {"DispatchWithoutAPipeline", "no pipeline is set", [](World& w) { w.e->begin_compute("p").dispatch(1); }},
    {"DispatchWithoutAGroup", "needs bind group 0, none is set",
     [](World& w) {
         ComputePass& p = w.e->begin_compute("p");
         p.set_pipeline(w.add);
         p.set_push_struct(std::array<uint32_t, 4>{});
         p.dispatch(1);
     }},
    {"DispatchWithAForeignGroup", "doesn't fit group 0 of pipeline 'add'",
     [](World& w) { w.dispatch(w.add, w.write_group); }},
    {"DispatchWithoutPushData", "reads 16 B of push data, 0 are set",
     [](World& w) {
         ComputePass& p = w.e->begin_compute("p");
         p.set_pipeline(w.add);
         p.set_bind_group(0, w.add_group);
         p.dispatch(1);
     }},
    {"PushTooLarge", "68 B of push data",
     [](World& w) { w.e->begin_compute("p").set_push(std::vector<std::byte>(68)); }},
    {"DispatchTooWide", "65536x1x1 workgroups", [](World& w) { w.dispatch(w.add, w.add_group, 65536); }},
    {"DispatchIndirectOfAWrongUsage", "lacks the usage for IndirectRead",
     [](World& w) {
         ComputePass& p = w.e->begin_compute("p");
         p.set_pipeline(w.add);
         p.set_bind_group(0, w.add_group);
         p.set_push_struct(std::array<uint32_t, 4>{});
         p.dispatch_indirect(w.up, 0);
     }},
    {"DispatchIndirectPastTheEnd", "go past the end of buffer 'indirect'",
     [](World& w) {
         ComputePass& p = w.e->begin_compute("p");
         p.set_pipeline(w.add);
         p.set_bind_group(0, w.add_group);
         p.set_push_struct(std::array<uint32_t, 4>{});
         p.dispatch_indirect(w.indirect, 56);
     }},
    {"ReadAndWriteAtOnce", "is used as StorageReadCompute and as StorageWriteCompute at once",
     [](World& w) {
         const BindGroup g = w.group(w.add, {{.binding = 0, .buffer = w.a}, {.binding = 1, .buffer = w.a}});
         w.dispatch(w.add, g);
         w.d.destroy(g);
     }},
    {"CopyInsideAPass", "pass 'p' must end first",
     [](World& w) {
         w.e->begin_compute("p");
         w.e->copy_buffer(w.a, 0, w.b, 0, 16);
     }},
    {"SubmitWithAPassOpen", "pass 'p' is still open",
     [](World& w) {
         w.e->begin_compute("p");
         w.submit();
     }},
    {"LabelsUnbalanced", "labels are still open",
     [](World& w) {
         w.e->push_label("x");
         w.submit();
     }},
    {"CopyUnaligned", "multiples of 4", [](World& w) { w.e->copy_buffer(w.a, 2, w.b, 0, 16); }},
    {"CopyPastTheEnd", "go past the end of buffer 'b'", [](World& w) { w.e->copy_buffer(w.a, 0, w.b, 4088, 16); }},
    {"CopyToItself", "copied to itself", [](World& w) { w.e->copy_buffer(w.a, 0, w.a, 1024, 16); }},
    {"CopyFromAWrongUsage", "lacks the usage for CopyRead", [](World& w) { w.e->copy_buffer(w.back, 0, w.a, 0, 16); }},
    {"CopyRowsTooShort", "less than the 8 texels of a row",
     [](World& w) {
         w.e->copy_buffer_to_texture({.buffer = w.a, .bytes_per_row = 14}, {.texture = w.volume}, {8, 8, 1});
     }},
    {"CopyVolumePastTheEdge", "goes past mip 0 of texture 'volume'",
     [](World& w) {
         w.e->copy_buffer_to_texture({.buffer = w.a}, {.texture = w.volume, .origin = {0, 0, 7}}, {8, 8, 2});
     }},
    {"CopyTextureTooFewBytes", "past the end of the buffer",
     [](World& w) {
         w.e->copy_texture_to_buffer({.texture = w.mips}, {.buffer = w.back, .offset = 2056}, {16, 16});
     }},
    {"CopyBetweenFormats", "'volume' is R16Float, 'mips' is Rgba16Float",
     [](World& w) {
         w.e->copy_texture({.texture = w.volume}, {.texture = w.mips}, {4, 4});
     }},
    {"QueryNeverWritten", "query 1 of 'queries' was never written",
     [](World& w) {
         w.e->write_timestamp(w.queries, 0);
         w.e->resolve_queries(w.queries, 0, 2, w.ticks, 0);
     }},
    {"QueryOutOfRange", "query 4 of 'queries', which has 4", [](World& w) { w.e->write_timestamp(w.queries, 4); }},
    {"DrawForOtherFormats", "other formats than the pass's",
     [](World& w) {
         const RenderPipeline p = w.triangle(Format::Rgba16Float);
         w.bar({.texture = w.color, .after = Access::ColorWrite});
         w.bar({.texture = w.depth, .after = Access::DepthWrite});
         const ColorAttachment colors[] = {{.view = w.d.whole_view(w.color)}};
         w.e->begin_render({.colors = colors, .depth = {.view = w.d.whole_view(w.depth)}}).set_pipeline(p);
         w.d.destroy(p);
     }},
    {"DrawWithoutVertices", "vertex buffer 0 is not set",
     [](World& w) {
         const RenderPipeline p = w.triangle();
         const ColorAttachment colors[] = {{.view = w.d.whole_view(w.color)}};
         RenderPass& pass = w.e->begin_render({.colors = colors, .depth = {.view = w.d.whole_view(w.depth)}});
         pass.set_pipeline(p);
         pass.set_push_struct(1.0f);
         pass.draw(3);
         w.d.destroy(p);
     }},
    {"AttachmentsOfDifferentSizes", "another is 16x16",
     [](World& w) {
         const TextureHandle small = must(w.d.create_texture(
             {.format = Format::Rgba8Unorm, .size = {8, 8}, .usage = TextureUsage::Color, .label = "small"}));
         const ColorAttachment colors[] = {{.view = w.d.whole_view(w.color)}, {.view = w.d.whole_view(small)}};
         w.e->begin_render({.colors = colors});
         w.d.destroy(small);
     }},

    // ---- barriers
    {"FirstUseOfATexture", "no barrier ever gave it contents",
     [](World& w) {
         w.dispatch(w.write, w.write_group);
         w.submit();
     }},
    {"ReadAfterWrite", "buffer 'b' is used as CopyRead, but is ready for StorageWriteCompute",
     [](World& w) {
         w.dispatch(w.add, w.add_group);
         w.e->copy_buffer(w.b, 0, w.back, 0, 16);
         w.submit();
     }},
    {"WriteAfterWrite", "after it was written as StorageWriteCompute, without a barrier",
     [](World& w) {
         w.dispatch(w.add, w.add_group);
         w.dispatch(w.add, w.add_group);
         w.submit();
     }},
    {"WriteAfterRead", "is written as CopyWrite after it was used as StorageReadCompute",
     [](World& w) {
         w.dispatch(w.add, w.add_group);
         w.e->clear_buffer(w.a);
         w.submit();
     }},
    {"WriteAfterReadInAnotherSubmit", "buffer 'b' is written as CopyWrite after it was used as CopyRead",
     [](World& w) {
         w.e->copy_buffer(w.b, 0, w.back, 0, 16);
         w.submit();
         w.e = w.d.create_encoder("second");
         w.e->clear_buffer(w.b);
         w.submit();
     }},
    {"BarrierForgetsTheAccess", "it waits for CopyRead, but the last access was StorageWriteCompute",
     [](World& w) {
         w.dispatch(w.add, w.add_group);
         w.bar({.buffer = w.b, .before = Access::CopyRead, .after = Access::CopyRead});
         w.submit();
     }},
    {"BarrierFromAWrongState", "said to be in CopyRead before, but is in CopyWrite",
     [](World& w) {
         w.bar({.texture = w.volume, .after = Access::CopyWrite});
         w.bar({.texture = w.volume,
                .before = Access::CopyRead,
                .after = Access::SampledReadCompute,
                .alias_before = Access::CopyWrite});
         w.submit();
     }},
    {"DiscardForgetsTheReads", "it waits for Undefined, but the last access was CopyWrite",
     [](World& w) {
         w.bar({.texture = w.volume, .after = Access::CopyWrite});
         w.e->clear_texture(w.volume);
         w.bar({.texture = w.volume, .after = Access::StorageWriteCompute});
         w.submit();
     }},
    {"BarrierToAnotherUse", "is used as StorageWriteCompute, but is ready for SampledReadCompute",
     [](World& w) {
         w.bar({.texture = w.volume, .after = Access::SampledReadCompute});
         w.dispatch(w.write, w.write_group);
         w.submit();
     }},
    {"BarrierOfOneMipOnly", "texture 'mips' mip 1 is used as CopyWrite",
     [](World& w) {
         w.bar({.texture = w.mips, .range = {.base_mip = 0, .mip_count = 1}, .after = Access::CopyWrite});
         w.e->clear_texture(w.mips);
         w.submit();
     }},
    {"BarrierToNowhere", "`after` is Undefined", [](World& w) { w.bar({.buffer = w.a, .before = Access::CopyRead}); }},
    {"BarrierToAMissingUsage", "lacks the usage for ColorWrite",
     [](World& w) { w.bar({.texture = w.volume, .after = Access::ColorWrite}); }},
    {"BarrierToTwoWrites", "a write stands alone",
     [](World& w) { w.bar({.buffer = w.a, .after = Access::StorageWriteCompute | Access::CopyWrite}); }},
    {"BarrierOnNothing", "on a buffer or on a texture", [](World& w) { w.bar({.after = Access::CopyWrite}); }},
    {"AliasTakenOverTooEarly", "takes over the memory of buffer 'first', last accessed as CopyWrite",
     [](World& w) {
         const HeapHandle h = must(w.d.create_heap({.size = 65536, .label = "heap"}));
         const BufferHandle first = must(w.d.create_buffer({.size = 4096, .heap = h, .label = "first"}));
         const BufferHandle second =
             must(w.d.create_buffer({.size = 4096, .heap = h, .heap_offset = 2048, .label = "second"}));
         w.bar({.buffer = first, .after = Access::CopyWrite});
         w.e->clear_buffer(first);
         w.bar({.buffer = second, .after = Access::CopyWrite});
         w.submit();
         w.d.destroy(first);
         w.d.destroy(second);
         w.d.destroy(h);
     }},
    {"AliasUsedAfterItsEnd", "buffer 'first' is used as CopyRead, but no barrier ever gave it contents",
     [](World& w) {
         const HeapHandle h = must(w.d.create_heap({.size = 65536, .label = "heap"}));
         const BufferHandle first = must(w.d.create_buffer({.size = 4096, .heap = h, .label = "first"}));
         const BufferHandle second =
             must(w.d.create_buffer({.size = 4096, .heap = h, .heap_offset = 2048, .label = "second"}));
         w.bar({.buffer = first, .after = Access::CopyWrite});
         w.e->clear_buffer(first);
         w.bar({.buffer = second, .after = Access::CopyWrite, .alias_before = Access::CopyWrite});
         w.e->copy_buffer(first, 0, w.back, 0, 16);
         w.submit();
         w.d.destroy(first);
         w.d.destroy(second);
         w.d.destroy(h);
     }},
    {"PlacedBufferWithoutABarrier", "no barrier ever gave it contents",
     [](World& w) {
         const HeapHandle h = must(w.d.create_heap({.size = 65536, .label = "heap"}));
         const BufferHandle x = must(w.d.create_buffer({.size = 4096, .heap = h, .label = "placed"}));
         w.e->clear_buffer(x);
         w.submit();
         w.d.destroy(x);
         w.d.destroy(h);
     }},

    // ---- and what is right
    {"AllIsWell", nullptr,
     [](World& w) {
         must(w.d.write_buffer(w.a, 0, std::vector<std::byte>(64)));
         must(w.d.write_texture({.place = {w.mips, 1, {}}, .size = {8, 8}, .after = Access::CopyRead},
                                std::vector<std::byte>(512)));
         w.bar({.texture = w.volume, .after = Access::StorageWriteCompute});
         w.dispatch(w.write, w.write_group);
         w.dispatch(w.add, w.add_group);
         w.bar({.buffer = w.b,
                .before = Access::StorageWriteCompute,
                .after = Access::CopyRead | Access::StorageReadCompute});
         w.e->copy_buffer(w.b, 0, w.back, 0, 16);
         w.bar({.texture = w.volume,
                .before = Access::StorageWriteCompute,
                .after = Access::CopyRead | Access::SampledReadCompute});
         w.bar({.buffer = w.back, .before = Access::CopyWrite, .after = Access::CopyWrite});
         w.e->copy_texture_to_buffer({.texture = w.volume}, {.buffer = w.back}, {8, 8, 8});
         // The next frame's first barrier: the contents go, the reads must be over.
         w.bar({.texture = w.volume,
                .after = Access::StorageWriteCompute,
                .alias_before = Access::CopyRead | Access::SampledReadCompute});
         w.bar({.buffer = w.back, .before = Access::CopyWrite, .after = Access::HostRead});
         must(w.d.wait(must(w.d.submit(std::move(w.e)))));
         must(w.d.map(w.back));
         w.d.unmap(w.back);
     }},
    {"AliasTakenOverInOrder", nullptr,
     [](World& w) {
         const HeapHandle h = must(w.d.create_heap({.size = 65536, .label = "heap"}));
         const BufferHandle first = must(w.d.create_buffer({.size = 4096, .heap = h, .label = "first"}));
         const BufferHandle second =
             must(w.d.create_buffer({.size = 4096, .heap = h, .heap_offset = 2048, .label = "second"}));
         w.bar({.buffer = first, .after = Access::CopyWrite});
         w.e->clear_buffer(first);
         w.bar({.buffer = second, .after = Access::CopyWrite, .alias_before = Access::CopyWrite});
         w.e->clear_buffer(second);
         w.bar({.buffer = first, .after = Access::CopyWrite, .alias_before = Access::CopyWrite});
         w.e->clear_buffer(first);
         must(w.d.submit(std::move(w.e)));
         w.d.destroy(first);
         w.d.destroy(second);
         w.d.destroy(h);
     }},
    {"DrawInOrder", nullptr,
     [](World& w) {
         const RenderPipeline p = w.triangle();
         const BufferHandle vertices =
             must(w.d.create_buffer({.size = 60, .usage = BufferUsage::Vertex, .label = "vertices"}));
         w.bar({.texture = w.color, .after = Access::ColorWrite});
         w.bar({.texture = w.depth, .after = Access::DepthWrite});
         const ColorAttachment colors[] = {{.view = w.d.whole_view(w.color)}};
         RenderPass& pass = w.e->begin_render({.colors = colors, .depth = {.view = w.d.whole_view(w.depth)}});
         pass.set_pipeline(p);
         pass.set_vertex_buffer(0, vertices);
         pass.set_push_struct(1.0f);
         pass.draw(3);
         pass.draw(3);
         pass.end();
         must(w.d.submit(std::move(w.e)));
         w.d.destroy(p);
         w.d.destroy(vertices);
     }},
};

}  // namespace

class EachRule : public NullTest, public testing::WithParamInterface<Rule> {};

TEST_P(EachRule, IsHeld) {
    const Rule& rule = GetParam();
    {
        World w{*device_};
        ASSERT_TRUE(complaints_.empty()) << complaints_.front();
        rule.act(w);
        if (rule.says) {
            EXPECT_TRUE(complained(rule.says)) << rule.says;
        }
    }
    if (!rule.says)
        for (const std::string& c : complaints_) ADD_FAILURE() << c;
    expects_none_ = false;  // the World's objects live on
}

INSTANTIATE_TEST_SUITE_P(Validate, EachRule, testing::ValuesIn(kRules),
                         [](const auto& rule) { return rule.param.name; });

// Nothing of a faulty recording may reach the device below.
TEST_F(NullTest, FaultyRecordingIsNotSubmitted) {
    const BufferHandle b = must(device_->create_buffer({.size = 64, .label = "b"}));
    auto e = device_->create_encoder("bad");
    e->clear_buffer(b, 0, 128);
    e->clear_buffer(b);
    Result<SubmitId> id = device_->submit(std::move(e));
    ASSERT_FALSE(id);
    EXPECT_NE(id.error().message.find("'bad': clear_buffer"), std::string::npos) << id.error().message;
    EXPECT_EQ(device_->last_submit(), 0u);
    EXPECT_EQ(device_->trace().find("clear"), std::string::npos) << device_->trace();
    EXPECT_TRUE(complained("go past the end of buffer 'b'"));
    device_->destroy(b);
}

TEST_F(NullTest, MissingBarrierIsNotSubmitted) {
    const BufferHandle b = must(device_->create_buffer({.size = 64, .label = "b"}));
    auto e = device_->create_encoder("racing");
    e->clear_buffer(b);
    e->clear_buffer(b);
    Result<SubmitId> id = device_->submit(std::move(e));
    ASSERT_FALSE(id);
    EXPECT_NE(id.error().message.find("'racing': clear_buffer"), std::string::npos) << id.error().message;
    EXPECT_EQ(device_->last_submit(), 0u);
    EXPECT_TRUE(complained("without a barrier"));
    device_->destroy(b);
}

TEST_F(NullTest, LeaksAreCountedAndNamed) {
    const BufferHandle b = must(device_->create_buffer({.size = 64, .label = "forgotten"}));
    const TextureHandle t = must(device_->create_texture({.size = {4, 4}, .label = "picture"}));
    EXPECT_EQ(device_->live_handle_count(), 2u);
    EXPECT_EQ(device_->live_handles(), "buffer 'forgotten'\ntexture 'picture'\n");
    device_->destroy(t);
    device_->destroy(b);
    EXPECT_EQ(device_->live_handle_count(), 0u);
}

}  // namespace kiln::rhi
