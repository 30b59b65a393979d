// SPDX-License-Identifier: MIT
// Kernels (a shader by name) and the library of pipelines made from them. Every pipeline is made by warm_up(), so that no
// frame stops to compile one; what a frame makes in spite of that is counted and logged.
#pragma once

#include "rhi/device.h"

#include <initializer_list>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace kiln::render {

// A compute shader. Kernels are constants beside the pass that runs them and outlive every graph:
//   constexpr Kernel kBloomThreshold{"bloom threshold", kBloomThresholdSpv};
// The name identifies it: two kernels of one name are one kernel.
struct Kernel {
    std::string_view name;
    std::span<const uint32_t> spirv;
    std::span<const rhi::SpecConstant> constants = {};
};

// A vertex and a fragment shader with the fixed state between them. Formats of the targets come from the pass.
struct RasterKernel {
    std::string_view name;
    std::span<const uint32_t> vertex;
    std::span<const uint32_t> fragment;
    std::span<const rhi::ColorTarget> colors = {};  // formats, blending, masks
    rhi::DepthState depth = {};
    std::span<const rhi::VertexBufferLayout> vertex_buffers = {};
    rhi::Topology topology = rhi::Topology::TriangleList;
    rhi::Cull cull = rhi::Cull::None;
    // Instead of `vertex`: draws count workgroups of it.
    std::span<const uint32_t> mesh = {};
    // Identifies the kernel.
    const uint32_t* words() const { return mesh.empty() ? vertex.data() : mesh.data(); }
};

// Rays through box trees; see rhi::TracePipelineDesc.
struct TraceKernel {
    std::string_view name;
    std::span<const uint32_t> raygen;
    std::span<const uint32_t> miss;
    std::span<const uint32_t> intersection;
    std::span<const uint32_t> closest_hit;
};

// What kernels say about their bindings. Needs no device. Reflects each kernel once.
class Reflections {
public:
    // Vertex and fragment stages of one pipeline are folded into one list of bindings. Null with `error` set for bad SPIR-V.
    const rhi::Reflection* of(const Kernel& kernel, std::string& error);
    const rhi::Reflection* of(const RasterKernel& kernel, std::string& error);
    const rhi::Reflection* of(const TraceKernel& kernel, std::string& error);
    void forget(std::string_view name);

private:
    struct Entry {
        std::span<const uint32_t> words;
        std::unique_ptr<rhi::Reflection> reflection;
    };
    const rhi::Reflection* folded(std::string_view name, const uint32_t* words,
                                  std::initializer_list<std::span<const uint32_t>> stages, std::string& error);
    std::map<std::string, Entry, std::less<>> entries_;
};

// Owner's thread.
class PipelineLibrary {
public:
    explicit PipelineLibrary(rhi::Device& device) : device_(&device) {}
    ~PipelineLibrary();
    PipelineLibrary(const PipelineLibrary&) = delete;
    PipelineLibrary& operator=(const PipelineLibrary&) = delete;

    // Makes what is missing. From now on a pipeline made on demand counts as made_late().
    Result<void> warm_up(std::span<const Kernel* const> kernels, std::span<const RasterKernel* const> raster = {},
                         std::span<const TraceKernel* const> traces = {});
    Result<rhi::ComputePipeline> get(const Kernel& kernel);
    Result<rhi::RenderPipeline> get(const RasterKernel& kernel);
    Result<rhi::TracePipeline> get(const TraceKernel& kernel);

    // Other words for the kernel of this name, from the next frame on. The bindings, push data and workgroup must be the
    // same, otherwise an error says which differ and the old pipeline stays.
    Result<void> replace(const Kernel& kernel, std::span<const uint32_t> spirv);

    // Other words for every compute, vertex, fragment and mesh shader whose words begin at `old`: in pipelines made before, which are all made anew
    // first or none is changed, and in those made later. The interface must be that of the old words.
    Result<void> replace_words(std::span<const uint32_t> old, std::span<const uint32_t> spirv);

    uint64_t made() const { return made_; }
    uint64_t made_late() const { return made_late_; }  // after warm_up(): each one was a stutter

private:
    struct Compute {
        const uint32_t* words;  // identifies the kernel that owns the name
        rhi::ComputePipeline pipeline = {};
        Kernel kernel = {};
    };
    struct Raster {
        const uint32_t* words;
        rhi::RenderPipeline pipeline = {};
        RasterKernel kernel = {};
    };
    struct Trace {
        const uint32_t* words;
        rhi::TracePipeline pipeline = {};
    };
    using Words = std::map<const uint32_t*, std::vector<uint32_t>>;
    Result<rhi::ComputePipeline> make(const Kernel& kernel, std::span<const uint32_t> spirv);
    Result<rhi::RenderPipeline> make(const RasterKernel& kernel, const Words& replaced);
    void count(std::string_view name);

    rhi::Device* device_;
    std::map<std::string, Compute, std::less<>> compute_;
    std::map<std::string, Raster, std::less<>> raster_;
    std::map<std::string, Trace, std::less<>> traces_;
    Words replaced_;  // by where the old ones begin
    uint64_t made_ = 0, made_late_ = 0;
    bool warm_ = false;
};

}  // namespace kiln::render
