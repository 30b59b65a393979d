// SPDX-License-Identifier: MIT
// Texel formats the engine uses, and what each is made of.
#pragma once

#include <cstdint>
#include <string_view>

namespace kiln::rhi {

enum class Format : uint8_t {
    Undefined,
    R8Snorm,
    R16Float,
    R16Uint,
    R32Uint,
    R32Float,
    Rg16Float,
    Rg32Uint,
    Rgba8Unorm,
    Rgba16Float,
    Rgba32Float,
    Rgba32Uint,
    R11g11b10Float,
    Depth32Float,
    Rgba8Srgb,   // decoded to linear before filtering; sampled and copied only
    Bgra8Unorm,  // as many windows have it; copied only
};
constexpr int kFormatCount = 16;

// How a shader sees a texel.
enum class SampleType : uint8_t { Float, Uint, Depth };

struct FormatInfo {
    std::string_view name;  // as in the enumerator
    uint32_t bytes_per_texel;
    uint32_t channels;
    SampleType sample_type;
    bool filterable;    // linear sampling is allowed (32-bit floats: a driver option WebGPU lacks, so no)
    bool core_storage;  // usable as a storage texture on every device; otherwise see Caps
};

const FormatInfo& info(Format format);

inline std::string_view name(Format format) { return info(format).name; }
inline uint32_t bytes_per_texel(Format format) { return info(format).bytes_per_texel; }
inline bool is_depth(Format format) { return info(format).sample_type == SampleType::Depth; }

}  // namespace kiln::rhi
