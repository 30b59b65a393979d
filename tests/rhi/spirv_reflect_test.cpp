// SPDX-License-Identifier: MIT
#include "rhi/spirv_reflect.h"

#include "shaders/rhi_add.spv.h"
#include "shaders/rhi_layouts.spv.h"
#include "shaders/rhi_triangle_frag.spv.h"
#include "shaders/rhi_triangle_vert.spv.h"
#include "shaders/rhi_volume_write.spv.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

namespace kiln::rhi {
namespace {

Reflection read(std::span<const uint32_t> words) {
    Result<Reflection> r = reflect_spirv(words);
    EXPECT_TRUE(r) << (r ? "" : r.error().message);
    return r ? *r : Reflection{};
}

const ReflectedBinding* at(const Reflection& r, uint32_t set, uint32_t binding) {
    for (const ReflectedBinding& b : r.bindings)
        if (b.set == set && b.binding == binding) return &b;
    ADD_FAILURE() << "no binding " << binding << " in set " << set;
    static const ReflectedBinding none;
    return &none;
}

TEST(SpirvReflect, FindsEveryBindingOfTheTestShader) {
    const Reflection r = read(kRhiLayoutsSpv);
    EXPECT_EQ(r.stage, ShaderStage::Compute);
    EXPECT_EQ(r.entry, "main");
    EXPECT_EQ(r.workgroup, (std::array<uint32_t, 3>{8, 4, 2}));
    EXPECT_EQ(r.shared_bytes, 64u * 16 + 4);
    EXPECT_EQ(r.bindings.size(), 8u);

    EXPECT_EQ(at(r, 0, 0)->kind, BindingKind::UniformBuffer);
    EXPECT_EQ(at(r, 1, 2)->kind, BindingKind::StorageBufferReadOnly);
    EXPECT_EQ(at(r, 1, 0)->kind, BindingKind::StorageBuffer);
    EXPECT_EQ(at(r, 2, 1)->kind, BindingKind::SampledTexture);
    EXPECT_EQ(at(r, 2, 1)->dimension, Dimension::D2Array);
    EXPECT_EQ(at(r, 2, 1)->sample_type, SampleType::Float);
    EXPECT_EQ(at(r, 2, 3)->dimension, Dimension::D3);
    EXPECT_EQ(at(r, 2, 3)->sample_type, SampleType::Uint);
    EXPECT_EQ(at(r, 2, 4)->kind, BindingKind::Sampler);
    EXPECT_EQ(at(r, 3, 0)->kind, BindingKind::StorageTexture);
    EXPECT_EQ(at(r, 3, 0)->format, Format::Rgba16Float);
    EXPECT_TRUE(at(r, 3, 0)->write_only);
    EXPECT_EQ(at(r, 3, 1)->kind, BindingKind::StorageTextureReadOnly);
    EXPECT_EQ(at(r, 3, 1)->format, Format::R32Uint);
    EXPECT_EQ(at(r, 3, 1)->dimension, Dimension::D3);
    EXPECT_THAT(check_floor(r), testing::IsEmpty());
}

// Offsets written down by hand from the rules of std140 and std430.
TEST(SpirvReflect, ReadsOffsetsAndStrides) {
    const Reflection r = read(kRhiLayoutsSpv);
    const std::vector<BlockMember>& frame = at(r, 0, 0)->members;
    ASSERT_EQ(frame.size(), 3u);
    EXPECT_EQ(frame[0].type, "mat4");
    EXPECT_EQ(frame[0].matrix_stride, 16u);
    EXPECT_EQ(frame[0].size, 64u);
    EXPECT_EQ(frame[1].offset, 64u);
    EXPECT_EQ(frame[2].offset, 80u);
    EXPECT_EQ(frame[2].array_count, 3u);
    EXPECT_EQ(frame[2].array_stride, 16u);  // std140 rounds up
    EXPECT_EQ(at(r, 0, 0)->block_size, 80u + 3 * 16);

    const std::vector<BlockMember>& items = at(r, 1, 2)->members;
    ASSERT_EQ(items.size(), 4u);
    EXPECT_EQ(items[1].offset, 4u);
    EXPECT_EQ(items[2].offset, 8u);
    EXPECT_EQ(items[3].offset, 16u);
    EXPECT_EQ(items[3].array_count, kRemaining);
    EXPECT_EQ(items[3].array_stride, 32u);
    ASSERT_EQ(items[3].members.size(), 4u);
    EXPECT_EQ(items[3].members[0].type, "vec4");
    EXPECT_EQ(items[3].members[1].offset, 16u);
    EXPECT_EQ(items[3].members[2].type, "float");
    EXPECT_EQ(items[3].members[3].offset, 24u);
    EXPECT_EQ(at(r, 1, 2)->block_size, 16u);

    const std::vector<BlockMember>& counters = at(r, 1, 0)->members;
    ASSERT_EQ(counters.size(), 2u);
    EXPECT_EQ(counters[1].type, "int");
    EXPECT_EQ(counters[1].array_stride, 4u);
    EXPECT_EQ(at(r, 1, 0)->block_size, 24u);

    EXPECT_EQ(r.push_bytes, 24u);
    ASSERT_EQ(r.push_members.size(), 3u);
    EXPECT_EQ(r.push_members[2].offset, 20u);
}

TEST(SpirvReflect, ReadsGraphicsStages) {
    EXPECT_EQ(read(kRhiTriangleVertSpv).stage, ShaderStage::Vertex);
    const Reflection fragment = read(kRhiTriangleFragSpv);
    EXPECT_EQ(fragment.stage, ShaderStage::Fragment);
    EXPECT_EQ(fragment.push_bytes, 4u);
}

TEST(SpirvReflect, RefusesWhatIsNotSpirv) {
    EXPECT_FALSE(reflect_spirv({}));
    const std::vector<uint32_t> junk{0x07230203, 0, 0, 1, 0, 0};
    EXPECT_FALSE(reflect_spirv(junk));
    const std::vector<uint32_t> empty{0x07230203, 0, 0, 1, 0};
    EXPECT_FALSE(reflect_spirv(empty));  // no entry point
}

// Any bytes give an answer or an error; nothing reads outside (the sanitizer build would tell).
TEST(SpirvReflect, SurvivesDamagedModules) {
    std::mt19937 random(7);
    const std::vector<uint32_t> whole(std::begin(kRhiLayoutsSpv), std::end(kRhiLayoutsSpv));
    int refused = 0;
    for (int i = 0; i < 2000; ++i) {
        std::vector<uint32_t> words = whole;
        words.resize(5 + random() % (words.size() - 5));
        for (int k = 0; k < 4; ++k)
            words[5 + random() % std::max<size_t>(1, words.size() - 5) % words.size()] = random() % 512;
        refused += reflect_spirv(words) ? 0 : 1;
    }
    EXPECT_GT(refused, 0);
}

TEST(Floor, SaysWhatIsBeyondIt) {
    Reflection r = read(kRhiAddSpv);
    EXPECT_THAT(check_floor(r), testing::IsEmpty());
    r.workgroup = {16, 16, 2};
    r.shared_bytes = 16385;
    r.push_bytes = 68;
    r.beyond_floor = {"Float64"};
    for (uint32_t i = 0; i < 7; ++i) r.bindings.push_back({.set = 0, .binding = 10 + i, .name = "extra"});
    EXPECT_THAT(check_floor(r),
                testing::ElementsAre("storage buffers: 9, the floor is 8", "bytes of push data: 68, the floor is 64",
                                     "threads a workgroup: 512, the floor is 256",
                                     "bytes of workgroup memory: 16385, the floor is 16384", "needs Float64"));
}

TEST(Floor, HalfFloatStorageIsATier) {
    const Reflection r = read(kRhiVolumeWriteSpv);
    EXPECT_FALSE(check_floor(r).empty());
    EXPECT_THAT(check_floor(r, {.storage_r16f = true}), testing::IsEmpty());
}

TEST(Floor, StagesOfOnePipelineShareTheirEntries) {
    Reflection vertex, fragment;
    vertex.bindings = {
        {.set = 1, .binding = 0, .name = "camera", .kind = BindingKind::UniformBuffer, .stages = ShaderStage::Vertex}};
    fragment.bindings = {
        {.set = 1, .binding = 2, .name = "light", .kind = BindingKind::UniformBuffer, .stages = ShaderStage::Fragment},
        {.set = 1,
         .binding = 0,
         .name = "camera",
         .kind = BindingKind::UniformBuffer,
         .stages = ShaderStage::Fragment}};
    const Reflection* const both[] = {&vertex, &fragment};
    const auto entries = layout_entries(both, 1);
    ASSERT_TRUE(entries);
    ASSERT_EQ(entries->size(), 2u);
    EXPECT_EQ((*entries)[0].stages, ShaderStage::Vertex | ShaderStage::Fragment);
    EXPECT_EQ((*entries)[1].binding, 2u);
    fragment.bindings[1].kind = BindingKind::StorageBuffer;
    EXPECT_FALSE(layout_entries(both, 1));
}

}  // namespace
}  // namespace kiln::rhi
