// SPDX-License-Identifier: MIT
// The GPU's bake is the CPU's, texel by texel, whichever way the texels take into the atlas.
#include "bake_compare.h"
#include "field/twenty_worlds.h"
#include "gpu_worlds.h"
#include "sdf/mesh_grid.h"

#include <cmath>

namespace kiln::render {
namespace {

struct BakeGpu : GpuTest {};

void expect_same(Runner& runner, field::worlds::World world, Baker baker, field::DistanceFormat format) {
    world.options.format = format;
    const auto f = world.field();
    ASSERT_TRUE(f);
    GpuField gpu(runner);
    rhi::must(gpu.update(f, baker));
    expect_same_texels(gpu, *f, world.name);
}

TEST_F(BakeGpu, TexelsOfTheStorageTextureAreTheCpusOwn) {
    for (const auto& world : {field::worlds::sphere_of(10), field::worlds::blends(), field::worlds::thin_walls()}) {
        expect_same(*runner_, world, Baker::Storage, field::DistanceFormat::Half);
    }
    expect_same(*runner_, field::worlds::blends(), Baker::Storage, field::DistanceFormat::Snorm8);
}

TEST_F(BakeGpu, TexelsThatGoThroughABufferAreTheSame) {
    expect_same(*runner_, field::worlds::blends(), Baker::Copy, field::DistanceFormat::Half);
    expect_same(*runner_, field::worlds::blends(), Baker::Copy, field::DistanceFormat::Snorm8);
    expect_same(*runner_, field::worlds::boxes(), Baker::Host, field::DistanceFormat::Half);
    expect_same(*runner_, field::worlds::boxes(), Baker::Host, field::DistanceFormat::Snorm8);
}

struct BakeSlowGpu : GpuTest {};

TEST_F(BakeSlowGpu, TexelsOfTwentyWorldsAreTheCpusOwn) {
    for (const auto& world : field::worlds::twenty()) {
        expect_same(*runner_, world, Baker::Storage, field::DistanceFormat::Half);
        expect_same(*runner_, world, Baker::Copy, field::DistanceFormat::Snorm8);
    }
}

TEST_F(BakeGpu, TexelsOfEveryShapeAndWarpAreTheCpusOwn) {
    expect_same(*runner_, field::worlds::every_shape(), Baker::Storage, field::DistanceFormat::Half);
    expect_same(*runner_, field::worlds::every_warp(), Baker::Storage, field::DistanceFormat::Half);
}

// Both levels of a mesh's grid, moved, cut and blended.
TEST_F(BakeGpu, MeshesAreReadAsTheCpuReadsThem) {
    field::worlds::World w;
    w.name = "mesh";
    w.meshes.push_back(sdf::ball_grid());
    Edit mesh = field::worlds::edit(SampledMesh{}, {0.1f, 0, -0.05f});
    mesh.node.shape.data = "0";
    mesh.node.transform.scale = {1.5f, 1.5f, 1.5f};
    mesh.node.material = MaterialId{1, 0};
    // A layer over the mesh where only its coarse lattice is.
    Edit layer = mesh;
    layer.node.domain = {Round{.radius = 0.16f}};
    layer.node.transform.position = {-0.4f, 0.8f, 0};
    layer.node.material = MaterialId{2, 0};
    w.edits = {mesh, layer, field::worlds::edit(Sphere{.radius = 0.4f}, {-0.3f, 0.3f, 0}, Op::Subtract, 0.1f)};
    w.options.voxel_size = 0.04f;
    w.options.bounds = {{-2.5f, -2, -2}, {2, 2.5f, 2}};
    for (const Baker baker : {Baker::Storage, Baker::Copy})
        expect_same(*runner_, w, baker, field::DistanceFormat::Half);
}

// Thirty values that stay alive to the end: more than there are registers.
std::string many_alive() {
    std::string names, value = "0", mirror = "0";
    for (int i = 0; i < 30; ++i) {
        names += "a" + std::to_string(i) + " = sin(" + std::to_string(i + 1) + "*x + y);";
        value = "(" + value + " + a" + std::to_string(i) + "*z)";
        mirror = "max(" + mirror + ", a" + std::to_string(29 - i) + ")";
    }
    return names + "length(p) - 0.4 + 0.01*" + value + " - 0.02*" + mirror;
}

TEST_F(BakeGpu, FormulasAreTheCpusOwn) {
    field::worlds::World world{
        "formulas", {}, {.voxel_size = 0.04f, .bounds = {{-1.2f, -1.2f, -1.2f}, {1.2f, 1.2f, 1.2f}}}};
    world.edits.push_back(field::worlds::edit(Expression{.expression = "length(p) - 0.8 - 0.1*sin(8*x)*cos(5*y)"}));
    world.edits.push_back(field::worlds::edit(
        Expression{
            .expression = "max(atan2(y, x + 3), exp(z) - 1.2) + log(2 + x^2) - 0.9 + mod(0*x + 0.3, 0.2) + floor(0.5)",
            .half_extents = {0.6f, 0.6f, 0.6f}},
        {0.4f, 0.2f, 0.1f}, Op::Subtract, 0.1f));
    expect_same(*runner_, world, Baker::Storage, field::DistanceFormat::Half);
    expect_same(*runner_, world, Baker::Copy, field::DistanceFormat::Snorm8);
}

TEST_F(BakeGpu, BricksTheGpuCannotRunAreTheCpusAndCounted) {
    field::worlds::World world{
        "mixed", {}, {.voxel_size = 0.03f, .bounds = {{-0.6f, -0.6f, -0.6f}, {2.2f, 0.6f, 0.6f}}}};
    world.edits.push_back(
        field::worlds::edit(Expression{.expression = many_alive(), .half_extents = {0.5f, 0.5f, 0.5f}}));
    world.edits.push_back(field::worlds::edit(Sphere{.radius = 0.4f}, {1.6f, 0, 0}));
    for (const Baker baker : {Baker::Storage, Baker::Copy}) {
        expect_same(*runner_, world, baker, field::DistanceFormat::Half);
        GpuField gpu(*runner_);
        const auto f = world.field();
        rhi::must(gpu.update(f, baker));
        EXPECT_GT(gpu.bricks_on_host(), f->stats().bricks / 4);
        EXPECT_LT(gpu.bricks_on_host(), f->stats().bricks * 3 / 4);
        EXPECT_EQ(gpu.bricks_baked(), f->stats().bricks);
    }
    const auto renderer = renderer_or_skip();
    if (!renderer) return;
    const auto refused = renderer->render(frame_of(world), {.width = 16, .height = 16, .analytic = true});
    ASSERT_FALSE(refused);
    EXPECT_NE(refused.error().message.find("draw it from bricks"), std::string::npos);
    EXPECT_TRUE(renderer->render(frame_of(world), {.width = 16, .height = 16}));
}

TEST_F(BakeGpu, MoreThanSixteenMaterialsKeepTheHeaviest) {
    field::worlds::World world{"many", {}, {.voxel_size = 0.2f, .bounds = {{-1, -1, -1}, {2, 2, 2}}}};
    for (int i = 0; i < 30; ++i) {
        const float a = float(i) * 0.7f;
        world.edits.push_back(field::worlds::of_material(
            field::worlds::edit(Sphere{.radius = 0.08f + 0.004f * float(i)},
                                {0.7f + 0.45f * std::cos(a), 0.03f * float(i) + 0.25f, 0.7f + 0.45f * std::sin(a)}),
            uint32_t(i)));
    }
    expect_same(*runner_, world, Baker::Storage, field::DistanceFormat::Half);
    GpuField gpu(*runner_);
    rhi::must(gpu.update(world.field(), Baker::Storage));
    EXPECT_GT(rhi::must(gpu.dropped_materials()), 0u);
}

TEST_F(BakeGpu, AnEditBakesItsOwnBricksAlone) {
    field::worlds::World world = field::worlds::blends();
    const auto before = world.field();
    GpuField gpu(*runner_);
    rhi::must(gpu.update(before, Baker::Storage));
    EXPECT_EQ(gpu.bricks_baked(), before->stats().bricks);
    field::worlds::Live live(world.edits);
    world.edits.push_back(field::worlds::edit(Sphere{.radius = 0.1f}, {0.9f, 0.9f, 0.9f}));
    const std::vector<field::RowChange> changes = live.become(world.edits);
    const auto after = rhi::must(field::Field::update(*before, live.program(), changes));
    rhi::must(gpu.update(after, Baker::Storage));
    EXPECT_LT(gpu.bricks_baked(), before->stats().bricks / 4);
    EXPECT_GT(gpu.bricks_baked(), 0u);
    expect_same_texels(gpu, *after, "after the edit");
}

}  // namespace
}  // namespace kiln::render
