// SPDX-License-Identifier: MIT
// Plain data of the rendering hardware interface: handles, access states, and the description of every object.
// Shaped like WebGPU, the strictest of the interfaces we mean to fit (Vulkan 1.3, WebGPU, Direct3D 12).
#pragma once

#include "rhi/format.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace kiln::rhi {

// A name for an object of a device: slot index and the slot's generation. A stale handle is detected, never followed.
// Generation 0 is "no object".
template <typename Tag>
struct Handle {
    uint32_t index = 0;
    uint32_t generation = 0;
    explicit operator bool() const { return generation != 0; }
    friend bool operator==(const Handle&, const Handle&) = default;
    // For maps keyed by handle.
    uint64_t bits() const { return uint64_t{generation} << 32 | index; }
};

using HeapHandle = Handle<struct HeapTag>;  // memory that several transient resources share, one after the other
using BufferHandle = Handle<struct BufferTag>;
using TextureHandle = Handle<struct TextureTag>;
using ViewHandle = Handle<struct ViewTag>;
using SamplerHandle = Handle<struct SamplerTag>;
using ShaderModule = Handle<struct ShaderModuleTag>;
using BindGroupLayout = Handle<struct BindGroupLayoutTag>;
using BindGroup = Handle<struct BindGroupTag>;
using PipelineLayout = Handle<struct PipelineLayoutTag>;
using ComputePipeline = Handle<struct ComputePipelineTag>;
using RenderPipeline = Handle<struct RenderPipelineTag>;
using TracePipeline = Handle<struct TracePipelineTag>;
using QuerySet = Handle<struct QuerySetTag>;
using SurfaceHandle = Handle<struct SurfaceTag>;  // what a window shows

// Number of a submission to the queue; later ones are larger. 0 is "none", always completed.
using SubmitId = uint64_t;

// A set of enumerators that are single bits.
#define KILN_RHI_BITS(T)                                                     \
    constexpr T operator|(T a, T b) { return T(uint32_t(a) | uint32_t(b)); } \
    constexpr T operator&(T a, T b) { return T(uint32_t(a) & uint32_t(b)); } \
    constexpr T operator~(T a) { return T(~uint32_t(a)); }                   \
    constexpr T& operator|=(T& a, T b) { return a = a | b; }                 \
    constexpr bool any(T a) { return uint32_t(a) != 0; }

// How commands touch a buffer or a range of texture subresources. Synchronisation and texture layouts follow from it.
// Several reads may stand together (`SampledReadCompute | CopyRead`); a write stands alone. StorageWrite includes
// reading in the same shader, DepthWrite the depth test, ColorWrite blending. What ray-tracing shaders touch is …Compute,
// what mesh shaders touch …Graphics.
enum class Access : uint32_t {
    Undefined = 0,  // before: the contents don't matter. After: not allowed
    IndirectRead = 1u << 0,
    IndexRead = 1u << 1,
    VertexRead = 1u << 2,
    UniformRead = 1u << 3,  // any shader stage
    SampledReadGraphics = 1u << 4,
    SampledReadCompute = 1u << 5,
    StorageReadGraphics = 1u << 6,
    StorageReadCompute = 1u << 7,
    StorageWriteGraphics = 1u << 8,
    StorageWriteCompute = 1u << 9,
    ColorWrite = 1u << 10,
    DepthRead = 1u << 11,
    DepthWrite = 1u << 12,
    CopyRead = 1u << 13,
    CopyWrite = 1u << 14,
    HostRead = 1u << 15,
    Present = 1u << 16,
    BoxesRead = 1u << 17,     // by build_box_tree
    BoxTreeWrite = 1u << 18,  // by build_box_tree
    BoxTreeRead = 1u << 19,   // by rays
};
KILN_RHI_BITS(Access)
constexpr Access kWriteAccess = Access::StorageWriteGraphics | Access::StorageWriteCompute | Access::ColorWrite |
                                Access::DepthWrite | Access::CopyWrite | Access::BoxTreeWrite;
constexpr bool writes(Access a) { return any(a & kWriteAccess); }
std::string name(Access access);  // "SampledReadCompute|CopyRead"

enum class ShaderStage : uint32_t {
    None = 0,
    Vertex = 1,
    Fragment = 2,
    Compute = 4,
    Mesh = 8,     // needs Caps::mesh_shader
    RayGen = 16,  // these four need Caps::rt_pipeline
    Miss = 32,
    Intersection = 64,
    ClosestHit = 128,
};
KILN_RHI_BITS(ShaderStage)
inline constexpr std::array kStages{ShaderStage::Vertex,       ShaderStage::Fragment,  ShaderStage::Compute,
                                    ShaderStage::Mesh,         ShaderStage::RayGen,    ShaderStage::Miss,
                                    ShaderStage::Intersection, ShaderStage::ClosestHit};
std::string_view name(ShaderStage stage);  // of one stage: "ray generation"

// ---- memory ----------------------------------------------------------------------------------------------------

enum class MemoryKind : uint8_t {
    Device,    // fastest for the GPU; fill with write_buffer or copies
    Upload,    // mapped; the CPU writes in order, the GPU reads once
    Readback,  // mapped; the GPU copies into it, the CPU reads
};

enum class BufferUsage : uint32_t {
    None = 0,
    CopySrc = 1,
    CopyDst = 2,
    Uniform = 4,
    Storage = 8,
    Index = 16,
    Vertex = 32,
    Indirect = 64,
    QueryResolve = 128,
    Address = 256,   // its GPU address can be asked for; needs Caps::buffer_address
    Boxes = 512,     // Box after Box, for build_box_tree; needs Caps::rt_pipeline
    BoxTree = 1024,  // holds a box tree and nothing else (Device::box_tree_bytes); needs Caps::rt_pipeline
};
KILN_RHI_BITS(BufferUsage)

enum class TextureUsage : uint32_t {
    None = 0,
    CopySrc = 1,
    CopyDst = 2,
    Sampled = 4,
    Storage = 8,
    Color = 16,
    Depth = 32,
};
KILN_RHI_BITS(TextureUsage)

// Memory for transient resources placed by hand; see BufferDesc::heap, TextureDesc::heap.
struct HeapDesc {
    uint64_t size = 0;
    std::string_view label = {};
};

struct MemoryNeed {
    uint64_t size = 0;
    uint64_t alignment = 1;
};

struct BufferDesc {
    uint64_t size = 0;  // bytes
    BufferUsage usage = BufferUsage::Storage | BufferUsage::CopySrc | BufferUsage::CopyDst;
    MemoryKind memory = MemoryKind::Device;
    HeapHandle heap = {};  // with heap: the buffer lives at heap_offset of it, else in memory of its own
    uint64_t heap_offset = 0;
    std::string_view label = {};
};

enum class Dimension : uint8_t { D1, D2, D2Array, D3 };

struct Extent {
    uint32_t width = 1;
    uint32_t height = 1;
    uint32_t depth = 1;  // depth of a D3 texture, layers of a D2Array, else 1
    friend bool operator==(const Extent&, const Extent&) = default;
};

struct TextureDesc {
    Dimension dimension = Dimension::D2;
    Format format = Format::Rgba8Unorm;
    Extent size = {};
    uint32_t mips = 1;
    TextureUsage usage = TextureUsage::Sampled | TextureUsage::Storage | TextureUsage::CopySrc | TextureUsage::CopyDst;
    HeapHandle heap = {};
    uint64_t heap_offset = 0;
    std::string_view label = {};
};

constexpr uint32_t kRemaining = ~0u;

// Mips and array layers of a texture. A D3 texture has one layer.
struct Subresources {
    uint32_t base_mip = 0;
    uint32_t mip_count = kRemaining;
    uint32_t base_layer = 0;
    uint32_t layer_count = kRemaining;
    friend bool operator==(const Subresources&, const Subresources&) = default;
};

struct ViewDesc {
    TextureHandle texture = {};
    Subresources range = {};
    bool as_array = false;  // a D2Array texture's view is an array also when it has one layer; without: D2
    std::string_view label = {};
};

enum class Filter : uint8_t { Nearest, Linear };
enum class AddressMode : uint8_t { ClampToEdge, Repeat, MirrorRepeat };
enum class Compare : uint8_t { Never, Less, Equal, LessEqual, Greater, NotEqual, GreaterEqual, Always };

struct SamplerDesc {
    Filter mag = Filter::Linear;
    Filter min = Filter::Linear;
    Filter mip = Filter::Nearest;
    AddressMode address = AddressMode::ClampToEdge;
    float lod_min = 0.0f;
    float lod_max = 32.0f;
    Compare compare = Compare::Never;  // other than Never: a comparison sampler
    std::string_view label = {};
};

// ---- binding ---------------------------------------------------------------------------------------------------

enum class BindingKind : uint8_t {
    UniformBuffer,
    StorageBuffer,          // read and write
    StorageBufferReadOnly,  // `readonly buffer` in GLSL
    SampledTexture,         // `texture2D`, `texture3D`, `utexture2D` …; textures and samplers are always separate
    Sampler,
    StorageTexture,          // `image3D` with an explicit format; written (and read, if the shader does)
    StorageTextureReadOnly,  // `readonly image3D`
    BoxTree,                 // `accelerationStructureEXT`: a buffer of usage BoxTree
};
std::string_view name(BindingKind kind);

struct BindGroupLayoutEntry {
    uint32_t binding = 0;
    BindingKind kind = BindingKind::StorageBuffer;
    ShaderStage stages = ShaderStage::Compute;
    Format format = Format::Undefined;           // storage textures: the format the shader declares
    Dimension dimension = Dimension::D2;         // textures
    SampleType sample_type = SampleType::Float;  // SampledTexture; Float also accepts Depth32Float
    bool dynamic_offset = false;                 // buffers: offset given at set_bind_group
    friend bool operator==(const BindGroupLayoutEntry&, const BindGroupLayoutEntry&) = default;
};

struct BindGroupLayoutDesc {
    std::span<const BindGroupLayoutEntry> entries = {};
    std::string_view label = {};
};

constexpr uint64_t kWholeSize = ~0ull;

// Exactly one of buffer, view, sampler.
struct BindGroupEntry {
    uint32_t binding = 0;
    BufferHandle buffer = {};
    uint64_t offset = 0;
    uint64_t size = kWholeSize;
    ViewHandle view = {};
    SamplerHandle sampler = {};
};

struct BindGroupDesc {
    BindGroupLayout layout = {};
    std::span<const BindGroupEntry> entries = {};
    std::string_view label = {};
};

struct PipelineLayoutDesc {
    std::span<const BindGroupLayout> groups = {};  // index = set; at most kMaxBindGroups
    uint32_t push_bytes = 0;
    std::string_view label = {};
};

// ---- pipelines -------------------------------------------------------------------------------------------------

struct ShaderModuleDesc {
    std::span<const uint32_t> spirv = {};
    std::string_view label = {};
};

// Specialisation constant `layout(constant_id = id)`; a float's or an int's bits.
struct SpecConstant {
    uint32_t id = 0;
    uint32_t bits = 0;
};

struct ComputePipelineDesc {
    ShaderModule shader = {};
    std::string_view entry = "main";
    PipelineLayout layout = {};  // none: made from the shader's reflected bindings; see pipeline_group_layout
    std::span<const SpecConstant> constants = {};
    std::string_view label = {};
};

enum class VertexFormat : uint8_t { Float32, Float32x2, Float32x3, Float32x4, Unorm8x4, Uint32 };
uint32_t bytes_per_vertex_attribute(VertexFormat format);

struct VertexAttribute {
    uint32_t location = 0;
    VertexFormat format = VertexFormat::Float32x3;
    uint32_t offset = 0;
};

struct VertexBufferLayout {
    uint32_t stride = 0;
    bool per_instance = false;
    std::span<const VertexAttribute> attributes = {};
};

enum class Topology : uint8_t { TriangleList, TriangleStrip, LineList, LineStrip, PointList };
enum class Cull : uint8_t { None, Front, Back };

enum class BlendFactor : uint8_t {
    Zero,
    One,
    SrcAlpha,
    OneMinusSrcAlpha,
    DstAlpha,
    OneMinusDstAlpha,
    SrcColor,
    DstColor
};
enum class BlendOp : uint8_t { Add, Subtract, ReverseSubtract, Min, Max };

struct BlendComponent {
    BlendFactor src = BlendFactor::One;
    BlendFactor dst = BlendFactor::Zero;
    BlendOp op = BlendOp::Add;
};

struct ColorTarget {
    Format format = Format::Rgba16Float;
    bool blend = false;
    BlendComponent color = {};
    BlendComponent alpha = {};
    uint8_t write_mask = 0xf;  // bit 0 red … bit 3 alpha
};

struct DepthState {
    Format format = Format::Undefined;  // Undefined: no depth attachment
    bool write = true;
    Compare compare = Compare::Greater;  // reversed depth
};

struct RenderPipelineDesc {
    ShaderModule vertex = {};
    ShaderModule fragment = {};
    std::string_view vertex_entry = "main";
    std::string_view fragment_entry = "main";
    PipelineLayout layout = {};  // none: made from the reflected bindings of both shaders
    std::span<const VertexBufferLayout> vertex_buffers = {};
    Topology topology = Topology::TriangleList;
    Cull cull = Cull::None;
    bool front_is_counter_clockwise = true;
    std::span<const ColorTarget> colors = {};
    DepthState depth = {};
    std::span<const SpecConstant> constants = {};
    std::string_view label = {};
    // Instead of `vertex` and `vertex_buffers`: workgroups that make triangles (draw_mesh_groups). Its entry is "main".
    // Needs Caps::mesh_shader.
    ShaderModule mesh = {};
};

// One box of a box tree, in the space of the rays that are traced through it.
struct Box {
    float min_x, min_y, min_z;
    float max_x, max_y, max_z;
};

// Rays through box trees: `raygen` runs for each of width x height and traces; `intersection` says of a box that a ray may meet
// whether, and where, the ray hits what is in it; `closest_hit` or `miss` ends the ray.
struct TracePipelineDesc {
    ShaderModule raygen = {};
    ShaderModule miss = {};
    ShaderModule intersection = {};
    ShaderModule closest_hit = {};
    PipelineLayout layout = {};  // none: made from the reflected bindings of all shaders
    std::string_view label = {};
};

struct QuerySetDesc {
    uint32_t count = 0;  // timestamps
    std::string_view label = {};
};

// ---- windows ---------------------------------------------------------------------------------------------------

// What a window system gives a device that is to draw into its windows; this module knows none of them.
struct WindowSystem {
    std::vector<std::string> extensions = {};  // of Vulkan's instance
    // A VkSurfaceKHR of the window, as a number, for the VkInstance given; 0 where it cannot be made. The device destroys it.
    std::function<uint64_t(void* instance)> make_surface = {};
};

struct SurfaceDesc {
    std::function<uint64_t(void* instance)> make = {};  // WindowSystem::make_surface; the null device asks nobody
    std::string_view label = {};
};

// Fifo: a picture a refresh of the screen. Mailbox: the newest one at each refresh, where the window system can, else Fifo.
enum class PresentMode : uint8_t { Fifo, Mailbox };

struct SurfaceSettings {
    uint32_t width = 0, height = 0;  // pixels of the window, where the window system leaves that to us
    PresentMode mode = PresentMode::Fifo;
};

enum class SurfaceState : uint8_t {
    Ready,
    Outdated,  // the window has another size: configure() again
    Hidden,    // it has no pixels now
    Busy,      // no texture is free yet
    Lost,      // the window system took the surface away: destroy it and make another
};

// What the window is to show next. Its texture is copied into and presented, no more; it goes with present().
struct SurfaceImage {
    SurfaceState state = SurfaceState::Ready;
    TextureHandle texture = {};  // of a Ready one
    Format format = Format::Undefined;
    uint32_t width = 0, height = 0;
};

// ---- what a device can do ----------------------------------------------------------------------------------------

// The floor: what every device has and what the validation holds every user to.
constexpr uint32_t kMaxBindGroups = 4;
constexpr uint32_t kMaxStorageBuffersPerStage = 8;
constexpr uint32_t kMaxStorageTexturesPerStage = 4;
constexpr uint32_t kMaxSampledTexturesPerStage = 16;
constexpr uint32_t kMaxSamplersPerStage = 16;
constexpr uint32_t kMaxUniformBuffersPerStage = 12;
constexpr uint32_t kMaxUniformBinding = 64 << 10;
constexpr uint64_t kMaxStorageBinding = 128ull << 20;
constexpr uint32_t kMaxPushBytes = 64;
constexpr uint32_t kMaxWorkgroupThreads = 256;
constexpr uint32_t kMaxWorkgroupShared = 16 << 10;
constexpr uint32_t kMaxGroupsPerDispatch = 65535;  // along each axis
constexpr uint32_t kMaxMeshGroups = 1u << 22;      // of one draw_mesh_groups
constexpr uint32_t kMaxRays = 1u << 30;            // of one trace
constexpr uint32_t kMaxTexture2d = 8192;
constexpr uint32_t kMaxTexture3d = 2048;
constexpr uint32_t kMaxTextureLayers = 256;
constexpr uint32_t kMaxColorTargets = 8;
constexpr uint32_t kBindingAlignment = 256;  // of a buffer binding's offset

// Tiers above the floor. Every one has a fallback. No backend grants bindless, buffer_address, min_max_sampler or
// async_compute yet.
struct Caps {
    bool timestamp = false;
    bool storage_r16f = false;  // storage textures of R16Float, R16Uint, Rg16Float, R8Snorm, R11g11b10Float
    bool bindless = false;
    bool buffer_address = false;
    bool int64_buffer_atomics = false;
    bool min_max_sampler = false;
    bool float32_filter = false;  // linear sampling of R32Float, Rgba32Float
    bool mesh_shader = false;     // in render pipelines
    bool rt_pipeline = false;     // ray-tracing pipelines over boxes
    bool async_compute = false;
    bool multi_draw_indirect = false;
};

struct Limits {
    double timestamp_period_ns = 1.0;  // nanoseconds a tick
    uint64_t max_storage_binding = kMaxStorageBinding;
    uint64_t max_buffer = 256ull << 20;
    uint32_t max_texture_2d = kMaxTexture2d;
    uint32_t max_texture_3d = kMaxTexture3d;
    uint32_t copy_row_alignment = 1;     // of bytes_per_row in buffer <-> texture copies (256 on WebGPU)
    uint32_t copy_offset_alignment = 4;  // of the buffer offset in those copies
    uint32_t subgroup_size = 1;          // for reports; never assume it
};

enum class DeviceKind : uint8_t { Discrete, Integrated, Virtual, Cpu, Other };
std::string_view name(DeviceKind kind);

struct DeviceInfo {
    std::string backend = {};  // "vulkan", "null"
    std::string name = {};     // "llvmpipe (LLVM 15.0.6, 256 bits)"
    std::string driver = {};   // "llvmpipe Mesa 22.3.6"
    std::string api = {};      // "1.3.230"
    DeviceKind kind = DeviceKind::Other;
    uint64_t memory_bytes = 0;  // of device-local heaps
    bool usable = true;
    std::string unusable_because = {};
    bool mesh_shader = false, rt_pipeline = false;  // as in Caps
};

struct MemoryStats {
    uint64_t device_bytes = 0;  // reserved from the driver, by kind of memory
    uint64_t upload_bytes = 0;
    uint64_t readback_bytes = 0;
    uint64_t used_bytes = 0;  // handed out to live resources
    uint64_t peak_used_bytes = 0;
    uint32_t blocks = 0;     // driver allocations
    uint32_t resources = 0;  // live buffers and textures
};

#undef KILN_RHI_BITS

}  // namespace kiln::rhi
