// SPDX-License-Identifier: MIT
// What recording refuses, each with its sentence.
#include "render/graph_samples.h"

#include "render/graph_plan.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace kiln::render::samples {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

class GraphRecording : public testing::Test {
protected:
    Graph g;
    Image a = g.create("a", kSmall), b = g.create("b", kSmall);
    Buffer words = g.create_buffer("words", kWords * 4);

    void fill(Image& image) { g.dispatch(kFill, image.size, {g.write(image)}, FillPush{}); }
    std::string compile_error() {
        const Result<Plan> plan = g.compile({});
        return plan ? "" : plan.error().message;
    }
};

TEST_F(GraphRecording, OfCorrectPassesHasNoErrors) {
    fill(a);
    g.dispatch(kBlend, b.size, {g.sampled(a), g.read(a), g.write(b)});
    g.clear(words);
    Buffer other = g.create_buffer("other", kWords * 4);
    g.dispatch(kCombine, rhi::Extent{kWords}, {g.read(words), g.write(other)}, CombineParams{});
    g.dispatch(kCombine, rhi::Extent{kWords}, {g.read(words), g.uniform(g.block(CombineParams{})), g.write(other)});
    g.output(other);
    EXPECT_THAT(g.errors(), IsEmpty());
    EXPECT_EQ(compile_error(), "");
}

TEST_F(GraphRecording, RefusesStaleVersions) {
    fill(a);
    const Image old = a;
    fill(a);
    g.dispatch(kDown, b.size, {g.read(old), g.write(b)});
    ASSERT_THAT(g.errors(), ElementsAre(HasSubstr("read 'a': stale version 1, a pass has made it version 2")));
    EXPECT_THAT(compile_error(), HasSubstr("stale"));
}

TEST_F(GraphRecording, RefusesStaleCopiesForWritingToo) {
    Image copy = a;
    fill(a);
    fill(copy);
    EXPECT_THAT(g.errors(), ElementsAre(HasSubstr("write 'a': stale version 0")));
}

TEST_F(GraphRecording, RefusesReadsOfWhatNothingWrote) {
    g.dispatch(kDown, b.size, {g.read(a), g.write(b)});
    g.readback(b);
    EXPECT_THAT(compile_error(), HasSubstr("pass 'down' reads 'a' (mip 0, layer 0), which nothing has written"));
}

TEST_F(GraphRecording, RefusesReadsOfOneUnwrittenMip) {
    Image chain = g.create("chain", {.size = {8, 8}, .mips = 2});
    g.dispatch(kFill, chain.size, {g.write(chain, mip(0))}, FillPush{});
    g.dispatch(kDown, b.size, {g.read(chain), g.write(b)});
    g.readback(b);
    EXPECT_THAT(compile_error(), HasSubstr("reads 'chain' (mip 1, layer 0)"));
}

TEST_F(GraphRecording, RefusesReadsOfAnEmptyImport) {
    const Image atlas = g.import("atlas", rhi::TextureHandle{1, 1}, kSmall, rhi::Access::Undefined);
    g.dispatch(kDown, b.size, {g.read(atlas), g.write(b)});
    g.readback(b);
    EXPECT_THAT(compile_error(), HasSubstr("reads 'atlas'"));
}

TEST_F(GraphRecording, RefusesAnOutputThatNothingWrote) {
    g.output(a);
    EXPECT_THAT(compile_error(), HasSubstr("output 'a': nothing has written it"));
}

TEST_F(GraphRecording, RefusesReadingAndWritingTheSameMipAtOnce) {
    fill(a);
    const Use read = g.read(a);
    g.dispatch(kDown, a.size, {read, g.write(a)});
    EXPECT_THAT(g.errors(),
                ElementsAre(HasSubstr("'a' is used as SampledReadCompute and as StorageWriteCompute at once")));
}

TEST_F(GraphRecording, RefusesTheWrongNumberOfUses) {
    g.dispatch(kDown, b.size, {g.write(b)});
    g.dispatch(kFill, b.size, {g.write(b), g.write(a)}, FillPush{});
    ASSERT_EQ(g.errors().size(), 2u);
    EXPECT_THAT(g.errors()[0], HasSubstr("the shader only reads it"));
    EXPECT_THAT(g.errors()[1], HasSubstr("1 uses are too many"));
}

TEST_F(GraphRecording, RefusesAMissingUse) {
    fill(a);
    g.dispatch(kDown, b.size, {g.read(a)});
    EXPECT_THAT(g.errors(), ElementsAre(HasSubstr("nothing in the list for binding 0.1 '' (StorageTexture)")));
}

TEST_F(GraphRecording, RefusesAnImageOfAnotherFormat) {
    Image other = g.create("other", {.size = {8, 8}, .format = rhi::Format::Rgba32Float});
    fill(other);
    EXPECT_THAT(g.errors(), ElementsAre(HasSubstr("'other' is Rgba32Float, the shader declares Rgba16Float")));
}

TEST_F(GraphRecording, RefusesAnImageOfAnotherDimension) {
    Image volume = g.create("volume", {.size = {8, 8, 8}, .dimension = rhi::Dimension::D3});
    fill(volume);
    EXPECT_THAT(g.errors(), ElementsAre(HasSubstr("'volume' is 3D, the shader declares 2D")));
}

TEST_F(GraphRecording, RefusesTexelsOfAnotherKind) {
    Image ids = g.create("ids", {.size = {8, 8}, .format = rhi::Format::R32Uint});
    g.clear(ids);
    g.dispatch(kDown, b.size, {g.read(ids), g.write(b)});
    EXPECT_THAT(g.errors(), ElementsAre(HasSubstr("another kind of texel")));
}

TEST_F(GraphRecording, RefusesAStorageImageOfSeveralMips) {
    Image chain = g.create("chain", {.size = {8, 8}, .mips = 3});
    fill(chain);
    EXPECT_THAT(g.errors(), ElementsAre(HasSubstr("'chain' has 3 mips: give one")));
}

TEST_F(GraphRecording, RefusesMipsBeyondTheImage) {
    g.dispatch(kFill, a.size, {g.write(a, mip(1))}, FillPush{});
    EXPECT_THAT(g.errors(), ElementsAre(HasSubstr("'a' has 1 mips")));
}

TEST_F(GraphRecording, RefusesABufferWhereAnImageBelongs) {
    g.dispatch(kFill, a.size, {g.write(words)}, FillPush{});
    EXPECT_THAT(g.errors(), ElementsAre(HasSubstr("the list has buffer 'words' here")));
}

TEST_F(GraphRecording, RefusesWriteWhereTheShaderAlsoReads) {
    Image scalar = g.create("scalar", {.size = {8, 8}, .format = rhi::Format::R32Float});
    g.dispatch(kScale, scalar.size, {g.write(scalar)});
    EXPECT_THAT(g.errors(), ElementsAre(HasSubstr("the shader may read it")));
}

TEST_F(GraphRecording, RefusesReadWhereTheShaderWrites) {
    Image scalar = g.create("scalar", {.size = {8, 8}, .format = rhi::Format::R32Float});
    g.clear(scalar);
    g.dispatch(kScale, scalar.size, {g.read(scalar)});
    EXPECT_THAT(g.errors(), ElementsAre(HasSubstr("the shader may write it")));
}

TEST_F(GraphRecording, RefusesWrongPushData) {
    g.dispatch(kFill, a.size, {g.write(a)}, 1.0f);
    g.dispatch(kFill, a.size, {g.write(a)});
    ASSERT_EQ(g.errors().size(), 2u);
    EXPECT_THAT(g.errors()[0], HasSubstr("push data of 4 B, the shader declares 32 B"));
}

TEST_F(GraphRecording, RefusesWrongUniformBlocks) {
    g.clear(words);
    Buffer other = g.create_buffer("other", kWords * 4);
    g.dispatch(kCombine, rhi::Extent{kWords}, {g.read(words), g.write(other)}, 1u);
    EXPECT_THAT(g.errors(), ElementsAre(HasSubstr("block of 4 B, the shader declares 16 B")));
}

TEST_F(GraphRecording, RefusesParametersThatNothingTakes) {
    fill(a);
    g.dispatch(kDown, b.size, {g.read(a), g.write(b)}, 1u);
    EXPECT_THAT(g.errors(), ElementsAre(HasSubstr("parameters are too many")));
}

TEST_F(GraphRecording, RefusesASamplerThatNoBindingFollows) {
    fill(a);
    g.dispatch(kDown, b.size, {g.sampled(a), g.write(b)});
    EXPECT_THAT(g.errors(), ElementsAre(HasSubstr("which no sampler binding follows")));
}

TEST_F(GraphRecording, RefusesUnalignedAndOutlyingBuffers) {
    g.clear(words);
    Buffer other = g.create_buffer("other", kWords * 4);
    g.dispatch(kAccumulate, rhi::Extent{kWords}, {g.read(words, 4), g.read_write(other)});
    EXPECT_THAT(g.errors(), ElementsAre(HasSubstr("offset 4 must be a multiple of 256")));
}

TEST_F(GraphRecording, RefusesTooManyWorkgroups) {
    g.dispatch(kFill, Groups{70000}, {g.write(a)}, FillPush{});
    EXPECT_THAT(g.errors(), ElementsAre(HasSubstr("70000 workgroups along axis 0")));
}

TEST_F(GraphRecording, RefusesCopiesOutsideTheImage) {
    fill(a);
    const CopyRegion region{.origin = {60, 0, 0}, .size = {8, 8}};
    g.copy(a, words, {&region, 1});
    EXPECT_THAT(g.errors(), ElementsAre(HasSubstr("is empty or outside 'a'")));
}

TEST_F(GraphRecording, RefusesCopiesOutsideTheBuffer) {
    g.clear(words);
    const CopyRegion region{.size = {64, 32}};
    g.copy(words, a, {&region, 1});
    EXPECT_THAT(g.errors(), ElementsAre(HasSubstr("of 'words' (256 B)")));
}

TEST_F(GraphRecording, RefusesGroupCountsOutsideTheBuffer) {
    g.clear(words);
    Buffer other = g.create_buffer("other", kWords * 4);
    g.clear(other);
    g.dispatch_indirect(kAccumulate, words, 248, {g.read(words), g.read_write(other)});
    EXPECT_THAT(g.errors(), ElementsAre(HasSubstr("group counts at byte 248 of 'words'")));
}

TEST_F(GraphRecording, RefusesTargetsTheKernelIsNotFor) {
    Image depth = g.create("depth", {.size = kSmall.size, .format = rhi::Format::Depth32Float});
    Image other = g.create("other", {.size = kSmall.size, .format = rhi::Format::Rgba32Float});
    g.clear(depth);
    const DrawCall call{.vertices = 3};
    g.draw(kTriangle, {.colors = {{.image = &other}}, .depth = {.image = &depth}}, {}, TrianglePush{}, {&call, 1});
    g.draw(kTriangle, {.colors = {{.image = &a}}, .depth = {.image = &depth, .read_only = true}}, {}, TrianglePush{},
           {&call, 1});
    g.draw(kTriangle, {.depth = {.image = &depth}}, {}, TrianglePush{}, {&call, 1});
    g.draw(kOverlay, {.colors = {{.image = &a}}, .depth = {.image = &depth, .read_only = true}}, {}, TrianglePush{},
           {&call, 1});
    EXPECT_THAT(g.errors(),
                ElementsAre(HasSubstr("colour target 0 is Rgba32Float, the kernel draws Rgba16Float"),
                            HasSubstr("the kernel writes depth of Depth32Float, the target is Depth32Float, read only"),
                            HasSubstr("0 colour targets, the kernel has 1")));
}

TEST_F(GraphRecording, RefusesTwoKernelsOfOneName) {
    static constexpr Kernel kImpostor{"fill", kGraphDownSpv};
    fill(a);
    g.dispatch(kImpostor, b.size, {g.read(a), g.write(b)});
    EXPECT_THAT(g.errors(), ElementsAre(HasSubstr("two kernels are called 'fill'")));
}

TEST_F(GraphRecording, RefusesEmptyResources) {
    g.create("nothing", {.size = {0, 1}});
    g.create_buffer("none", 0);
    EXPECT_EQ(g.errors().size(), 2u);
}

TEST_F(GraphRecording, RefusesHandlesOfOtherGraphs) {
    g.read(Image{.id = 99});
    g.read(Buffer{.id = a.id});
    ASSERT_EQ(g.errors().size(), 2u);
    EXPECT_THAT(g.errors()[1], HasSubstr("not a buffer of this graph"));
}

TEST_F(GraphRecording, GivesTheSameResourceForTheSameImport) {
    Image one = g.import("atlas", rhi::TextureHandle{1, 1}, kSmall, rhi::Access::Undefined);
    fill(one);
    const Image two = g.import("atlas again", rhi::TextureHandle{1, 1}, kSmall, rhi::Access::Undefined);
    EXPECT_EQ(one.id, two.id);
    EXPECT_EQ(one.version, two.version);
}

TEST(GraphSizes, HalvesNeverReachZero) {
    EXPECT_EQ((rhi::Extent{5, 1, 1} / 2), (rhi::Extent{2, 1, 1}));
    EXPECT_EQ(mip_size({8, 2, 1}, 3), (rhi::Extent{1, 1, 1}));
}

}  // namespace
}  // namespace kiln::render::samples
