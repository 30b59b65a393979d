// SPDX-License-Identifier: MIT
// Gate G21: what C++ and the shaders share has the same offsets on both sides, as read back from the SPIR-V.
#include "render/passes/cascades.h"
#include "render/passes/forward.h"
#include "render/passes/instances.h"
#include "render/passes/lamps.h"
#include "render/passes/materials.gpu.h"
#include "render/passes/passes.h"
#include "render/passes/taa_up.gpu.h"
#include "render/passes/upscale.h"
#include "rhi/spirv_reflect.h"

#include <gtest/gtest.h>

#include <cstddef>

namespace kiln::render {
namespace {

std::vector<uint32_t> offsets(const std::vector<rhi::BlockMember>& members, uint32_t base = 0) {
    std::vector<uint32_t> out;
    for (const rhi::BlockMember& m : members) {
        if (m.members.empty()) {
            out.push_back(base + m.offset);
        } else {
            const std::vector<uint32_t> inner = offsets(m.members, base + m.offset);
            out.insert(out.end(), inner.begin(), inner.end());
        }
    }
    return out;
}

rhi::Reflection reflected(const Kernel& kernel) {
    auto r = rhi::reflect_spirv(kernel.spirv);
    EXPECT_TRUE(r) << (r ? "" : r.error().message);
    return r ? *r : rhi::Reflection{};
}

const rhi::ReflectedBinding* binding(const rhi::Reflection& r, uint32_t number) {
    for (const rhi::ReflectedBinding& b : r.bindings) {
        if (b.binding == number) return &b;
    }
    return nullptr;
}

// Offsets of the elements of a storage buffer that holds one runtime array of structs, and its stride.
void expect_array(const Kernel& kernel, uint32_t number, const std::vector<uint32_t>& expected, uint32_t stride) {
    const rhi::Reflection r = reflected(kernel);
    const rhi::ReflectedBinding* b = binding(r, number);
    ASSERT_TRUE(b) << kernel.name << " binding " << number;
    ASSERT_EQ(b->members.size(), 1u) << kernel.name << " binding " << number;
    EXPECT_EQ(b->members[0].array_stride, stride) << kernel.name << " binding " << number;
    EXPECT_EQ(offsets(b->members[0].members), expected) << kernel.name << " binding " << number;
}

#define AT(type, member) uint32_t(offsetof(type, member))

TEST(Layout, FrameParamsAreTheSameInEveryKernel) {
    std::vector<uint32_t> expected;
    for (uint32_t i = 0; i < 8; ++i) expected.push_back(i * 4);  // GridParams: eight words
    for (uint32_t i = 0; i < 8; ++i) expected.push_back(AT(FrameParams, eye_x) + i * 4);
    for (uint32_t i = 0; i < 4; ++i) expected.push_back(AT(FrameParams, camera) + i * 16);
    for (uint32_t i = 0; i < 12; ++i) expected.push_back(AT(FrameParams, width) + i * 4);
    for (uint32_t i = 0; i < 4; ++i) expected.push_back(AT(FrameParams, sky) + i * 16);
    for (uint32_t i = 0; i < 4; ++i) expected.push_back(AT(FrameParams, view) + i * 4);
    for (uint32_t i = 0; i < 8; ++i) expected.push_back(AT(FrameParams, outside_low_x) + i * 4);
    for (uint32_t i = 0; i < 8; ++i) expected.push_back(AT(FrameParams, planes) + i * 4);  // the first of them
    EXPECT_EQ(AT(FrameParams, pixel_angle), AT(FrameParams, eye_x) + 28);
    EXPECT_EQ(AT(FrameParams, params_first), AT(FrameParams, width) + 44);
    EXPECT_EQ(AT(FrameParams, material_count), AT(FrameParams, view) + 4);
    for (const Kernel* kernel :
         {&kMarch, &kMarchLevels, &kMarchExact, &kRefine, &kResolve, &kResolveExact, &kResolveLevels, &kShadow,
          &kShadowExact, &kShadowLevels, &kLight, &kView, &kMarchInstances, &kMarchLevelsInstances, &kRefineInstances,
          &kResolveInstances, &kShadowInstances}) {
        const rhi::Reflection r = reflected(*kernel);
        const rhi::ReflectedBinding* b = binding(r, 0);
        ASSERT_TRUE(b) << kernel->name;
        ASSERT_EQ(b->kind, rhi::BindingKind::UniformBuffer) << kernel->name;
        EXPECT_EQ(b->block_size, sizeof(FrameParams)) << kernel->name;
        EXPECT_EQ(offsets(b->members), expected) << kernel->name;
        EXPECT_EQ(b->members[0].members.back().array_stride, sizeof(HorizonPlane)) << kernel->name;
    }
}

TEST(Layout, LevelsAreTheSame) {
    std::vector<uint32_t> words;
    for (uint32_t i = 0; i < 12; ++i) words.push_back(i * 4);
    for (const auto& [kernel, number] :
         {std::pair{&kMarchLevels, 8u}, {&kMarchLevelsInstances, 8u}, {&kResolveLevels, 11u}, {&kShadowLevels, 10u}}) {
        const rhi::Reflection r = reflected(*kernel);
        const rhi::ReflectedBinding* b = binding(r, number);
        ASSERT_TRUE(b) << kernel->name;
        ASSERT_EQ(b->kind, rhi::BindingKind::UniformBuffer) << kernel->name;
        EXPECT_EQ(b->block_size, sizeof(field::LevelsBlock)) << kernel->name;
        ASSERT_EQ(b->members.size(), 2u);
        EXPECT_EQ(offsets(b->members[0].members), words);
        EXPECT_EQ(b->members[1].offset, sizeof(field::LevelsParams));
        EXPECT_EQ(b->members[1].array_stride, sizeof(field::LevelPlace));
    }
}

TEST(Layout, RecordsInBuffersAreTheSame) {
    std::vector<uint32_t> words;
    for (uint32_t i = 0; i < 8; ++i) words.push_back(i * 4);
    EXPECT_EQ(AT(field::BrickRecord, code_count), 16u);
    expect_array(kBakeHalf, 1, words, sizeof(field::BrickRecord));
    expect_array(kMarchExact, 2, words, sizeof(field::BrickRecord));
    EXPECT_EQ(AT(MaterialRecord, metallic), 28u);
    EXPECT_EQ(AT(MaterialEntry, row), 4u);
    std::vector<uint32_t> entry = words;
    entry.push_back(32);
    expect_array(kResolve, 5, entry, sizeof(MaterialEntry));
    expect_array(kResolveInstances, 7, entry, sizeof(MaterialEntry));
    std::vector<uint32_t> ray;
    for (uint32_t i = 0; i < 12; ++i) ray.push_back(i * 4);
    EXPECT_EQ(AT(FrameRay, part_x), 16u);
    EXPECT_EQ(AT(FrameRay, direction_x), 32u);
    expect_array(kMarch, 2, ray, sizeof(FrameRay));
    const std::vector<uint32_t> light{
        AT(LightRecord, position),   AT(LightRecord, direction),   AT(LightRecord, color), AT(LightRecord, kind),
        AT(LightRecord, spot_scale), AT(LightRecord, spot_offset), AT(LightRecord, pad_0)};
    std::vector<uint32_t> set;
    for (uint32_t i = 0; i < 22; ++i) set.push_back(i * 4);
    EXPECT_EQ(AT(InstanceSet, samples_first), 52u);
    EXPECT_EQ(AT(InstanceSet, high_z), 76u);
    expect_array(kResolveInstances, 2, set, sizeof(InstanceSet));
    std::vector<uint32_t> instance;
    for (uint32_t i = 0; i < 6; ++i) instance.push_back(i * 16);
    for (uint32_t i = 0; i < 8; ++i) instance.push_back(AT(InstanceRecord, eye_x) + i * 4);
    EXPECT_EQ(AT(InstanceRecord, before_x), 48u);
    EXPECT_EQ(AT(InstanceRecord, material), 116u);
    expect_array(kResolveInstances, 1, instance, sizeof(InstanceRecord));
    // Two texels of an image: node_at() in instances.glsl.
    EXPECT_EQ(AT(InstanceNode, skip), 12u);
    EXPECT_EQ(AT(InstanceNode, high_x), 16u);
    EXPECT_EQ(AT(InstanceNode, instance), 28u);
    EXPECT_EQ(sizeof(InstanceNode), 32u);
    // Eight: instance_at() there.
    EXPECT_EQ(AT(InstanceWay, eye_x), 48u);
    EXPECT_EQ(AT(InstanceWay, grid), 64u);
    EXPECT_EQ(AT(InstanceWay, slot_first), 96u);
    EXPECT_EQ(AT(InstanceWay, high_x), 116u);
    EXPECT_EQ(sizeof(InstanceWay), 128u);
    expect_array(kMeshCull, 3, {0, 4, 8, 12, 16, 20}, sizeof(MeshBox));
    expect_array(kMeshPack, 0, {0, 4}, sizeof(MeshClusterRef));
    expect_array(kShadow, 3, light, sizeof(LightRecord));
    expect_array(kLight, 2, light, sizeof(LightRecord));
    expect_array(kCluster, 2, light, sizeof(LightRecord));
}

TEST(Layout, CascadesAreTheSame) {
    std::vector<uint32_t> expected{AT(CascadesBlock, u), AT(CascadesBlock, v), AT(CascadesBlock, w)};
    for (const uint32_t first : {AT(CascadesBlock, squares), AT(CascadesBlock, casters)}) expected.push_back(first);
    for (const uint32_t at :
         {AT(CascadesBlock, range), AT(CascadesBlock, light), AT(CascadesBlock, count), AT(CascadesBlock, side)})
        expected.push_back(at);
    for (const auto& [kernel, number] : {std::pair{&kCascadeCull, 0u}, std::pair{&kShadowCascades, 1u}}) {
        const rhi::Reflection r = reflected(*kernel);
        const rhi::ReflectedBinding* b = binding(r, number);
        ASSERT_TRUE(b) << kernel->name;
        ASSERT_EQ(b->members.size(), 1u) << kernel->name;
        EXPECT_EQ(offsets(b->members[0].members), expected) << kernel->name;
    }
    expect_array(kCascadeCull, 5, {AT(CascadePart, u), AT(CascadePart, v), AT(CascadePart, w)}, sizeof(CascadePart));
}

TEST(Layout, PushDataIsTheSame) {
    for (const Kernel* kernel : {&kBakeHalf, &kBakeSnorm8, &kBakeCopyHalf, &kBakeCopySnorm8}) {
        const rhi::Reflection r = reflected(*kernel);
        EXPECT_EQ(r.push_bytes, sizeof(BakePush)) << kernel->name;
        EXPECT_EQ(offsets(r.push_members),
                  (std::vector<uint32_t>{AT(BakePush, voxel_size), AT(BakePush, voxels_per_metre),
                                         AT(BakePush, params_first), AT(BakePush, atlas_bricks_x_y)}))
            << kernel->name;
    }
    for (const Kernel* kernel : {&kMarchInstances, &kMarchLevelsInstances, &kShadowInstances})
        EXPECT_EQ(reflected(*kernel).push_bytes, sizeof(InstancePush)) << kernel->name;
    EXPECT_EQ(reflected(kCascadeCull).push_bytes, sizeof(CascadeCullPush));
    EXPECT_EQ(reflected(kLampCull).push_bytes, sizeof(LampCullPush));
    EXPECT_EQ(reflected(kTaaUp).push_bytes, sizeof(TaaUpPush));
    for (const Kernel* kernel : {&kUpDepth, &kUpOwners})
        EXPECT_EQ(reflected(*kernel).push_bytes, sizeof(UpPush)) << kernel->name;
    for (const Kernel* kernel : {&kShadow, &kShadowExact, &kLight, &kShadowCascades}) {
        EXPECT_EQ(reflected(*kernel).push_bytes, sizeof(ShadowPush)) << kernel->name;
    }
}

TEST(Layout, EveryKernelFitsTheFloor) {
    for (const Kernel* kernel : {&kBakeHalf,
                                 &kBakeSnorm8,
                                 &kBakeCopyHalf,
                                 &kBakeCopySnorm8,
                                 &kMarch,
                                 &kMarchExact,
                                 &kRefine,
                                 &kResolve,
                                 &kResolveExact,
                                 &kShadow,
                                 &kShadowExact,
                                 &kShadowLevelsExact,
                                 &kCluster,
                                 &kCascadeCull,
                                 &kShadowCascades,
                                 &kLampCull,
                                 &kShadowLamps,
                                 &kTaaUp,
                                 &kUpDepth,
                                 &kUpOwners,
                                 &kParticlesLight,
                                 &kThroughBend,
                                 &kThroughSurface,
                                 &kMotion,
                                 &kTaa,
                                 &kOutlineMask,
                                 &kOutlineFlood,
                                 &kOutlineDraw,
                                 &kLight,
                                 &kTonemap,
                                 &kView,
                                 &kMarchInstances,
                                 &kRefineInstances,
                                 &kResolveInstances,
                                 &kMarchLevels,
                                 &kMarchLevelsInstances,
                                 &kShadowInstances}) {
        rhi::Caps caps;
        caps.storage_r16f = kernel == &kBakeHalf || kernel == &kBakeSnorm8;
        for (const std::string& sentence : rhi::check_floor(reflected(*kernel), caps))
            ADD_FAILURE() << kernel->name << ": " << sentence;
    }
}

}  // namespace
}  // namespace kiln::render
