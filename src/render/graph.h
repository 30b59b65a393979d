// SPDX-License-Identifier: MIT
// One frame's GPU work, as passes that are functions of images:
//
//   Image half = g.create("bloom half", {.size = hdr.size / 2, .format = rhi::Format::Rgba16Float});
//   g.dispatch(kBloomThreshold, half.size, {g.read(hdr), g.write(half)}, BloomParams{.threshold = s.threshold});
//
// read() and write() declare and bind at once: the list fills the kernel's bindings in order of (set, binding), and is
// checked against what the kernel's SPIR-V says. Passes run in the order they were recorded, less those nobody needs.
// Recording touches no device. compile() (graph_plan.h) turns it into a Plan; a Runner (graph_runner.h) executes it.
// Wrong use never stops the program while recording: the sentences collect in errors(), and compile() fails with them.
#pragma once

#include "render/graph_kernel.h"
#include "rhi/commands.h"

#include <array>
#include <cstring>
#include <initializer_list>
#include <type_traits>
#include <variant>

namespace kiln::render {

class Runner;
struct Plan;
struct CompileOptions;
struct ReadbackState;

// Threads along each axis from texels, halved or divided for smaller images; never below one.
constexpr rhi::Extent operator/(rhi::Extent e, uint32_t n) {
    auto part = [n](uint32_t v) { return v / n ? v / n : 1u; };
    return {part(e.width), part(e.height), part(e.depth)};
}
constexpr rhi::Extent mip_size(rhi::Extent e, uint32_t mip) { return e / (1u << mip); }

// A version of an image or buffer of one graph. Writing makes a new version: write(image) updates the handle it is given;
// copies made before it are stale, and using one is an error (the reader would see other contents than it was promised).
struct Image {
    uint32_t id = ~0u;
    uint32_t version = 0;
    rhi::Extent size = {};  // texels of mip 0
    rhi::Format format = rhi::Format::Undefined;
    rhi::Dimension dimension = rhi::Dimension::D2;
    uint32_t mips = 1;
    explicit operator bool() const { return id != ~0u; }
};

struct Buffer {
    uint32_t id = ~0u;
    uint32_t version = 0;
    uint64_t size = 0;  // bytes
    explicit operator bool() const { return id != ~0u; }
};

struct ImageDesc {
    rhi::Extent size = {};
    rhi::Format format = rhi::Format::Rgba16Float;
    rhi::Dimension dimension = rhi::Dimension::D2;
    uint32_t mips = 1;
    friend bool operator==(const ImageDesc&, const ImageDesc&) = default;
};

// Last frame's value and this frame's, swapped by the runner. `valid` is false on the first frame (or after the size
// changed): `previous` then holds zeros.
struct ImageHistory {
    Image previous, current;
    bool valid = false;
};
struct BufferHistory {
    Buffer previous, current;
    bool valid = false;
};

// A uniform block of this frame, for several passes: g.uniform(block).
struct Block {
    uint32_t offset = ~0u;
    uint32_t size = 0;
};

// Bytes on their way back from the GPU. Copies share them.
class Readback {
public:
    Readback() = default;
    bool ready() const;        // get() would not wait
    std::string name() const;  // of what it reads
    // Waits for the frame. Images: rows tightly packed, slices or layers one after the other.
    // An error if the frame was never executed, or failed.
    Result<std::vector<std::byte>> get() const;
    template <typename T>
    Result<std::vector<T>> get_as() const {
        auto bytes = get();
        if (!bytes) return bytes.error();
        std::vector<T> out(bytes->size() / sizeof(T));
        if (!out.empty()) std::memcpy(out.data(), bytes->data(), out.size() * sizeof(T));
        return out;
    }

private:
    friend class Graph;
    friend class Runner;
    std::shared_ptr<ReadbackState> state_;
};

constexpr rhi::Subresources kAll{};
constexpr rhi::Subresources mip(uint32_t level) { return {.base_mip = level, .mip_count = 1}; }
constexpr rhi::Subresources layer(uint32_t index) { return {.base_layer = index, .layer_count = 1}; }

constexpr rhi::SamplerDesc kNearestClamp{.mag = rhi::Filter::Nearest, .min = rhi::Filter::Nearest};
constexpr rhi::SamplerDesc kLinearClamp{};

// One argument of a pass. Made by the graph's read(), write(), …, used in the next pass, not kept.
struct Use {
    enum class Kind : uint8_t { Read, Write, ReadWrite, Block, Sampler };
    Kind kind = Kind::Read;
    bool is_image = false;
    bool uniform = false;      // Read of a buffer through a uniform binding
    bool has_sampler = false;  // Read of an image: fills a texture binding and the sampler binding after it
    uint32_t resource = ~0u;
    rhi::Subresources range = {};  // images
    uint64_t offset = 0;           // buffers: bytes, a multiple of 256
    uint64_t size = rhi::kWholeSize;
    rhi::SamplerDesc sampler = {};
    Block block = {};
};

// The arguments of a pass: a braced list, or a vector where the list is built by a loop.
class Uses {
public:
    Uses(std::initializer_list<Use> list) : span_(list.begin(), list.size()) {}
    Uses(const std::vector<Use>& list) : span_(list) {}
    auto begin() const { return span_.begin(); }
    auto end() const { return span_.end(); }
    size_t size() const { return span_.size(); }
    const Use& operator[](size_t i) const { return span_[i]; }

private:
    std::span<const Use> span_;
};

struct Groups {
    uint32_t x = 1, y = 1, z = 1;
};

// How much a dispatch does: an Extent counts threads (rounded up to the kernel's workgroups: guard the edge in the
// shader), Groups counts workgroups.
struct Work {
    Work(rhi::Extent threads) : extent(threads), in_groups(false) {}
    Work(Groups groups) : extent{groups.x, groups.y, groups.z}, in_groups(true) {}
    rhi::Extent extent;
    bool in_groups;
};

// One piece of a copy between buffer and image, or image and image.
struct CopyRegion {
    uint64_t buffer_offset = 0;
    uint32_t bytes_per_row = 0;   // 0: tight
    uint32_t rows_per_layer = 0;  // 0: tight
    uint32_t mip = 0;             // of the image (image to image: of the destination)
    rhi::Origin origin = {};      // of the image (image to image: of the destination)
    uint32_t src_mip = 0;         // image to image
    rhi::Origin src_origin = {};  // image to image
    rhi::Extent size = {};        // texels
};

struct ColorUse {
    Image* image = nullptr;
    rhi::Load load = rhi::Load::Clear;
    std::array<float, 4> clear{};
    rhi::Subresources range = mip(0);
};
struct DepthUse {
    Image* image = nullptr;  // none: no depth
    rhi::Load load = rhi::Load::Clear;
    float clear = 0.0f;  // far, in reversed depth
    bool read_only = false;
    rhi::Subresources range = mip(0);
};
struct Targets {
    std::vector<ColorUse> colors = {};
    DepthUse depth = {};
};
struct DrawCall {
    uint32_t vertices = 0;      // indices, with an index buffer; with a mesh shader, workgroups along x
    uint32_t instances = 1;     // with a mesh shader, workgroups along y
    uint32_t first_vertex = 0;  // first index, with an index buffer
    uint32_t first_instance = 0;
    Buffer vertex_buffer = {};    // slot 0; none: the shader pulls
    Buffer index_buffer = {};     // 32-bit
    Buffer indirect_buffer = {};  // arguments come from here instead
    uint64_t indirect_offset = 0;
};

// ---- what was recorded; compile() and the runner read it ---------------------------------------------------------

struct GraphResource {
    enum class Origin : uint8_t { Transient, Imported, History, Upload, Readback };
    std::string name = {};
    bool is_image = false;
    Origin origin = Origin::Transient;
    rhi::Extent size = {};
    rhi::Format format = rhi::Format::Undefined;
    rhi::Dimension dimension = rhi::Dimension::D2;
    uint32_t mips = 1;
    uint64_t bytes = 0;  // buffers
    uint32_t version = 0;
    std::vector<rhi::Access> entry = {};  // one a subresource, as it is when the frame begins; empty: all Undefined
    rhi::Access leave = rhi::Access::Undefined;  // access to leave it in; Undefined: any
    bool output = false;
    std::string history = {};  // the runner's name of it
    bool history_current = false;
    rhi::TextureHandle texture = {};   // imported
    rhi::BufferHandle buffer = {};     // imported
    std::vector<std::byte> data = {};  // upload
    std::shared_ptr<ReadbackState> readback = {};

    uint32_t layers() const { return is_image && dimension == rhi::Dimension::D2Array ? size.depth : 1; }
    uint32_t subresources() const { return is_image ? mips * layers() : 1; }
    bool transient() const { return origin == Origin::Transient; }
};

// What a pass does to a resource. `overwrites`: nothing of the old contents of the range is left afterwards.
struct GraphAccess {
    uint32_t resource = 0;
    rhi::Subresources range = {};  // counts resolved
    rhi::Access access = rhi::Access::Undefined;
    bool reads_old = false;  // depends on the contents before the pass
    bool overwrites = false;
};

struct BoundUse {
    uint32_t set = 0;
    uint32_t binding = 0;
    Use use = {};
    rhi::Dimension dimension = rhi::Dimension::D2;  // images: as the shader sees them
    bool sampler_half = false;                      // the sampler of a sampled image
};

struct DispatchCommand {
    const Kernel* kernel = nullptr;
    std::vector<BoundUse> bindings = {};
    std::vector<std::byte> push = {};
    std::array<uint32_t, 3> groups{1, 1, 1};
    uint32_t indirect = ~0u;  // resource with the group counts
    uint64_t indirect_offset = 0;
};
struct DrawCommand {
    const RasterKernel* kernel = nullptr;
    std::vector<BoundUse> bindings = {};
    std::vector<std::byte> push = {};
    Targets targets = {};  // image pointers are not valid any more: see the ids
    std::vector<uint32_t> color_ids = {};
    uint32_t depth_id = ~0u;
    std::vector<DrawCall> draws = {};
};
struct TraceCommand {
    const TraceKernel* kernel = nullptr;
    std::vector<BoundUse> bindings = {};
    std::vector<std::byte> push = {};
    uint32_t width = 0, height = 0;
};
struct BuildCommand {
    uint32_t boxes = 0, tree = 0;  // resources
    uint32_t count = 0;
};
struct CopyCommand {
    uint32_t src = 0, dst = 0;                          // resources
    uint64_t src_offset = 0, dst_offset = 0, size = 0;  // buffer to buffer
    std::vector<CopyRegion> regions = {};               // the others
};
struct ClearCommand {
    uint32_t resource = 0;
    std::array<float, 4> value{};
    rhi::Subresources range = {};
    uint32_t word = 0;
    uint64_t offset = 0, size = rhi::kWholeSize;
};

struct GraphPass {
    std::string name = {};
    std::vector<GraphAccess> accesses =
        {};  // at most one a subresource once normalised; reads of one subresource are or-ed
    std::variant<DispatchCommand, DrawCommand, CopyCommand, ClearCommand, TraceCommand, BuildCommand> command = {};
    bool keep = false;
};

class Graph {
public:
    // Without a runner: for plans and tests; import() then needs the overload with a description.
    Graph();
    // For one frame of `runner`; takes over what it knows about imported resources and histories.
    explicit Graph(Runner& runner);
    ~Graph();
    Graph(const Graph&) = delete;
    Graph& operator=(const Graph&) = delete;

    // ---- resources
    // Contents undefined until a pass writes; reading before that is an error. Lives from first to last use, in memory
    // it shares with others.
    Image create(std::string_view name, const ImageDesc& desc);
    Buffer create_buffer(std::string_view name, uint64_t bytes);
    // Somebody else's, for longer than the frame. `current`: how it was last used (Undefined: a new texture without
    // contents, or a buffer only written by write_buffer); once a runner has executed a graph with it, the runner knows
    // better and `current` is ignored (see Runner::set_access). Importing twice gives the same resource.
    Image import(std::string_view name, rhi::TextureHandle texture, rhi::Access current = rhi::Access::Undefined);
    Buffer import(std::string_view name, rhi::BufferHandle buffer, rhi::Access current = rhi::Access::Undefined);
    Image import(std::string_view name, rhi::TextureHandle texture, const ImageDesc& desc, rhi::Access current);
    Buffer import(std::string_view name, rhi::BufferHandle buffer, uint64_t bytes, rhi::Access current);
    // Kept by the runner under this name.
    ImageHistory history(std::string_view name, const ImageDesc& desc);
    BufferHistory history_buffer(std::string_view name, uint64_t bytes);
    // A buffer with these bytes in it, for this frame.
    Buffer upload(std::string_view name, std::span<const std::byte> bytes);
    template <typename T>
    requires std::is_trivially_copyable_v<T> Buffer upload(std::string_view name, std::span<const T> values) {
        return upload(name, std::as_bytes(values));
    }
    // A uniform block for several passes of this frame.
    template <typename T>
    requires std::is_trivially_copyable_v<T> Block block(const T& value) {
        return block_bytes(std::as_bytes(std::span(&value, 1)));
    }
    Block block_bytes(std::span<const std::byte> bytes);

    // ---- arguments of a pass: declare and bind at once
    // As a texture (texelFetch), a readonly storage image, a readonly storage buffer or a uniform buffer, as the kernel says.
    Use read(const Image& image, rhi::Subresources range = kAll);
    Use read(const Buffer& buffer, uint64_t offset = 0, uint64_t size = rhi::kWholeSize);
    // A texture binding, and the sampler binding that follows it.
    Use sampled(const Image& image, const rhi::SamplerDesc& sampler = kLinearClamp, rhi::Subresources range = kAll);
    Use sampler(const rhi::SamplerDesc& sampler);  // a sampler binding alone
    // Storage image (one mip) or buffer. write(): the kernel declares it writeonly; what it doesn't write stays as it was.
    Use write(Image& image, rhi::Subresources range = kAll);
    Use write(Buffer& buffer, uint64_t offset = 0, uint64_t size = rhi::kWholeSize);
    Use read_write(Image& image, rhi::Subresources range = kAll);
    Use read_write(Buffer& buffer, uint64_t offset = 0, uint64_t size = rhi::kWholeSize);
    Use uniform(Block block);

    // ---- passes
    // `params` becomes the kernel's push data if it declares any, else fills its first uniform block (which then has no
    // place in the list). Its size must be the block's.
    template <typename P>
    requires std::is_trivially_copyable_v<P>
    void dispatch(const Kernel& kernel, Work work, Uses uses, const P& params) {
        dispatch_bytes(kernel, work, nullptr, 0, uses, std::as_bytes(std::span(&params, 1)));
    }
    void dispatch(const Kernel& kernel, Work work, Uses uses) { dispatch_bytes(kernel, work, nullptr, 0, uses, {}); }
    // Three uint32 group counts at `offset` of `groups`.
    template <typename P>
    requires std::is_trivially_copyable_v<P>
    void dispatch_indirect(const Kernel& kernel, const Buffer& groups, uint64_t offset, Uses uses, const P& params) {
        dispatch_bytes(kernel, Groups{}, &groups, offset, uses, std::as_bytes(std::span(&params, 1)));
    }
    void dispatch_indirect(const Kernel& kernel, const Buffer& groups, uint64_t offset, Uses uses) {
        dispatch_bytes(kernel, Groups{}, &groups, offset, uses, {});
    }
    template <typename P>
    requires std::is_trivially_copyable_v<P>
    void draw(const RasterKernel& kernel, Targets targets, Uses uses, const P& params,
              std::span<const DrawCall> draws) {
        draw_bytes(kernel, std::move(targets), uses, std::as_bytes(std::span(&params, 1)), draws);
    }
    void draw(const RasterKernel& kernel, Targets targets, Uses uses, std::span<const DrawCall> draws) {
        draw_bytes(kernel, std::move(targets), uses, {}, draws);
    }
    // Rays of size.width x size.height through box trees, which the kernel reads as buffers.
    void trace(const TraceKernel& kernel, rhi::Extent size, const Uses& uses);
    // Makes `tree` (imported: it stays) one of the first `count` of `boxes`, each an rhi::Box.
    void build_boxes(const Buffer& boxes, Buffer& tree, uint32_t count);
    void copy(const Buffer& src, Image& dst, std::span<const CopyRegion> regions);
    void copy(const Image& src, Buffer& dst, std::span<const CopyRegion> regions);
    void copy(const Image& src, Image& dst, std::span<const CopyRegion> regions);
    void copy(const Buffer& src, uint64_t src_offset, Buffer& dst, uint64_t dst_offset, uint64_t size);
    void clear(Image& image, std::array<float, 4> value = {}, rhi::Subresources range = kAll);
    void clear(Buffer& buffer, uint32_t word = 0, uint64_t offset = 0, uint64_t size = rhi::kWholeSize);

    // ---- what must come out
    // The contents are there after execute() (Runner::texture, Runner::buffer), in access `leave` if given.
    void output(const Image& image, rhi::Access leave = rhi::Access::Undefined);
    void output(const Buffer& buffer, rhi::Access leave = rhi::Access::Undefined);
    Readback readback(const Image& image, uint32_t mip = 0, uint32_t layer = 0);
    Readback readback(const Buffer& buffer, uint64_t offset = 0, uint64_t size = rhi::kWholeSize);

    const std::vector<std::string>& errors() const { return errors_; }

    // Pure: the same recording and options give the same plan. Defined in graph_compile.cpp.
    Result<Plan> compile(const CompileOptions& options) const;

    const std::vector<GraphResource>& resources() const { return resources_; }
    const std::vector<GraphPass>& passes() const { return passes_; }
    std::span<const std::byte> block_data() const { return blocks_; }

private:
    friend class Runner;
    void dispatch_bytes(const Kernel& kernel, Work work, const Buffer* indirect, uint64_t indirect_offset,
                        const Uses& uses, std::span<const std::byte> params);
    void draw_bytes(const RasterKernel& kernel, Targets targets, const Uses& uses, std::span<const std::byte> params,
                    std::span<const DrawCall> draws);
    // Matches uses (and params) with the reflected bindings; false after an error.
    bool bind(GraphPass& pass, const rhi::Reflection& reflection, const Uses& uses, std::span<const std::byte> params,
              std::vector<BoundUse>& bindings, std::vector<std::byte>& push, bool graphics);
    bool bind_one(GraphPass& pass, const rhi::ReflectedBinding& binding, const Use& use,
                  std::vector<BoundUse>& bindings, bool graphics);
    bool touch(GraphPass& pass, uint32_t resource, rhi::Subresources range, rhi::Access access, bool reads_old,
               bool overwrites);
    void add(GraphPass pass);
    bool current(const Image& image, const char* verb);
    bool current(const Buffer& buffer, const char* verb);
    bool bump(Image& image, const char* verb);
    bool bump(Buffer& buffer, const char* verb);
    // The subresources that regions touch on the image's side, declared with `access`.
    bool touch_regions(GraphPass& pass, uint32_t image, std::span<const CopyRegion> regions, bool source,
                       rhi::Access access);
    bool check_buffer_side(const GraphPass& pass, const GraphResource& image, const GraphResource& buffer,
                           std::span<const CopyRegion> regions);
    template <typename T>
    bool known(const T& handle, bool is_image, const char* verb);
    Image image_of(uint32_t id) const;
    Buffer buffer_of(uint32_t id) const;
    uint32_t add_resource(GraphResource resource);
    void error(std::string sentence);
    // The only barriers of the program (besides those tests of rhi make). For the runner.
    static void emit(rhi::CommandEncoder& encoder, std::span<const rhi::Barrier> barriers);

    Runner* runner_ = nullptr;
    uint64_t begun_after_ = 0;  // frames the runner had executed
    std::unique_ptr<Reflections> own_reflections_;
    Reflections* reflections_;
    std::vector<GraphResource> resources_;
    std::vector<GraphPass> passes_;
    std::vector<std::byte> blocks_;
    std::vector<std::string> errors_;
};

}  // namespace kiln::render
