// SPDX-License-Identifier: MIT
// What a SPIR-V module says about itself: bindings, push data, workgroup, and the layout of every block.
// Reads the binary directly; knows the instructions that shaders compiled from our GLSL contain.
#pragma once

#include <kiln/result.h>
#include "rhi/types.h"

namespace kiln::rhi {

// One member of a block, or of a struct inside one.
struct BlockMember {
    std::string name = {};     // empty when the module carries no names; nested members are "outer.inner"
    std::string type = {};     // "float", "uint", "int", "vec4", "uvec2", "mat4", "struct Name"
    uint32_t offset = 0;       // bytes from the block's (array element's) start
    uint32_t size = 0;         // bytes; 0 for a runtime array
    uint32_t array_count = 0;  // 0: not an array; kRemaining: runtime array
    uint32_t array_stride = 0;
    uint32_t matrix_stride = 0;
    std::vector<BlockMember> members = {};  // of a struct (of an array's element), offsets relative to the struct
};

struct ReflectedBinding {
    uint32_t set = 0;
    uint32_t binding = 0;
    std::string name = {};
    BindingKind kind = BindingKind::StorageBuffer;
    ShaderStage stages = ShaderStage::None;
    Format format = Format::Undefined;  // storage textures
    Dimension dimension = Dimension::D2;
    SampleType sample_type = SampleType::Float;
    bool write_only = false;                // StorageTexture, StorageBuffer: the shader declares it never reads
    uint32_t array_count = 1;               // kRemaining: runtime array (bindless)
    uint32_t block_size = 0;                // bytes of a buffer's fixed part
    std::vector<BlockMember> members = {};  // of a buffer block
};

struct Reflection {
    ShaderStage stage = ShaderStage::None;
    std::string entry = {};
    std::array<uint32_t, 3> workgroup{1, 1, 1};
    uint32_t shared_bytes = 0;
    uint32_t push_bytes = 0;
    std::vector<BlockMember> push_members = {};
    std::vector<ReflectedBinding> bindings = {};  // by set, then binding; only those the module declares
    std::vector<std::string> beyond_floor = {};   // capabilities that not every device has, as SPIR-V names them
};

Result<Reflection> reflect_spirv(std::span<const uint32_t> words);

// Empty, or one sentence for every floor that the shader exceeds (types.h kMax…) and no tier in `caps` grants.
std::vector<std::string> check_floor(const Reflection& reflection, const Caps& caps = {});

// Entries of bind group `set`, by binding, for all stages of one pipeline together; an error where stages disagree.
Result<std::vector<BindGroupLayoutEntry>> layout_entries(std::span<const Reflection* const> shaders, uint32_t set);

}  // namespace kiln::rhi
