// SPDX-License-Identifier: MIT
// The tiers above the floor: box trees with the pipelines that trace rays through them, and mesh shaders. Their rules on the null device; on
// a device what they do, or, where it has none, that they are refused in one sentence.
#include "rhi_test.h"

#include "shaders/rhi_boxes_rchit.spv.h"
#include "shaders/rhi_boxes_rgen.spv.h"
#include "shaders/rhi_boxes_rint.spv.h"
#include "shaders/rhi_boxes_rmiss.spv.h"
#include "shaders/rhi_flat_frag.spv.h"
#include "shaders/rhi_squares_mesh.spv.h"

#include <functional>

namespace kiln::rhi {

namespace {

TEST(TiersReflect, StagesAndBindingsOfTheTiersAreKnown) {
    const Reflection raygen = must(reflect_spirv(kRhiBoxesRgenSpv));
    EXPECT_EQ(raygen.stage, ShaderStage::RayGen);
    ASSERT_EQ(raygen.bindings.size(), 2u);
    EXPECT_EQ(raygen.bindings[0].kind, BindingKind::BoxTree);
    EXPECT_EQ(raygen.bindings[1].kind, BindingKind::StorageBuffer);
    EXPECT_TRUE(raygen.bindings[1].write_only);
    EXPECT_EQ(must(reflect_spirv(kRhiBoxesRintSpv)).stage, ShaderStage::Intersection);
    EXPECT_EQ(must(reflect_spirv(kRhiBoxesRchitSpv)).stage, ShaderStage::ClosestHit);
    EXPECT_EQ(must(reflect_spirv(kRhiBoxesRmissSpv)).stage, ShaderStage::Miss);
    const Reflection mesh = must(reflect_spirv(kRhiSquaresMeshSpv));
    EXPECT_EQ(mesh.stage, ShaderStage::Mesh);
    EXPECT_EQ(mesh.workgroup, (std::array<uint32_t, 3>{3, 1, 1}));
    EXPECT_EQ(check_floor(raygen), std::vector<std::string>{"needs RayTracingKHR"});
    EXPECT_EQ(check_floor(mesh), std::vector<std::string>{"needs MeshShadingEXT"});
    EXPECT_TRUE(check_floor(raygen, {.rt_pipeline = true}).empty());
    EXPECT_TRUE(check_floor(mesh, {.mesh_shader = true}).empty());
}

// Shaders and buffers of both tiers.
struct Tools {
    explicit Tools(Device& device) : d(device) {}
    ~Tools() {
        for (const BindGroup g : groups) d.destroy(g);
        for (const BufferHandle b : {tree, boxes, met, back}) d.destroy(b);
        d.destroy(pipeline);
        for (const ShaderModule s : {raygen, miss, intersection, closest_hit}) d.destroy(s);
    }
    TracePipelineDesc desc() const {
        return {
            .raygen = raygen, .miss = miss, .intersection = intersection, .closest_hit = closest_hit, .label = "boxes"};
    }
    BindGroup group() {
        const BindGroupEntry entries[] = {{.binding = 0, .buffer = tree}, {.binding = 1, .buffer = met}};
        groups.push_back(must(d.create_bind_group({.layout = d.group_layout(pipeline, 0), .entries = entries})));
        return groups.back();
    }
    void trace(CommandEncoder& e) {
        ComputePass& pass = e.begin_compute("trace");
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, group());
        pass.trace(4, 4);
        pass.end();
    }

    Device& d;
    // Square (x, y) has 16 boxes above each other, in an order of no help; see rhi_boxes.rint.
    static constexpr uint32_t kBoxes = 32;
    ShaderModule raygen = must(d.create_shader_module({.spirv = kRhiBoxesRgenSpv, .label = "raygen"}));
    ShaderModule miss = must(d.create_shader_module({.spirv = kRhiBoxesRmissSpv, .label = "miss"}));
    ShaderModule intersection = must(d.create_shader_module({.spirv = kRhiBoxesRintSpv, .label = "intersection"}));
    ShaderModule closest_hit = must(d.create_shader_module({.spirv = kRhiBoxesRchitSpv, .label = "closest hit"}));
    TracePipeline pipeline = must(d.create_trace_pipeline(desc()));
    BufferHandle boxes = must(d.create_buffer(
        {.size = kBoxes * sizeof(Box), .usage = BufferUsage::Boxes | BufferUsage::CopyDst, .label = "boxes"}));
    BufferHandle tree =
        must(d.create_buffer({.size = d.box_tree_bytes(kBoxes), .usage = BufferUsage::BoxTree, .label = "tree"}));
    BufferHandle met = must(d.create_buffer({.size = 16 * 8, .label = "met"}));
    BufferHandle back = must(d.create_buffer(
        {.size = 16 * 8, .usage = BufferUsage::CopyDst, .memory = MemoryKind::Readback, .label = "back"}));
    std::vector<BindGroup> groups;
};

struct Rule {
    const char* name;
    const char* says;  // null: nothing
    std::function<void(Device&, Tools&)> act;
};
void PrintTo(const Rule& r, std::ostream* out) { *out << r.name; }

void submit(Device& d, const std::function<void(CommandEncoder&)>& record) {
    auto e = d.create_encoder("frame");
    record(*e);
    static_cast<void>(d.submit(std::move(e)));
}

const Rule kRules[] = {
    {"AllIsWell", nullptr,
     [](Device& d, Tools& t) {
         submit(d, [&](CommandEncoder& e) {
             e.build_box_tree(t.tree, t.boxes, 0, Tools::kBoxes);
             barrier(e, {.buffer = t.tree, .before = Access::BoxTreeWrite, .after = Access::BoxTreeRead});
             t.trace(e);
         });
     }},
    {"TracedUnbuilt", "no box tree was ever built in buffer 'tree'",
     [](Device& d, Tools& t) { submit(d, [&](CommandEncoder& e) { t.trace(e); }); }},
    {"TracedWithoutBarrier", "is ready for BoxTreeWrite; a barrier is missing",
     [](Device& d, Tools& t) {
         submit(d, [&](CommandEncoder& e) {
             e.build_box_tree(t.tree, t.boxes, 0, 1);
             t.trace(e);
         });
     }},
    {"BuiltOfNothing", "no boxes",
     [](Device& d, Tools& t) { submit(d, [&](CommandEncoder& e) { e.build_box_tree(t.tree, t.boxes, 0, 0); }); }},
    {"BuiltPastTheEnd", "past the end of buffer 'boxes'",
     [](Device& d, Tools& t) {
         submit(d, [&](CommandEncoder& e) { e.build_box_tree(t.tree, t.boxes, 24, Tools::kBoxes); });
     }},
    {"BuiltInTooLittle", "a tree of 32 boxes takes",
     [](Device& d, Tools& t) {
         const BufferHandle small =
             must(d.create_buffer({.size = 64, .usage = BufferUsage::BoxTree, .label = "small"}));
         submit(d, [&](CommandEncoder& e) { e.build_box_tree(small, t.boxes, 0, Tools::kBoxes); });
         d.destroy(small);
     }},
    {"BuiltOfWhatAreNoBoxes", "buffer 'met' lacks the usage for BoxesRead",
     [](Device& d, Tools& t) { submit(d, [&](CommandEncoder& e) { e.build_box_tree(t.tree, t.met, 0, 1); }); }},
    {"BuiltInWhatIsNoTree", "buffer 'met' lacks the usage for BoxTreeWrite",
     [](Device& d, Tools& t) { submit(d, [&](CommandEncoder& e) { e.build_box_tree(t.met, t.boxes, 0, 1); }); }},
    {"TreeForMore", "usage BoxTree stands alone",
     [](Device& d, Tools&) {
         static_cast<void>(d.create_buffer({.size = 64, .usage = BufferUsage::BoxTree | BufferUsage::Storage}));
     }},
    {"BoundAsATree", "buffer 'met' lacks usage BoxTree",
     [](Device& d, Tools& t) {
         const BindGroupEntry entries[] = {{.binding = 0, .buffer = t.met}, {.binding = 1, .buffer = t.met}};
         static_cast<void>(d.create_bind_group({.layout = d.group_layout(t.pipeline, 0), .entries = entries}));
     }},
    {"ShaderInTheWrongPlace", "'miss' is not a ray generation shader",
     [](Device& d, Tools& t) {
         TracePipelineDesc desc = t.desc();
         desc.raygen = t.miss;
         static_cast<void>(d.create_trace_pipeline(desc));
     }},
    {"TracedWithoutPipeline", "no trace pipeline is set",
     [](Device& d, Tools&) {
         submit(d, [&](CommandEncoder& e) {
             ComputePass& pass = e.begin_compute("pass");
             pass.trace(1, 1);
             pass.end();
         });
     }},
    {"DispatchedWithATracePipeline", "no pipeline is set",
     [](Device& d, Tools& t) {
         submit(d, [&](CommandEncoder& e) {
             ComputePass& pass = e.begin_compute("pass");
             pass.set_pipeline(t.pipeline);
             pass.dispatch(1);
             pass.end();
         });
     }},
};

struct TierRules : NullTest, testing::WithParamInterface<Rule> {};

TEST_P(TierRules, AreHeld) {
    {
        Tools tools(*device_);
        GetParam().act(*device_, tools);
    }
    if (GetParam().says) {
        EXPECT_TRUE(complained(GetParam().says));
    }
}
INSTANTIATE_TEST_SUITE_P(Tiers, TierRules, testing::ValuesIn(kRules),
                         [](const auto& rule) { return std::string(rule.param.name); });

struct MeshTools {
    explicit MeshTools(Device& device) : d(device) {}
    ~MeshTools() {
        for (const ShaderModule s : {mesh, frag}) d.destroy(s);
    }
    Result<RenderPipeline> pipeline(ShaderModule instead = {}) {
        const ColorTarget targets[] = {{.format = Format::Rgba8Unorm}};
        RenderPipelineDesc desc{.fragment = frag, .colors = targets, .label = "squares"};
        desc.mesh = instead ? instead : mesh;
        return d.create_render_pipeline(desc);
    }
    Device& d;
    ShaderModule mesh = must(d.create_shader_module({.spirv = kRhiSquaresMeshSpv, .label = "mesh"}));
    ShaderModule frag = must(d.create_shader_module({.spirv = kRhiFlatFragSpv, .label = "frag"}));
};

struct TiersNull : NullTest {};

TEST_F(TiersNull, AMeshPipelineIsDrawnByGroupsAndNoOther) {
    Device& d = *device_;
    MeshTools t(d);
    const RenderPipeline p = must(t.pipeline());
    const TextureHandle color = must(d.create_texture(
        {.format = Format::Rgba8Unorm, .size = {4, 4}, .usage = TextureUsage::Color, .label = "color"}));
    const auto draw = [&](bool groups) {
        submit(d, [&](CommandEncoder& e) {
            barrier(e, {.texture = color, .after = Access::ColorWrite});
            const ColorAttachment attachments[] = {{.view = d.whole_view(color)}};
            RenderPass& pass = e.begin_render({.colors = attachments, .label = "pass"});
            pass.set_pipeline(p);
            groups ? pass.draw_mesh_groups(2) : pass.draw(3);
            pass.end();
        });
    };
    draw(true);
    EXPECT_NE(d.trace().find("mesh groups 2x1x1"), std::string::npos);
    draw(false);
    EXPECT_TRUE(complained("pipeline 'squares' has a mesh shader: draw_mesh_groups"));
    EXPECT_FALSE(t.pipeline(t.frag));
    EXPECT_TRUE(complained("'frag' is not a mesh shader"));
    d.destroy(p);
    d.destroy(color);
}

// ---- on a device

struct TiersVulkanGpu : VulkanTest {};

// Of the even boxes of a square the one with the largest number; nothing over squares without any.
TEST_F(TiersVulkanGpu, RaysFindTheNearestReportOfTheBoxesTheyMeet) {
    Device& d = *device_;
    if (!d.caps().rt_pipeline) {
        EXPECT_FALSE(d.create_buffer({.size = 64, .usage = BufferUsage::Boxes, .label = "boxes"}));
        EXPECT_TRUE(complained("usages Boxes and BoxTree need the capability rt_pipeline"));
        EXPECT_EQ(d.box_tree_bytes(4), 0u);
        EXPECT_TRUE(complained("the device has no ray-tracing pipelines"));
        return;
    }
    Tools t(d);
    std::vector<Box> boxes;
    std::vector<std::array<uint32_t, 2>> expected(16, {~0u, ~0u});
    for (uint32_t i = 0; i < Tools::kBoxes; ++i) {
        const uint32_t square = i * 7 % 12;  // squares 12 to 15 stay empty
        const float x = float(square % 4), y = float(square / 4), z = float(i * 5 % 9);
        boxes.push_back({x, y, z, x + 1, y + 1, z + 0.5f});
        if (i % 2 == 0) expected[square] = {i, 50 - i};
    }
    must(d.write_buffer(t.boxes, 0, bytes_of(boxes)));
    // Twice: the second tree is another one, in the same buffer.
    for (const uint32_t count : {1u, Tools::kBoxes}) {
        submit(d, [&](CommandEncoder& e) {
            if (count > 1) barrier(e, {.buffer = t.tree, .before = Access::BoxTreeRead, .after = Access::BoxTreeWrite});
            e.build_box_tree(t.tree, t.boxes, 0, count);
            barrier(e, {.buffer = t.tree, .before = Access::BoxTreeWrite, .after = Access::BoxTreeRead});
            if (count > 1)
                barrier(e, {.buffer = t.met, .before = Access::CopyRead, .after = Access::StorageWriteCompute});
            t.trace(e);
            barrier(e, {.buffer = t.met, .before = Access::StorageWriteCompute, .after = Access::CopyRead});
            if (count > 1) barrier(e, {.buffer = t.back, .before = Access::HostRead, .after = Access::CopyWrite});
            e.copy_buffer(t.met, 0, t.back, 0, 16 * 8);
            barrier(e, {.buffer = t.back, .before = Access::CopyWrite, .after = Access::HostRead});
        });
        must(d.wait_idle());
        const auto met = mapped<std::array<uint32_t, 2>>(d, t.back, 16);
        for (uint32_t square = 0; square < 16; ++square) {
            const std::array<uint32_t, 2> one =
                square == 0 ? std::array<uint32_t, 2>{0, 50} : std::array<uint32_t, 2>{~0u, ~0u};
            EXPECT_EQ(met[square], count == 1 ? one : expected[square]) << count << " boxes, square " << square;
        }
    }
}

// Groups keep their order: the green half lies over the red whole.
TEST_F(TiersVulkanGpu, GroupsOfAMeshShaderDrawInOrder) {
    Device& d = *device_;
    MeshTools t(d);
    if (!d.caps().mesh_shader) {
        EXPECT_FALSE(t.pipeline());
        EXPECT_TRUE(complained("needs MeshShadingEXT"));
        return;
    }
    const RenderPipeline p = must(t.pipeline());
    const TextureHandle color = must(d.create_texture({.format = Format::Rgba8Unorm,
                                                       .size = {8, 8},
                                                       .usage = TextureUsage::Color | TextureUsage::CopySrc,
                                                       .label = "color"}));
    const BufferHandle back = must(
        d.create_buffer({.size = 256, .usage = BufferUsage::CopyDst, .memory = MemoryKind::Readback, .label = "back"}));
    submit(d, [&](CommandEncoder& e) {
        barrier(e, {.texture = color, .after = Access::ColorWrite});
        const ColorAttachment attachments[] = {{.view = d.whole_view(color)}};
        RenderPass& pass = e.begin_render({.colors = attachments, .label = "pass"});
        pass.set_pipeline(p);
        pass.draw_mesh_groups(2);
        pass.end();
        barrier(e, {.texture = color, .before = Access::ColorWrite, .after = Access::CopyRead});
        e.copy_texture_to_buffer({.texture = color}, {.buffer = back}, {8, 8});
        barrier(e, {.buffer = back, .before = Access::CopyWrite, .after = Access::HostRead});
    });
    must(d.wait_idle());
    const auto texels = mapped<uint32_t>(d, back, 64);
    for (uint32_t y = 0; y < 8; ++y) {
        EXPECT_EQ(texels[8 * y + 1], 0xff0000ffu) << "red at row " << y;
        EXPECT_EQ(texels[8 * y + 4], 0xff00ff00u) << "green at row " << y;
    }
    d.destroy(p);
    d.destroy(color);
    d.destroy(back);
}

}  // namespace

}  // namespace kiln::rhi
