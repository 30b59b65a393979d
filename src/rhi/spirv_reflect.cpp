// SPDX-License-Identifier: MIT
#include "rhi/spirv_reflect.h"

#include <algorithm>
#include <cstring>
#include <unordered_map>

// Numbers below are those of the SPIR-V specification, version 1.6 (Khronos).

namespace kiln::rhi {

namespace {

enum Op : uint32_t {
    OpName = 5,
    OpMemberName = 6,
    OpEntryPoint = 15,
    OpExecutionMode = 16,
    OpCapability = 17,
    OpTypeBool = 20,
    OpTypeInt = 21,
    OpTypeFloat = 22,
    OpTypeVector = 23,
    OpTypeMatrix = 24,
    OpTypeImage = 25,
    OpTypeSampler = 26,
    OpTypeSampledImage = 27,
    OpTypeArray = 28,
    OpTypeRuntimeArray = 29,
    OpTypeStruct = 30,
    OpTypePointer = 32,
    OpConstant = 43,
    OpSpecConstant = 50,
    OpVariable = 59,
    OpDecorate = 71,
    OpMemberDecorate = 72,
    OpExecutionModeId = 331,
    OpTypeAccelerationStructure = 5341,
};

enum Decoration : uint32_t {
    Block = 2,
    BufferBlock = 3,
    ArrayStride = 6,
    MatrixStride = 7,
    NonWritable = 24,
    NonReadable = 25,
    Binding = 33,
    DescriptorSet = 34,
    Offset = 35,
};

enum StorageClass : uint32_t { UniformConstant = 0, Uniform = 2, Workgroup = 4, PushConstant = 9, StorageBuffer = 12 };

struct Type {
    uint32_t op = 0;
    uint32_t element = 0;  // vector, matrix, array, pointer, sampled image: the inner type
    uint32_t count = 0;    // vector, matrix: components; array: the id of the length
    uint32_t width = 0;    // int, float: bits
    bool is_signed = false;
    uint32_t storage_class = 0;
    // image
    uint32_t dim = 0;
    bool is_depth = false;
    bool arrayed = false;
    uint32_t sampled = 0;  // 1: sampled, 2: storage
    uint32_t image_format = 0;
    std::vector<uint32_t> members = {};
};

struct MemberInfo {
    std::string name = {};
    uint32_t offset = 0;
    uint32_t matrix_stride = 0;
    bool non_writable = false;
    bool non_readable = false;
};

struct IdInfo {
    std::string name = {};
    uint32_t set = kRemaining;
    uint32_t binding = kRemaining;
    uint32_t array_stride = 0;
    bool block = false;
    bool buffer_block = false;
    bool non_writable = false;
    bool non_readable = false;
    std::vector<MemberInfo> members = {};

    MemberInfo& member(uint32_t index) {
        if (members.size() <= index) members.resize(index + 1);
        return members[index];
    }
};

struct Variable {
    uint32_t id = 0;
    uint32_t type = 0;
    uint32_t storage_class = 0;
};

Format format_of(uint32_t spirv_format) {
    switch (spirv_format) {
    case 1:
        return Format::Rgba32Float;
    case 2:
        return Format::Rgba16Float;
    case 3:
        return Format::R32Float;
    case 4:
        return Format::Rgba8Unorm;
    case 7:
        return Format::Rg16Float;
    case 8:
        return Format::R11g11b10Float;
    case 9:
        return Format::R16Float;
    case 20:
        return Format::R8Snorm;
    case 30:
        return Format::Rgba32Uint;
    case 33:
        return Format::R32Uint;
    case 35:
        return Format::Rg32Uint;
    case 38:
        return Format::R16Uint;
    default:
        return Format::Undefined;
    }
}

// Capabilities that some of our targets lack. Those not listed are on every one of them.
std::string_view beyond_floor_name(uint32_t capability) {
    switch (capability) {
    case 2:
        return "Geometry";
    case 3:
        return "Tessellation";
    case 9:
        return "Float16";
    case 10:
        return "Float64";
    case 11:
        return "Int64";
    case 12:
        return "Int64Atomics";
    case 22:
        return "Int16";
    case 29:
        return "SampledImageArrayDynamicIndexing";
    case 31:
        return "StorageImageArrayDynamicIndexing";
    case 39:
        return "Int8";
    case 49:
        return "StorageImageExtendedFormats";
    case 55:
        return "StorageImageReadWithoutFormat";
    case 56:
        return "StorageImageWriteWithoutFormat";
    case 61:
        return "GroupNonUniform";
    case 62:
        return "GroupNonUniformVote";
    case 63:
        return "GroupNonUniformArithmetic";
    case 64:
        return "GroupNonUniformBallot";
    case 65:
        return "GroupNonUniformShuffle";
    case 66:
        return "GroupNonUniformShuffleRelative";
    case 67:
        return "GroupNonUniformClustered";
    case 68:
        return "GroupNonUniformQuad";
    case 4433:
        return "StorageBuffer16BitAccess";
    case 4448:
        return "StorageBuffer8BitAccess";
    case 4472:
        return "RayQueryKHR";
    case 4479:
        return "RayTracingKHR";
    case 5283:
        return "MeshShadingEXT";
    case 5301:
        return "ShaderNonUniform";
    case 5302:
        return "RuntimeDescriptorArray";
    case 5345:
        return "VulkanMemoryModel";
    case 5347:
        return "PhysicalStorageBufferAddresses";
    default:
        return {};
    }
}

class Reader {
public:
    Result<Reflection> read(std::span<const uint32_t> words);

private:
    void instruction(uint32_t op, std::span<const uint32_t> args);
    void decorate(IdInfo& target, uint32_t decoration, std::span<const uint32_t> args);
    static void decorate_member(MemberInfo& target, uint32_t decoration, std::span<const uint32_t> args);
    void finish();
    void finish_binding(const Variable& variable, const Type& type, const IdInfo& info);

    const Type& type(uint32_t id) const;
    uint32_t constant(uint32_t id) const;
    uint32_t size_of(uint32_t type_id, uint32_t matrix_stride = 0) const;
    uint32_t packed_size_of(uint32_t type_id) const;
    std::string type_name(uint32_t type_id) const;
    std::vector<BlockMember> members_of(uint32_t struct_id, int depth = 0) const;

    static std::string text(std::span<const uint32_t> args);

    std::unordered_map<uint32_t, Type> types_;
    std::unordered_map<uint32_t, IdInfo> ids_;
    std::unordered_map<uint32_t, uint32_t> constants_;
    std::vector<Variable> variables_;
    uint32_t entry_id_ = 0;
    Reflection out_;
};

std::string Reader::text(std::span<const uint32_t> args) {
    const char* begin = reinterpret_cast<const char*>(args.data());
    const char* end = static_cast<const char*>(std::memchr(begin, 0, args.size_bytes()));
    return {begin, end ? end : begin + args.size_bytes()};
}

Result<Reflection> Reader::read(std::span<const uint32_t> words) {
    if (words.size() < 5 || words[0] != 0x07230203u)
        return Error{"shader: not a SPIR-V module (of this machine's byte order)", ErrorKind::Input};
    for (size_t at = 5; at < words.size();) {
        const uint32_t length = words[at] >> 16;
        if (length == 0 || at + length > words.size())
            return Error{"shader: SPIR-V is cut off at word " + std::to_string(at), ErrorKind::Input};
        instruction(words[at] & 0xffffu, words.subspan(at + 1, length - 1));
        at += length;
    }
    if (entry_id_ == 0) return Error{"shader: SPIR-V has no entry point of a stage that we know", ErrorKind::Input};
    finish();
    return std::move(out_);
}

void Reader::instruction(uint32_t op, std::span<const uint32_t> args) {
    // Fewest words that each instruction we look into may have.
    const auto at_least = [&](size_t n) { return args.size() >= n; };
    switch (op) {
    case OpName:
        if (at_least(2)) ids_[args[0]].name = text(args.subspan(1));
        break;
    case OpMemberName:
        if (at_least(3) && args[1] < 4096) ids_[args[0]].member(args[1]).name = text(args.subspan(2));
        break;
    case OpEntryPoint:
        if (at_least(3) && entry_id_ == 0) {
            const uint32_t model = args[0];
            if (model == 0) out_.stage = ShaderStage::Vertex;
            if (model == 4) out_.stage = ShaderStage::Fragment;
            if (model == 5) out_.stage = ShaderStage::Compute;
            if (model == 5313) out_.stage = ShaderStage::RayGen;
            if (model == 5314) out_.stage = ShaderStage::Intersection;
            if (model == 5316) out_.stage = ShaderStage::ClosestHit;
            if (model == 5317) out_.stage = ShaderStage::Miss;
            if (model == 5365) out_.stage = ShaderStage::Mesh;
            if (out_.stage == ShaderStage::None) break;
            entry_id_ = args[1];
            out_.entry = text(args.subspan(2));
        }
        break;
    case OpExecutionMode:
        if (at_least(5) && args[0] == entry_id_ && args[1] == 17) out_.workgroup = {args[2], args[3], args[4]};
        break;
    case OpExecutionModeId:  // LocalSizeId: ids of constants, resolved in finish()
        if (at_least(5) && args[0] == entry_id_ && args[1] == 38) {
            ids_[entry_id_].members.clear();
            for (uint32_t i = 0; i < 3; ++i) ids_[entry_id_].member(i).offset = args[2 + i];
        }
        break;
    case OpCapability:
        if (at_least(1))
            if (const std::string_view text = beyond_floor_name(args[0]); !text.empty())
                out_.beyond_floor.emplace_back(text);
        break;
    case OpTypeBool:
    case OpTypeSampler:
    case OpTypeAccelerationStructure:
        if (at_least(1)) types_[args[0]] = {.op = op, .width = 32};
        break;
    case OpTypeInt:
        if (at_least(3)) types_[args[0]] = {.op = op, .width = args[1], .is_signed = args[2] != 0};
        break;
    case OpTypeFloat:
        if (at_least(2)) types_[args[0]] = {.op = op, .width = args[1]};
        break;
    case OpTypeVector:
    case OpTypeMatrix:
    case OpTypeArray:
        if (at_least(3)) types_[args[0]] = {.op = op, .element = args[1], .count = args[2]};
        break;
    case OpTypeRuntimeArray:
    case OpTypeSampledImage:
        if (at_least(2)) types_[args[0]] = {.op = op, .element = args[1]};
        break;
    case OpTypeImage:
        if (at_least(8)) {
            Type t{.op = op, .element = args[1]};
            t.dim = args[2];
            t.is_depth = args[3] == 1;
            t.arrayed = args[4] != 0;
            t.sampled = args[6];
            t.image_format = args[7];
            types_[args[0]] = t;
        }
        break;
    case OpTypeStruct:
        if (at_least(1)) {
            Type t{.op = op};
            t.members.assign(args.begin() + 1, args.end());
            types_[args[0]] = std::move(t);
        }
        break;
    case OpTypePointer:
        if (at_least(3)) types_[args[0]] = {.op = op, .element = args[2], .storage_class = args[1]};
        break;
    case OpConstant:
    case OpSpecConstant:
        if (at_least(3)) constants_[args[1]] = args[2];
        break;
    case OpVariable:
        if (at_least(3)) variables_.push_back({.id = args[1], .type = args[0], .storage_class = args[2]});
        break;
    case OpDecorate:
        if (at_least(2)) decorate(ids_[args[0]], args[1], args.subspan(2));
        break;
    case OpMemberDecorate:
        if (at_least(3) && args[1] < 4096) decorate_member(ids_[args[0]].member(args[1]), args[2], args.subspan(3));
        break;
    default:
        break;
    }
}

void Reader::decorate(IdInfo& target, uint32_t decoration, std::span<const uint32_t> args) {
    const uint32_t value = args.empty() ? 0 : args[0];
    switch (decoration) {
    case Block:
        target.block = true;
        break;
    case BufferBlock:
        target.buffer_block = true;
        break;
    case ArrayStride:
        target.array_stride = value;
        break;
    case NonWritable:
        target.non_writable = true;
        break;
    case NonReadable:
        target.non_readable = true;
        break;
    case Binding:
        target.binding = value;
        break;
    case DescriptorSet:
        target.set = value;
        break;
    default:
        break;
    }
}

void Reader::decorate_member(MemberInfo& target, uint32_t decoration, std::span<const uint32_t> args) {
    const uint32_t value = args.empty() ? 0 : args[0];
    switch (decoration) {
    case Offset:
        target.offset = value;
        break;
    case MatrixStride:
        target.matrix_stride = value;
        break;
    case NonWritable:
        target.non_writable = true;
        break;
    case NonReadable:
        target.non_readable = true;
        break;
    default:
        break;
    }
}

const Type& Reader::type(uint32_t id) const {
    static const Type kNone;
    const auto it = types_.find(id);
    return it == types_.end() ? kNone : it->second;
}

uint32_t Reader::constant(uint32_t id) const {
    const auto it = constants_.find(id);
    return it == constants_.end() ? 0 : it->second;
}

// Bytes from the first to one past the last byte that decorations say; 0 for a runtime array.
uint32_t Reader::size_of(uint32_t type_id, uint32_t matrix_stride) const {
    const Type& t = type(type_id);
    const auto info = ids_.find(type_id);
    switch (t.op) {
    case OpTypeBool:
    case OpTypeInt:
    case OpTypeFloat:
        return t.width / 8;
    case OpTypeVector:
        return t.count * size_of(t.element);
    case OpTypeMatrix:
        return t.count * (matrix_stride ? matrix_stride : size_of(t.element));
    case OpTypeArray: {
        const uint32_t stride = info == ids_.end() ? 0 : info->second.array_stride;
        return constant(t.count) * (stride ? stride : size_of(t.element));
    }
    case OpTypeStruct: {
        uint32_t size = 0;
        for (uint32_t i = 0; i < t.members.size() && info != ids_.end() && i < info->second.members.size(); ++i) {
            const MemberInfo& m = info->second.members[i];
            size = std::max(size, m.offset + size_of(t.members[i], m.matrix_stride));
        }
        return size;
    }
    default:
        return 0;
    }
}

// Workgroup memory carries no offsets: the sum of the parts, a bool taking four bytes.
uint32_t Reader::packed_size_of(uint32_t type_id) const {
    const Type& t = type(type_id);
    switch (t.op) {
    case OpTypeBool:
    case OpTypeInt:
    case OpTypeFloat:
        return t.width / 8;
    case OpTypeVector:
    case OpTypeMatrix:
        return t.count * packed_size_of(t.element);
    case OpTypeArray:
        return constant(t.count) * packed_size_of(t.element);
    case OpTypeStruct: {
        uint32_t size = 0;
        for (const uint32_t member : t.members) size += packed_size_of(member);
        return size;
    }
    default:
        return 0;
    }
}

std::string Reader::type_name(uint32_t type_id) const {
    const Type& t = type(type_id);
    switch (t.op) {
    case OpTypeBool:
        return "bool";
    case OpTypeInt: {
        const std::string base = t.is_signed ? "int" : "uint";
        return t.width == 32 ? base : base + std::to_string(t.width) + "_t";
    }
    case OpTypeFloat:
        return t.width == 32 ? "float" : t.width == 64 ? "double" : "float16_t";
    case OpTypeVector: {
        const Type& e = type(t.element);
        const std::string prefix = e.op == OpTypeInt ? (e.is_signed ? "i" : "u") : e.op == OpTypeBool ? "b" : "";
        return prefix + "vec" + std::to_string(t.count);
    }
    case OpTypeMatrix: {
        const uint32_t rows = type(t.element).count;
        return "mat" + std::to_string(t.count) + (rows == t.count ? "" : "x" + std::to_string(rows));
    }
    case OpTypeArray:
    case OpTypeRuntimeArray:
        return type_name(t.element);
    case OpTypeStruct: {
        const auto info = ids_.find(type_id);
        return "struct " + (info == ids_.end() ? std::string() : info->second.name);
    }
    case OpTypePointer:
        return "pointer";
    default:
        return "?";
    }
}

std::vector<BlockMember> Reader::members_of(uint32_t struct_id, int depth) const {
    std::vector<BlockMember> out = {};
    const Type& t = type(struct_id);
    const auto info = ids_.find(struct_id);
    if (t.op != OpTypeStruct || info == ids_.end() || depth > 16) return out;
    for (uint32_t i = 0; i < t.members.size(); ++i) {
        static const MemberInfo kNone;
        const MemberInfo& m = i < info->second.members.size() ? info->second.members[i] : kNone;
        BlockMember member{.name = m.name, .type = type_name(t.members[i]), .offset = m.offset};
        member.size = size_of(t.members[i], m.matrix_stride);
        member.matrix_stride = m.matrix_stride;
        uint32_t element = t.members[i];
        if (const Type& array = type(element); array.op == OpTypeArray || array.op == OpTypeRuntimeArray) {
            member.array_count = array.op == OpTypeRuntimeArray ? kRemaining : constant(array.count);
            if (const auto a = ids_.find(element); a != ids_.end()) member.array_stride = a->second.array_stride;
            element = array.element;
        }
        member.members = members_of(element, depth + 1);
        out.push_back(std::move(member));
    }
    return out;
}

void Reader::finish() {
    if (const auto entry = ids_.find(entry_id_); entry != ids_.end() && entry->second.members.size() == 3)
        for (uint32_t i = 0; i < 3; ++i) out_.workgroup[i] = constant(entry->second.members[i].offset);

    for (const Variable& variable : variables_) {
        const Type& pointer = type(variable.type);
        if (pointer.op != OpTypePointer) continue;
        if (variable.storage_class == Workgroup) {
            out_.shared_bytes += packed_size_of(pointer.element);
        } else if (variable.storage_class == PushConstant) {
            out_.push_members = members_of(pointer.element);
            out_.push_bytes = (size_of(pointer.element) + 3u) & ~3u;
        } else if (variable.storage_class == UniformConstant || variable.storage_class == Uniform ||
                   variable.storage_class == StorageBuffer) {
            const auto info = ids_.find(variable.id);
            if (info != ids_.end() && info->second.binding != kRemaining)
                finish_binding(variable, pointer, info->second);
        }
    }
    std::sort(out_.bindings.begin(), out_.bindings.end(), [](const ReflectedBinding& a, const ReflectedBinding& b) {
        return std::pair(a.set, a.binding) < std::pair(b.set, b.binding);
    });
}

void Reader::finish_binding(const Variable& variable, const Type& pointer, const IdInfo& info) {
    ReflectedBinding b{.set = info.set == kRemaining ? 0 : info.set, .binding = info.binding, .name = info.name};
    b.stages = out_.stage;
    uint32_t inner_id = pointer.element;
    if (const Type& array = type(inner_id); array.op == OpTypeArray || array.op == OpTypeRuntimeArray) {
        b.array_count = array.op == OpTypeRuntimeArray ? kRemaining : constant(array.count);
        inner_id = array.element;
    }
    const Type& inner = type(inner_id);
    if (inner.op == OpTypeStruct) {
        const auto block = ids_.find(inner_id);
        if (block == ids_.end()) return;
        const bool storage = variable.storage_class == StorageBuffer || block->second.buffer_block;
        const auto& members = block->second.members;
        const auto all = [&](bool MemberInfo::*flag) {
            return !members.empty() &&
                   std::all_of(members.begin(), members.end(), [&](const MemberInfo& m) { return m.*flag; });
        };
        const bool read_only = info.non_writable || all(&MemberInfo::non_writable);
        b.write_only = storage && (info.non_readable || all(&MemberInfo::non_readable));
        b.kind = !storage    ? BindingKind::UniformBuffer
                 : read_only ? BindingKind::StorageBufferReadOnly
                             : BindingKind::StorageBuffer;
        if (b.name.empty()) b.name = block->second.name;
        b.block_size = size_of(inner_id);
        b.members = members_of(inner_id);
    } else if (inner.op == OpTypeImage) {
        const Type& texel = type(inner.element);
        b.kind = inner.sampled == 2
                     ? (info.non_writable ? BindingKind::StorageTextureReadOnly : BindingKind::StorageTexture)
                     : BindingKind::SampledTexture;
        b.write_only = inner.sampled == 2 && info.non_readable;
        b.format = inner.sampled == 2 ? format_of(inner.image_format) : Format::Undefined;
        b.dimension = inner.dim == 0   ? Dimension::D1
                      : inner.dim == 2 ? Dimension::D3
                                       : (inner.arrayed ? Dimension::D2Array : Dimension::D2);
        b.sample_type = texel.op == OpTypeInt ? SampleType::Uint
                        : inner.is_depth      ? SampleType::Depth
                                              : SampleType::Float;
    } else if (inner.op == OpTypeSampler) {
        b.kind = BindingKind::Sampler;
    } else if (inner.op == OpTypeAccelerationStructure) {
        b.kind = BindingKind::BoxTree;
    } else if (inner.op == OpTypeSampledImage) {
        b.kind = BindingKind::SampledTexture;
        out_.beyond_floor.push_back("CombinedTextureSampler");
    } else {
        out_.beyond_floor.push_back("UnknownBinding");
        return;
    }
    out_.bindings.push_back(std::move(b));
}

}  // namespace

Result<Reflection> reflect_spirv(std::span<const uint32_t> words) { return Reader().read(words); }

}  // namespace kiln::rhi
