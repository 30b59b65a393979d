// SPDX-License-Identifier: MIT
#include "rhi/types.h"

namespace kiln::rhi {

namespace {

using enum SampleType;

// Storage: WebGPU's core set; the rest needs SPIR-V's StorageImageExtendedFormats (Caps::storage_r16f).
constexpr FormatInfo kFormats[kFormatCount] = {
    // name, bytes, channels, sample type, filterable, core storage
    {"Undefined", 0, 0, Float, false, false},     {"R8Snorm", 1, 1, Float, true, false},
    {"R16Float", 2, 1, Float, true, false},       {"R16Uint", 2, 1, Uint, false, false},
    {"R32Uint", 4, 1, Uint, false, true},         {"R32Float", 4, 1, Float, false, true},
    {"Rg16Float", 4, 2, Float, true, false},      {"Rg32Uint", 8, 2, Uint, false, false},
    {"Rgba8Unorm", 4, 4, Float, true, true},      {"Rgba16Float", 8, 4, Float, true, true},
    {"Rgba32Float", 16, 4, Float, false, true},   {"Rgba32Uint", 16, 4, Uint, false, true},
    {"R11g11b10Float", 4, 3, Float, true, false}, {"Depth32Float", 4, 1, Depth, false, false},
    {"Rgba8Srgb", 4, 4, Float, true, false},      {"Bgra8Unorm", 4, 4, Float, true, false},
};

constexpr std::string_view kAccessNames[] = {
    "IndirectRead",
    "IndexRead",
    "VertexRead",
    "UniformRead",
    "SampledReadGraphics",
    "SampledReadCompute",
    "StorageReadGraphics",
    "StorageReadCompute",
    "StorageWriteGraphics",
    "StorageWriteCompute",
    "ColorWrite",
    "DepthRead",
    "DepthWrite",
    "CopyRead",
    "CopyWrite",
    "HostRead",
    "Present",
    "BoxesRead",
    "BoxTreeWrite",
    "BoxTreeRead",
};

}  // namespace

const FormatInfo& info(Format format) { return kFormats[uint32_t(format) < kFormatCount ? uint32_t(format) : 0]; }

std::string name(Access access) {
    if (!any(access)) return "Undefined";
    std::string out;
    for (uint32_t bit = 0; bit < std::size(kAccessNames); ++bit) {
        if (!any(access & Access(1u << bit))) continue;
        if (!out.empty()) out += '|';
        out += kAccessNames[bit];
    }
    return out;
}

std::string_view name(BindingKind kind) {
    switch (kind) {
    case BindingKind::UniformBuffer:
        return "UniformBuffer";
    case BindingKind::StorageBuffer:
        return "StorageBuffer";
    case BindingKind::StorageBufferReadOnly:
        return "StorageBufferReadOnly";
    case BindingKind::SampledTexture:
        return "SampledTexture";
    case BindingKind::Sampler:
        return "Sampler";
    case BindingKind::StorageTexture:
        return "StorageTexture";
    case BindingKind::StorageTextureReadOnly:
        return "StorageTextureReadOnly";
    case BindingKind::BoxTree:
        return "BoxTree";
    }
    return "?";
}

std::string_view name(ShaderStage stage) {
    switch (stage) {
    case ShaderStage::None:
        return "none";
    case ShaderStage::Vertex:
        return "vertex";
    case ShaderStage::Fragment:
        return "fragment";
    case ShaderStage::Compute:
        return "compute";
    case ShaderStage::Mesh:
        return "mesh";
    case ShaderStage::RayGen:
        return "ray generation";
    case ShaderStage::Miss:
        return "miss";
    case ShaderStage::Intersection:
        return "intersection";
    case ShaderStage::ClosestHit:
        return "closest hit";
    }
    return "?";
}

std::string_view name(DeviceKind kind) {
    switch (kind) {
    case DeviceKind::Discrete:
        return "discrete";
    case DeviceKind::Integrated:
        return "integrated";
    case DeviceKind::Virtual:
        return "virtual";
    case DeviceKind::Cpu:
        return "cpu";
    case DeviceKind::Other:
        return "other";
    }
    return "?";
}

uint32_t bytes_per_vertex_attribute(VertexFormat format) {
    switch (format) {
    case VertexFormat::Float32:
    case VertexFormat::Unorm8x4:
    case VertexFormat::Uint32:
        return 4;
    case VertexFormat::Float32x2:
        return 8;
    case VertexFormat::Float32x3:
        return 12;
    case VertexFormat::Float32x4:
        return 16;
    }
    return 0;
}

}  // namespace kiln::rhi
