// SPDX-License-Identifier: MIT
// Kernels and graphs that the tests of the graph share.
#pragma once

#include "render/graph_runner.h"

#include "shaders/graph_accumulate.spv.h"
#include "shaders/graph_blend.spv.h"
#include "shaders/graph_combine.spv.h"
#include "shaders/graph_down.spv.h"
#include "shaders/graph_fill.spv.h"
#include "shaders/graph_groups.spv.h"
#include "shaders/graph_mirror.spv.h"
#include "shaders/graph_scale.spv.h"
#include "shaders/graph_sum.spv.h"
#include "shaders/graph_triangle_frag.spv.h"
#include "shaders/graph_triangle_vert.spv.h"

#include <random>

namespace kiln::render::samples {

inline constexpr Kernel kFill{"fill", kGraphFillSpv};
inline constexpr Kernel kBlend{"blend", kGraphBlendSpv};
inline constexpr Kernel kDown{"down", kGraphDownSpv};
inline constexpr Kernel kMirror{"mirror", kGraphMirrorSpv};
inline constexpr Kernel kScale{"scale", kGraphScaleSpv};
inline constexpr Kernel kSum{"sum", kGraphSumSpv};
inline constexpr Kernel kCombine{"combine", kGraphCombineSpv};
inline constexpr Kernel kAccumulate{"accumulate", kGraphAccumulateSpv};
inline constexpr Kernel kGroups{"groups", kGraphGroupsSpv};
inline constexpr const Kernel* kKernels[] = {&kFill, &kBlend,   &kDown,       &kMirror, &kScale,
                                             &kSum,  &kCombine, &kAccumulate, &kGroups};

inline constexpr rhi::ColorTarget kTriangleColors[] = {{.format = rhi::Format::Rgba16Float}};
inline constexpr RasterKernel kTriangle{.name = "triangle",
                                        .vertex = kGraphTriangleVertSpv,
                                        .fragment = kGraphTriangleFragSpv,
                                        .colors = kTriangleColors,
                                        .depth = {.format = rhi::Format::Depth32Float}};
// Tests depth, and leaves it alone.
inline constexpr RasterKernel kOverlay{.name = "overlay",
                                       .vertex = kGraphTriangleVertSpv,
                                       .fragment = kGraphTriangleFragSpv,
                                       .colors = kTriangleColors,
                                       .depth = {.format = rhi::Format::Depth32Float, .write = false}};
inline constexpr const RasterKernel* kRaster[] = {&kTriangle, &kOverlay};

struct FillPush {
    float value[4]{};
    uint32_t columns = ~0u;
    uint32_t pad[3]{};
};
struct CombineParams {
    uint32_t factor = 1, offset = 0;
    uint32_t pad[2]{};
};
struct TrianglePush {
    float color[4]{};
    float depth = 0.5f;
    float pad[3]{};
};

inline constexpr ImageDesc kSmall{.size = {64, 32}, .format = rhi::Format::Rgba16Float};
inline constexpr uint64_t kWords = 64;  // of every buffer

// Things that outlive the graphs of a fuzzed run.
struct World {
    // Three of them: plain, with mips, with layers and mips. Then two buffers.
    static constexpr std::array<ImageDesc, 3> kImages{
        ImageDesc{.size = {32, 32}}, ImageDesc{.size = {64, 64}, .mips = 4},
        ImageDesc{.size = {16, 16, 3}, .dimension = rhi::Dimension::D2Array, .mips = 2}};
    std::array<rhi::TextureHandle, 3> textures{};
    std::array<rhi::BufferHandle, 2> buffers{};
    std::array<std::vector<bool>, 3> written{};  // one a mip and layer
    // Without a runner: the access they are in.
    std::array<rhi::Access, 3> image_access{};
    std::array<rhi::Access, 2> buffer_access{};
};

struct FuzzOptions {
    uint32_t passes = 40;       // about
    bool whole_writes = false;  // every first write covers everything, so that results are defined
    bool raster = true;
};

// A valid graph of random passes over random resources; what it reads back comes out.
std::vector<Readback> record_random(Graph& g, std::mt19937& random, World& world, const FuzzOptions& options);

// A deferred frame: bake into an atlas, march, raster, light, history, bloom chain, histogram, tone map, read-back.
Readback record_deferred_frame(Graph& g, rhi::TextureHandle atlas, rhi::BufferHandle exposure, rhi::Extent size);

}  // namespace kiln::render::samples
