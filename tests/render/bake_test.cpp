// SPDX-License-Identifier: MIT
// The GPU's bake is the CPU's, texel by texel, whichever way the texels take into the atlas.
#include "field/codes.gpu.h"
#include "field/host_bricks.h"
#include "gpu_worlds.h"
#include "render/gpu_field.h"

#include <cmath>

namespace kiln::render {
namespace {

struct BakeGpu : GpuTest {};

struct Tally {
    uint64_t texels = 0, inexact = 0, signs = 0, far = 0, words = 0;
    double worst = 0;
};

Tally compare(GpuField& gpu, const field::Field& f) {
    Tally tally;
    const bool half = f.options().format == field::DistanceFormat::Half;
    const std::vector<uint32_t> slots = f.slots();
    const auto read = rhi::must(gpu.read_back(slots));
    const float h = f.grid().voxel_size;
    for (size_t i = 0; i < read.size(); ++i) {
        const field::BrickRecord& r = f.records()[slots[i]];
        field::BrickEvaluator evaluator(f.program(), h);
        evaluator.evaluate(f.code_of(slots[i]), {r.texel_x, r.texel_y, r.texel_z});
        const field::BrickContent expected = evaluator.content(f.options().format);
        for (size_t t = 0; t < 512; ++t) {
            const float d = evaluator.distances()[t] / h;
            const float want = half ? field::stored_half(d) : field::stored_snorm8(d);
            const float got =
                half ? field::half_value(read[i].distance_codes[t]) : field::snorm8_value(read[i].distance_codes[t]);
            const float quantum =
                half ? std::ldexp(1.0f, std::max(std::ilogb(std::max(std::fabs(want), 1e-4f)) - 10, -14))
                     : 4.0f / 127.0f;
            const float off = std::fabs(got - want);
            ++tally.texels;
            tally.inexact += off != 0;
            tally.signs += (got <= 0) != (want <= 0);
            tally.far += off > std::max(quantum, 0x1p-10f) * 1.001f;
            tally.worst = std::max(tally.worst, double(off));
            // Near the band's end either side may call a texel far; weights may round the other way.
            if (std::fabs(d) > 3.99f) continue;
            const uint32_t a = read[i].material_words[t], b = expected.word(t);
            const bool same = a == b || ((a & 255) == (b & 255) && std::abs(int(a >> 8) - int(b >> 8)) <= 1) ||
                              (a >> 8 <= 1 && b >> 8 <= 1 && (a & 15) == (b & 15));
            tally.words += !same;
        }
        for (size_t k = 0; k < 16; ++k) tally.words += read[i].palette[k] != expected.palette(k) ? 1 : 0;
    }
    return tally;
}

void expect_same(Runner& runner, field::worlds::World world, Baker baker, field::DistanceFormat format) {
    world.options.format = format;
    const auto f = world.field();
    ASSERT_TRUE(f);
    GpuField gpu(runner);
    rhi::must(gpu.update(f, baker));
    const Tally tally = compare(gpu, *f);
    EXPECT_GT(tally.texels, 2000u);
    EXPECT_EQ(tally.far, 0u) << world.name << ": of " << tally.texels << ", worst " << tally.worst << " voxels";
    EXPECT_EQ(tally.words, 0u) << world.name;
    EXPECT_LE(double(tally.signs), 1e-4 * double(tally.texels)) << world.name;
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
    const Tally tally = compare(gpu, *after);
    EXPECT_EQ(tally.far, 0u);
    EXPECT_EQ(tally.words, 0u);
}

}  // namespace
}  // namespace kiln::render
