// SPDX-License-Identifier: MIT
// Recording: resources, uses, and the checks that need no device.
#include "render/graph.h"

#include "base/assert.h"
#include "render/graph_readback.h"
#include "render/graph_runner.h"

#include <algorithm>

namespace kiln::render {

using rhi::Access;
using rhi::BindingKind;

namespace {

rhi::Subresources resolved(const GraphResource& r, rhi::Subresources range) {
    if (!r.is_image) return {0, 1, 0, 1};
    if (range.mip_count == rhi::kRemaining) range.mip_count = range.base_mip < r.mips ? r.mips - range.base_mip : 0;
    if (range.layer_count == rhi::kRemaining)
        range.layer_count = range.base_layer < r.layers() ? r.layers() - range.base_layer : 0;
    return range;
}

bool inside(const GraphResource& r, const rhi::Subresources& range) {
    if (!r.is_image) return true;
    return range.mip_count > 0 && range.layer_count > 0 && range.base_mip < r.mips &&
           range.mip_count <= r.mips - range.base_mip && range.base_layer < r.layers() &&
           range.layer_count <= r.layers() - range.base_layer;
}

bool overlap(const rhi::Subresources& a, const rhi::Subresources& b) {
    return a.base_mip < b.base_mip + b.mip_count && b.base_mip < a.base_mip + a.mip_count &&
           a.base_layer < b.base_layer + b.layer_count && b.base_layer < a.base_layer + a.layer_count;
}

rhi::Extent extent_of_mip(const GraphResource& r, uint32_t level) {
    rhi::Extent e = mip_size(r.size, level);
    if (r.dimension != rhi::Dimension::D3) e.depth = r.size.depth;
    return e;
}

uint32_t round_up(uint32_t n, uint32_t to) { return (n + to - 1) / to * to; }

// A C++ struct may be rounded up to its alignment where the shader's block ends with its last member.
bool size_fits(size_t params, uint32_t block) { return params >= block && params <= round_up(block, 16); }

std::string_view name(rhi::Dimension d) {
    constexpr std::string_view names[] = {"1D", "2D", "2D array", "3D"};
    return names[size_t(d)];
}

}  // namespace

Graph::Graph() : own_reflections_(std::make_unique<Reflections>()), reflections_(own_reflections_.get()) {}

Graph::Graph(Runner& runner)
    : runner_(&runner), begun_after_(runner.stats().frames), reflections_(&runner.reflections()) {}

Graph::~Graph() = default;

void Graph::error(std::string sentence) { errors_.push_back(std::move(sentence)); }

void Graph::emit(rhi::CommandEncoder& encoder, std::span<const rhi::Barrier> barriers) {
    encoder.barrier({}, barriers);
}

// ---- resources

uint32_t Graph::add_resource(GraphResource resource) {
    resources_.push_back(std::move(resource));
    return uint32_t(resources_.size() - 1);
}

Image Graph::image_of(uint32_t id) const {
    const GraphResource& r = resources_[id];
    return {id, r.version, r.size, r.format, r.dimension, r.mips};
}

Buffer Graph::buffer_of(uint32_t id) const { return {id, resources_[id].version, resources_[id].bytes}; }

Image Graph::create(std::string_view name, const ImageDesc& desc) {
    if (desc.size.width == 0 || desc.size.height == 0 || desc.size.depth == 0 || desc.mips == 0 ||
        desc.format == rhi::Format::Undefined)
        error(formatted("create '{}': a size, the number of mips or the format is zero", name));
    GraphResource r{.name = std::string(name), .is_image = true};
    r.size = desc.size;
    r.format = desc.format;
    r.dimension = desc.dimension;
    r.mips = std::max(1u, desc.mips);
    return image_of(add_resource(std::move(r)));
}

Buffer Graph::create_buffer(std::string_view name, uint64_t bytes) {
    if (bytes == 0) error(formatted("create '{}': a buffer of 0 bytes", name));
    GraphResource r{.name = std::string(name)};
    r.bytes = (bytes + 3) & ~uint64_t{3};
    return buffer_of(add_resource(std::move(r)));
}

Image Graph::import(std::string_view name, rhi::TextureHandle texture, Access current) {
    KILN_ASSERT(runner_, "import '{}': a graph without a runner needs the description", name);
    const rhi::TextureDesc d = runner_->device().desc(texture);
    return import(name, texture, {.size = d.size, .format = d.format, .dimension = d.dimension, .mips = d.mips},
                  current);
}

Buffer Graph::import(std::string_view name, rhi::BufferHandle buffer, Access current) {
    KILN_ASSERT(runner_, "import '{}': a graph without a runner needs the size", name);
    return import(name, buffer, runner_->device().desc(buffer).size, current);
}

Image Graph::import(std::string_view name, rhi::TextureHandle texture, const ImageDesc& desc, Access current) {
    for (uint32_t i = 0; i < resources_.size(); ++i)
        if (texture && resources_[i].texture == texture) return image_of(i);
    const Image image = create(name, desc);
    GraphResource& r = resources_[image.id];
    r.origin = GraphResource::Origin::Imported;
    r.texture = texture;
    if (runner_) r.entry = runner_->left_in(texture);
    if (r.entry.size() != r.subresources()) r.entry.assign(r.subresources(), current);
    return image;
}

Buffer Graph::import(std::string_view name, rhi::BufferHandle buffer, uint64_t bytes, Access current) {
    for (uint32_t i = 0; i < resources_.size(); ++i)
        if (buffer && resources_[i].buffer == buffer) return buffer_of(i);
    const Buffer out = create_buffer(name, bytes);
    GraphResource& r = resources_[out.id];
    r.origin = GraphResource::Origin::Imported;
    r.buffer = buffer;
    if (runner_) r.entry = runner_->left_in(buffer);
    if (r.entry.empty()) r.entry.assign(1, current);
    return out;
}

ImageHistory Graph::history(std::string_view name, const ImageDesc& desc) {
    ImageHistory h{create(std::string(name) + " (previous)", desc), create(std::string(name) + " (current)", desc),
                   false};
    for (const uint32_t id : {h.previous.id, h.current.id}) {
        resources_[id].origin = GraphResource::Origin::History;
        resources_[id].history = std::string(name);
    }
    resources_[h.current.id].history_current = true;
    if (runner_)
        h.valid = runner_->history_left_in(std::string(name), resources_[h.current.id], resources_[h.previous.id].entry,
                                           resources_[h.current.id].entry);
    if (!h.valid) clear(h.previous);
    return h;
}

BufferHistory Graph::history_buffer(std::string_view name, uint64_t bytes) {
    BufferHistory h{create_buffer(std::string(name) + " (previous)", bytes),
                    create_buffer(std::string(name) + " (current)", bytes), false};
    for (const uint32_t id : {h.previous.id, h.current.id}) {
        resources_[id].origin = GraphResource::Origin::History;
        resources_[id].history = std::string(name);
    }
    resources_[h.current.id].history_current = true;
    if (runner_)
        h.valid = runner_->history_left_in(std::string(name), resources_[h.current.id], resources_[h.previous.id].entry,
                                           resources_[h.current.id].entry);
    if (!h.valid) clear(h.previous);
    return h;
}

Buffer Graph::upload(std::string_view name, std::span<const std::byte> bytes) {
    // Kernels bind it even when the list is empty.
    const Buffer out = create_buffer(name, std::max<size_t>(bytes.size(), 16));
    GraphResource& r = resources_[out.id];
    r.origin = GraphResource::Origin::Upload;
    r.data.assign(bytes.begin(), bytes.end());
    r.data.resize(size_t(r.bytes));
    return out;
}

Block Graph::block_bytes(std::span<const std::byte> bytes) {
    const Block block{uint32_t(blocks_.size()), uint32_t(bytes.size())};
    blocks_.insert(blocks_.end(), bytes.begin(), bytes.end());
    blocks_.resize(round_up(uint32_t(blocks_.size()), rhi::kBindingAlignment));
    return block;
}

// ---- uses

template <typename T>
bool Graph::known(const T& handle, bool is_image, const char* verb) {
    if (handle.id < resources_.size() && resources_[handle.id].is_image == is_image) return true;
    error(formatted("{}: not {} of this graph", verb, is_image ? "an image" : "a buffer"));
    return false;
}

bool Graph::current(const Image& image, const char* verb) {
    if (!known(image, true, verb)) return false;
    const GraphResource& r = resources_[image.id];
    if (image.version == r.version) return true;
    error(
        formatted("{} '{}': stale version {}, a pass has made it version {}", verb, r.name, image.version, r.version));
    return false;
}

bool Graph::current(const Buffer& buffer, const char* verb) {
    if (!known(buffer, false, verb)) return false;
    const GraphResource& r = resources_[buffer.id];
    if (buffer.version == r.version) return true;
    error(
        formatted("{} '{}': stale version {}, a pass has made it version {}", verb, r.name, buffer.version, r.version));
    return false;
}

bool Graph::bump(Image& image, const char* verb) {
    if (!current(image, verb)) return false;
    image.version = ++resources_[image.id].version;
    return true;
}

bool Graph::bump(Buffer& buffer, const char* verb) {
    if (!current(buffer, verb)) return false;
    buffer.version = ++resources_[buffer.id].version;
    return true;
}

Use Graph::read(const Image& image, rhi::Subresources range) {
    current(image, "read");
    return {.kind = Use::Kind::Read, .is_image = true, .resource = image.id, .range = range};
}

Use Graph::read(const Buffer& buffer, uint64_t offset, uint64_t size) {
    current(buffer, "read");
    return {.kind = Use::Kind::Read, .resource = buffer.id, .offset = offset, .size = size};
}

Use Graph::sampled(const Image& image, const rhi::SamplerDesc& sampler, rhi::Subresources range) {
    Use use = read(image, range);
    use.has_sampler = true;
    use.sampler = sampler;
    return use;
}

Use Graph::sampler(const rhi::SamplerDesc& sampler) { return {.kind = Use::Kind::Sampler, .sampler = sampler}; }

Use Graph::write(Image& image, rhi::Subresources range) {
    bump(image, "write");
    return {.kind = Use::Kind::Write, .is_image = true, .resource = image.id, .range = range};
}

Use Graph::write(Buffer& buffer, uint64_t offset, uint64_t size) {
    bump(buffer, "write");
    return {.kind = Use::Kind::Write, .resource = buffer.id, .offset = offset, .size = size};
}

Use Graph::read_write(Image& image, rhi::Subresources range) {
    Use use = write(image, range);
    use.kind = Use::Kind::ReadWrite;
    return use;
}

Use Graph::read_write(Buffer& buffer, uint64_t offset, uint64_t size) {
    Use use = write(buffer, offset, size);
    use.kind = Use::Kind::ReadWrite;
    return use;
}

Use Graph::uniform(Block block) { return {.kind = Use::Kind::Block, .block = block}; }

// ---- binding

bool Graph::touch(GraphPass& pass, uint32_t resource, rhi::Subresources range, Access access, bool reads_old,
                  bool overwrites) {
    const GraphResource& r = resources_[resource];
    range = resolved(r, range);
    if (!inside(r, range)) {
        error(formatted("pass '{}': '{}' has {} mips and {} layers; asked for mip {}+{}, layer {}+{}", pass.name,
                        r.name, r.mips, r.layers(), range.base_mip, range.mip_count, range.base_layer,
                        range.layer_count));
        return false;
    }
    for (const GraphAccess& other : pass.accesses) {
        if (other.resource != resource || !overlap(other.range, range)) continue;
        if (!rhi::writes(access) && !rhi::writes(other.access)) continue;
        error(formatted("pass '{}': '{}' is used as {} and as {} at once", pass.name, r.name, rhi::name(other.access),
                        rhi::name(access)));
        return false;
    }
    pass.accesses.push_back({resource, range, access, reads_old, overwrites});
    return true;
}

bool Graph::bind_one(GraphPass& pass, const rhi::ReflectedBinding& b, const Use& use, std::vector<BoundUse>& bindings,
                     bool graphics) {
    const auto wrong = [&](std::string_view what) {
        error(formatted("pass '{}', binding {}.{} '{}' ({}): {}", pass.name, b.set, b.binding, b.name,
                        rhi::name(b.kind), what));
        return false;
    };
    if (b.array_count != 1) return wrong("arrays of bindings can't be bound by a list");
    BoundUse bound{b.set, b.binding, use, b.dimension, false};
    const bool buffer_kind = b.kind == BindingKind::UniformBuffer || b.kind == BindingKind::StorageBuffer ||
                             b.kind == BindingKind::StorageBufferReadOnly || b.kind == BindingKind::BoxTree;

    if (b.kind == BindingKind::Sampler) {
        if (use.kind != Use::Kind::Sampler)
            return wrong("the list has something else here; give g.sampler() or g.sampled()");
        bindings.push_back(bound);
        return true;
    }
    if (use.kind == Use::Kind::Sampler) return wrong("the list has a sampler here");
    if (use.kind == Use::Kind::Block) {
        if (b.kind != BindingKind::UniformBuffer) return wrong("the list has a uniform block here");
        if (!size_fits(use.block.size, b.block_size))
            return wrong(formatted("block of {} B, the shader declares {} B", use.block.size, b.block_size));
        bindings.push_back(bound);
        return true;
    }
    if (use.resource >= resources_.size()) return false;  // reported when it was made
    const GraphResource& r = resources_[use.resource];
    if (use.is_image == buffer_kind)
        return wrong(formatted("the list has {} '{}' here", use.is_image ? "image" : "buffer", r.name));

    Access access = Access::Undefined;
    if (buffer_kind) {
        if (use.offset % rhi::kBindingAlignment != 0 || use.offset >= r.bytes ||
            (use.size != rhi::kWholeSize && use.size > r.bytes - use.offset))
            return wrong(formatted("'{}' of {} B: offset {} must be a multiple of 256 inside it, and its size too",
                                   r.name, r.bytes, use.offset));
        if (r.bytes - use.offset < b.block_size)
            return wrong(
                formatted("'{}' has {} B here, the shader declares {} B", r.name, r.bytes - use.offset, b.block_size));
    }
    switch (b.kind) {
    case BindingKind::UniformBuffer:
        if (use.kind != Use::Kind::Read) return wrong("can only be read");
        bound.use.uniform = true;
        access = Access::UniformRead;
        break;
    case BindingKind::StorageBufferReadOnly:
    case BindingKind::StorageTextureReadOnly:
        if (use.kind != Use::Kind::Read) return wrong("the shader only reads it: use read()");
        access = graphics ? Access::StorageReadGraphics : Access::StorageReadCompute;
        break;
    case BindingKind::StorageBuffer:
    case BindingKind::StorageTexture:
        if (use.kind == Use::Kind::Read)
            return wrong("the shader may write it: declare it readonly or use read_write()");
        if (use.kind == Use::Kind::Write && !b.write_only)
            return wrong("the shader may read it: declare it writeonly or use read_write()");
        access = graphics ? Access::StorageWriteGraphics : Access::StorageWriteCompute;
        break;
    case BindingKind::SampledTexture:
        if (use.kind != Use::Kind::Read) return wrong("the shader only reads it: use read() or sampled()");
        access = graphics ? Access::SampledReadGraphics : Access::SampledReadCompute;
        break;
    case BindingKind::BoxTree:
        if (use.kind != Use::Kind::Read) return wrong("the shader only reads it: use read()");
        access = Access::BoxTreeRead;
        break;
    case BindingKind::Sampler:
        break;
    }
    if (use.is_image) {
        const rhi::Subresources range = resolved(r, use.range);
        const bool one_layer = r.dimension == rhi::Dimension::D2Array && range.layer_count == 1;
        if (b.dimension != r.dimension && !(one_layer && b.dimension == rhi::Dimension::D2))
            return wrong(formatted("'{}' is {}, the shader declares {}", r.name, name(r.dimension), name(b.dimension)));
        if (b.kind == BindingKind::SampledTexture) {
            const rhi::SampleType type = rhi::info(r.format).sample_type;
            const bool as_float = b.sample_type == rhi::SampleType::Float && type == rhi::SampleType::Depth;
            if (type != b.sample_type && !as_float)
                return wrong(formatted("'{}' is {}: another kind of texel than the shader declares", r.name,
                                       rhi::name(r.format)));
        } else {
            if (range.mip_count != 1)
                return wrong(formatted("'{}' has {} mips: give one, mip(n)", r.name, range.mip_count));
            if (b.format != r.format)
                return wrong(
                    formatted("'{}' is {}, the shader declares {}", r.name, rhi::name(r.format), rhi::name(b.format)));
        }
        bound.use.range = range;
    }
    if (!touch(pass, use.resource, use.range, access, use.kind != Use::Kind::Write, false)) return false;
    bindings.push_back(bound);
    return true;
}

bool Graph::bind(GraphPass& pass, const rhi::Reflection& reflection, const Uses& uses,
                 std::span<const std::byte> params, std::vector<BoundUse>& bindings, std::vector<std::byte>& push,
                 bool graphics) {
    bool params_left = !params.empty();
    if (reflection.push_bytes > 0) {
        if (!size_fits(params.size(), reflection.push_bytes)) {
            error(formatted("pass '{}': push data of {} B, the shader declares {} B", pass.name, params.size(),
                            reflection.push_bytes));
            return false;
        }
        push.assign(params.begin(), params.begin() + reflection.push_bytes);
        params_left = false;
    }
    size_t next = 0;
    for (size_t i = 0; i < reflection.bindings.size(); ++i) {
        const rhi::ReflectedBinding& b = reflection.bindings[i];
        if (params_left && b.kind == BindingKind::UniformBuffer) {
            if (!bind_one(pass, b, uniform(block_bytes(params)), bindings, graphics)) return false;
            params_left = false;
            continue;
        }
        if (next == uses.size()) {
            error(formatted("pass '{}': nothing in the list for binding {}.{} '{}' ({})", pass.name, b.set, b.binding,
                            b.name, rhi::name(b.kind)));
            return false;
        }
        const Use& use = uses[next++];
        if (!bind_one(pass, b, use, bindings, graphics)) return false;
        if (!use.has_sampler) continue;
        const bool sampler_follows = b.kind == BindingKind::SampledTexture && i + 1 < reflection.bindings.size() &&
                                     reflection.bindings[i + 1].kind == BindingKind::Sampler;
        if (!sampler_follows) {
            error(formatted("pass '{}': sampled() for binding {}.{} '{}', which no sampler binding follows; use read()",
                            pass.name, b.set, b.binding, b.name));
            return false;
        }
        const rhi::ReflectedBinding& s = reflection.bindings[++i];
        bindings.push_back({s.set, s.binding, sampler(use.sampler), s.dimension, true});
    }
    if (next != uses.size() || params_left) {
        error(formatted("pass '{}': {} too many for its {} bindings", pass.name,
                        params_left ? "parameters are" : formatted("{} uses are", uses.size() - next),
                        reflection.bindings.size()));
        return false;
    }
    return true;
}

void Graph::add(GraphPass pass) { passes_.push_back(std::move(pass)); }

// ---- passes

void Graph::dispatch_bytes(const Kernel& kernel, Work work, const Buffer* indirect, uint64_t indirect_offset,
                           const Uses& uses, std::span<const std::byte> params) {
    std::string wrong;
    const rhi::Reflection* reflection = reflections_->of(kernel, wrong);
    if (!reflection) return error(wrong);
    GraphPass pass{.name = std::string(kernel.name)};
    DispatchCommand command{.kernel = &kernel};
    if (!bind(pass, *reflection, uses, params, command.bindings, command.push, false)) return;
    if (indirect) {
        if (!current(*indirect, "dispatch_indirect")) return;
        if (indirect_offset % 4 != 0 || indirect_offset + 12 > indirect->size)
            return error(formatted("pass '{}': group counts at byte {} of '{}', which has {}", pass.name,
                                   indirect_offset, resources_[indirect->id].name, indirect->size));
        if (!touch(pass, indirect->id, kAll, Access::IndirectRead, true, false)) return;
        command.indirect = indirect->id;
        command.indirect_offset = indirect_offset;
    } else {
        const std::array size{work.extent.width, work.extent.height, work.extent.depth};
        for (size_t axis = 0; axis < 3; ++axis) {
            const uint32_t per_group = work.in_groups ? 1 : reflection->workgroup[axis];
            command.groups[axis] = size[axis] / per_group + (size[axis] % per_group != 0);
            if (command.groups[axis] > rhi::kMaxGroupsPerDispatch)
                return error(formatted("pass '{}': {} workgroups along axis {}; there may be {}", pass.name,
                                       command.groups[axis], axis, rhi::kMaxGroupsPerDispatch));
        }
    }
    pass.command = std::move(command);
    add(std::move(pass));
}

void Graph::draw_bytes(const RasterKernel& kernel, Targets targets, const Uses& uses, std::span<const std::byte> params,
                       std::span<const DrawCall> draws) {
    std::string wrong;
    const rhi::Reflection* reflection = reflections_->of(kernel, wrong);
    if (!reflection) return error(wrong);
    GraphPass pass{.name = std::string(kernel.name)};
    DrawCommand command{.kernel = &kernel};
    if (!bind(pass, *reflection, uses, params, command.bindings, command.push, true)) return;

    if (targets.colors.size() != kernel.colors.size())
        return error(formatted("pass '{}': {} colour targets, the kernel has {}", pass.name, targets.colors.size(),
                               kernel.colors.size()));
    for (size_t i = 0; i < targets.colors.size(); ++i) {
        const ColorUse& c = targets.colors[i];
        if (!c.image || !bump(*c.image, "draw"))
            return error(formatted("pass '{}': colour target {} is not usable", pass.name, i));
        if (c.image->format != kernel.colors[i].format)
            return error(formatted("pass '{}': colour target {} is {}, the kernel draws {}", pass.name, i,
                                   rhi::name(c.image->format), rhi::name(kernel.colors[i].format)));
        const bool loads = c.load == rhi::Load::Load;
        if (!touch(pass, c.image->id, c.range, Access::ColorWrite, loads, !loads)) return;
        command.color_ids.push_back(c.image->id);
    }
    if (DepthUse& d = targets.depth; d.image) {
        if (d.image->format != kernel.depth.format || (d.read_only && kernel.depth.write))
            return error(formatted("pass '{}': the kernel {} depth of {}, the target is {}{}", pass.name,
                                   kernel.depth.write ? "writes" : "tests", rhi::name(kernel.depth.format),
                                   rhi::name(d.image->format), d.read_only ? ", read only" : ""));
        if (d.read_only ? !current(*d.image, "draw") : !bump(*d.image, "draw")) return;
        const bool loads = d.load == rhi::Load::Load || d.read_only;
        if (!touch(pass, d.image->id, d.range, d.read_only ? Access::DepthRead : Access::DepthWrite, loads, !loads))
            return;
        command.depth_id = d.image->id;
    }
    for (const DrawCall& d : draws) {
        const auto reads = [&](const Buffer& buffer, Access access) {
            return !buffer || (current(buffer, "draw") && touch(pass, buffer.id, kAll, access, true, false));
        };
        if (!reads(d.vertex_buffer, Access::VertexRead) || !reads(d.index_buffer, Access::IndexRead) ||
            !reads(d.indirect_buffer, Access::IndirectRead))
            return;
        command.draws.push_back(d);
    }
    for (ColorUse& c : targets.colors) c.image = nullptr;
    targets.depth.image = nullptr;
    command.targets = std::move(targets);
    pass.command = std::move(command);
    add(std::move(pass));
}

void Graph::trace(const TraceKernel& kernel, rhi::Extent size, const Uses& uses) {
    std::string wrong;
    const rhi::Reflection* reflection = reflections_->of(kernel, wrong);
    if (!reflection) return error(wrong);
    GraphPass pass{.name = std::string(kernel.name)};
    TraceCommand command{.kernel = &kernel, .width = size.width, .height = size.height};
    if (uint64_t{size.width} * size.height > rhi::kMaxRays)
        return error(
            formatted("pass '{}': {}x{} rays; there may be {}", pass.name, size.width, size.height, rhi::kMaxRays));
    if (!bind(pass, *reflection, uses, {}, command.bindings, command.push, false)) return;
    pass.command = std::move(command);
    add(std::move(pass));
}

void Graph::build_boxes(const Buffer& boxes, Buffer& tree, uint32_t count) {
    if (!current(boxes, "build from") || !bump(tree, "build")) return;
    const GraphResource &from = resources_[boxes.id], &to = resources_[tree.id];
    GraphPass pass{.name = formatted("build {}", to.name)};
    if (count == 0 || count > from.bytes / sizeof(rhi::Box))
        return error(formatted("pass '{}': {} boxes of '{}', which has room for {}", pass.name, count, from.name,
                               from.bytes / sizeof(rhi::Box)));
    if (to.origin != GraphResource::Origin::Imported)
        return error(formatted("pass '{}': a box tree is imported, in memory of its own", pass.name));
    if (!touch(pass, boxes.id, kAll, Access::BoxesRead, true, false) ||
        !touch(pass, tree.id, kAll, Access::BoxTreeWrite, false, true))
        return;
    pass.command = BuildCommand{.boxes = boxes.id, .tree = tree.id, .count = count};
    add(std::move(pass));
}

bool Graph::touch_regions(GraphPass& pass, uint32_t image, std::span<const CopyRegion> regions, bool source,
                          Access access) {
    const GraphResource& r = resources_[image];
    std::vector<bool> touched(r.subresources()), whole(r.subresources());
    for (const CopyRegion& region : regions) {
        const uint32_t level = source ? region.src_mip : region.mip;
        const rhi::Origin origin = source ? region.src_origin : region.origin;
        const bool array = r.dimension == rhi::Dimension::D2Array;
        const rhi::Extent e = level < r.mips ? extent_of_mip(r, level) : rhi::Extent{0, 0, 0};
        if (uint64_t{origin.x} + region.size.width > e.width || uint64_t{origin.y} + region.size.height > e.height ||
            uint64_t{origin.z} + region.size.depth > e.depth || region.size.width == 0 || region.size.height == 0 ||
            region.size.depth == 0) {
            error(formatted("pass '{}': region {}x{}x{} at {},{},{} of mip {} is empty or outside '{}'", pass.name,
                            region.size.width, region.size.height, region.size.depth, origin.x, origin.y, origin.z,
                            level, r.name));
            return false;
        }
        const uint32_t first = array ? origin.z : 0, count = array ? region.size.depth : 1;
        for (uint32_t l = first; l < first + count; ++l) {
            const size_t s = level + size_t{l} * r.mips;
            touched[s] = true;
            whole[s] = whole[s] || (region.size.width == e.width && region.size.height == e.height &&
                                    (array || region.size.depth == e.depth));
        }
    }
    const bool writes = rhi::writes(access);
    for (uint32_t l = 0; l < r.layers(); ++l) {
        for (uint32_t m = 0; m < r.mips; ++m) {
            const size_t s = m + size_t{l} * r.mips;
            if (touched[s] && !touch(pass, image, {m, 1, l, 1}, access, !writes, writes && whole[s])) return false;
        }
    }
    return true;
}

bool Graph::check_buffer_side(const GraphPass& pass, const GraphResource& image, const GraphResource& buffer,
                              std::span<const CopyRegion> regions) {
    for (const CopyRegion& region : regions) {
        const uint64_t tight = uint64_t{region.size.width} * rhi::bytes_per_texel(image.format);
        const uint64_t row = region.bytes_per_row ? region.bytes_per_row : tight;
        const uint64_t rows = region.rows_per_layer ? region.rows_per_layer : region.size.height;
        const uint64_t end =
            region.buffer_offset + row * (rows * (region.size.depth - 1) + region.size.height - 1) + tight;
        if (row >= tight && rows >= region.size.height && end <= buffer.bytes) continue;
        error(formatted("pass '{}': region ends at byte {} of '{}' ({} B), with rows of {} B for {} B", pass.name, end,
                        buffer.name, buffer.bytes, row, tight));
        return false;
    }
    return true;
}

void Graph::copy(const Buffer& src, Image& dst, std::span<const CopyRegion> regions) {
    if (!current(src, "copy from") || !bump(dst, "copy to") || regions.empty()) return;
    GraphPass pass{.name = formatted("copy {} to {}", resources_[src.id].name, resources_[dst.id].name)};
    if (!touch(pass, src.id, kAll, Access::CopyRead, true, false) ||
        !touch_regions(pass, dst.id, regions, false, Access::CopyWrite) ||
        !check_buffer_side(pass, resources_[dst.id], resources_[src.id], regions))
        return;
    pass.command = CopyCommand{.src = src.id, .dst = dst.id, .regions = {regions.begin(), regions.end()}};
    add(std::move(pass));
}

void Graph::copy(const Image& src, Buffer& dst, std::span<const CopyRegion> regions) {
    if (!current(src, "copy from") || !bump(dst, "copy to") || regions.empty()) return;
    GraphPass pass{.name = formatted("copy {} to {}", resources_[src.id].name, resources_[dst.id].name)};
    // The image side of these regions is mip and origin, not src_…: there is one image only.
    if (!touch_regions(pass, src.id, regions, false, Access::CopyRead) ||
        !touch(pass, dst.id, kAll, Access::CopyWrite, false, false) ||
        !check_buffer_side(pass, resources_[src.id], resources_[dst.id], regions))
        return;
    pass.command = CopyCommand{.src = src.id, .dst = dst.id, .regions = {regions.begin(), regions.end()}};
    add(std::move(pass));
}

void Graph::copy(const Image& src, Image& dst, std::span<const CopyRegion> regions) {
    if (!current(src, "copy from") || !bump(dst, "copy to") || regions.empty()) return;
    const GraphResource &a = resources_[src.id], &b = resources_[dst.id];
    GraphPass pass{.name = formatted("copy {} to {}", a.name, b.name)};
    if (rhi::bytes_per_texel(a.format) != rhi::bytes_per_texel(b.format) ||
        rhi::is_depth(a.format) != rhi::is_depth(b.format))
        return error(
            formatted("pass '{}': {} does not copy to {}", pass.name, rhi::name(a.format), rhi::name(b.format)));
    if (!touch_regions(pass, src.id, regions, true, Access::CopyRead) ||
        !touch_regions(pass, dst.id, regions, false, Access::CopyWrite))
        return;
    pass.command = CopyCommand{.src = src.id, .dst = dst.id, .regions = {regions.begin(), regions.end()}};
    add(std::move(pass));
}

void Graph::copy(const Buffer& src, uint64_t src_offset, Buffer& dst, uint64_t dst_offset, uint64_t size) {
    if (!current(src, "copy from") || !bump(dst, "copy to") || size == 0) return;
    const GraphResource &a = resources_[src.id], &b = resources_[dst.id];
    GraphPass pass{.name = formatted("copy {} to {}", a.name, b.name)};
    if (src_offset > a.bytes || size > a.bytes - src_offset || dst_offset > b.bytes || size > b.bytes - dst_offset ||
        (size | src_offset | dst_offset) % 4 != 0)
        return error(formatted("pass '{}': {} B from byte {} of {} to byte {} of {}: outside, or not in words",
                               pass.name, size, src_offset, a.bytes, dst_offset, b.bytes));
    if (!touch(pass, src.id, kAll, Access::CopyRead, true, false) ||
        !touch(pass, dst.id, kAll, Access::CopyWrite, false, size == b.bytes))
        return;
    pass.command =
        CopyCommand{.src = src.id, .dst = dst.id, .src_offset = src_offset, .dst_offset = dst_offset, .size = size};
    add(std::move(pass));
}

void Graph::clear(Image& image, std::array<float, 4> value, rhi::Subresources range) {
    if (!bump(image, "clear")) return;
    GraphPass pass{.name = formatted("clear {}", resources_[image.id].name)};
    if (!touch(pass, image.id, range, Access::CopyWrite, false, true)) return;
    pass.command = ClearCommand{.resource = image.id, .value = value, .range = pass.accesses[0].range};
    add(std::move(pass));
}

void Graph::clear(Buffer& buffer, uint32_t word, uint64_t offset, uint64_t size) {
    if (!bump(buffer, "clear")) return;
    const GraphResource& r = resources_[buffer.id];
    GraphPass pass{.name = formatted("clear {}", r.name)};
    if (offset > r.bytes || offset % 4 != 0)
        return error(formatted("pass '{}': byte {} of {}", pass.name, offset, r.bytes));
    if (size == rhi::kWholeSize) size = r.bytes - offset;
    if (size == 0) return;
    if (size > r.bytes - offset || size % 4 != 0)
        return error(
            formatted("pass '{}': {} B at byte {} of {}: outside, or not in words", pass.name, size, offset, r.bytes));
    if (!touch(pass, buffer.id, kAll, Access::CopyWrite, false, size == r.bytes)) return;
    pass.command = ClearCommand{.resource = buffer.id, .word = word, .offset = offset, .size = size};
    add(std::move(pass));
}

// ---- what must come out

void Graph::output(const Image& image, Access leave) {
    if (!current(image, "output")) return;
    resources_[image.id].output = true;
    resources_[image.id].leave = leave;
}

void Graph::output(const Buffer& buffer, Access leave) {
    if (!current(buffer, "output")) return;
    resources_[buffer.id].output = true;
    resources_[buffer.id].leave = leave;
}

Readback Graph::readback(const Image& image, uint32_t level, uint32_t layer_index) {
    Readback out;
    out.state_ = std::make_shared<ReadbackState>();
    if (!current(image, "readback")) return out;
    const GraphResource r = resources_[image.id];
    if (level >= r.mips || layer_index >= r.layers()) {
        error(formatted("readback '{}': mip {} and layer {} of {} and {}", r.name, level, layer_index, r.mips,
                        r.layers()));
        return out;
    }
    rhi::Extent size = extent_of_mip(r, level);
    if (r.dimension == rhi::Dimension::D2Array) size.depth = 1;
    ReadbackState& state = *out.state_;
    state.row_bytes = size.width * rhi::bytes_per_texel(r.format);
    state.row_pitch = round_up(state.row_bytes, kCopyRowAlignment);
    state.row_count = size.height * size.depth;
    state.buffer_bytes = uint64_t{state.row_pitch} * state.row_count;
    state.name = r.name;
    Buffer buffer = create_buffer("read-back of " + r.name, state.buffer_bytes);
    resources_[buffer.id].origin = GraphResource::Origin::Readback;
    resources_[buffer.id].readback = out.state_;
    resources_[buffer.id].leave = Access::HostRead;
    resources_[buffer.id].entry = {Access::HostRead};  // it may have carried an earlier one
    CopyRegion region{.bytes_per_row = state.row_pitch, .rows_per_layer = size.height, .mip = level, .size = size};
    region.origin.z = layer_index;
    copy(image, buffer, {&region, 1});
    return out;
}

Readback Graph::readback(const Buffer& source, uint64_t offset, uint64_t size) {
    Readback out;
    out.state_ = std::make_shared<ReadbackState>();
    if (!current(source, "readback")) return out;
    const GraphResource r = resources_[source.id];
    if (size == rhi::kWholeSize && offset <= r.bytes) size = r.bytes - offset;
    if (size == 0) {
        error(formatted("readback '{}': nothing of {} B from byte {}", r.name, r.bytes, offset));
        return out;
    }
    out.state_->buffer_bytes = size;
    out.state_->name = r.name;
    Buffer buffer = create_buffer("read-back of " + r.name, size);
    resources_[buffer.id].origin = GraphResource::Origin::Readback;
    resources_[buffer.id].readback = out.state_;
    resources_[buffer.id].leave = Access::HostRead;
    resources_[buffer.id].entry = {Access::HostRead};  // it may have carried an earlier one
    copy(source, offset, buffer, 0, size);
    return out;
}

}  // namespace kiln::render
