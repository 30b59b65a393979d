// SPDX-License-Identifier: MIT
// What the validation remembers of every object.
#pragma once

#include "rhi/device.h"

#include <deque>
#include <optional>

namespace kiln::rhi::validate {

struct HeapInfo {
    static constexpr std::string_view kKind = "heap";
    std::string label;
    uint64_t size = 0;
};

struct BufferInfo {
    static constexpr std::string_view kKind = "buffer";
    std::string label;
    BufferDesc desc;
    MemoryNeed need;  // of placed ones
    bool mapped = false;
    SubmitId last_use = 0;
    bool built = false;  // of usage BoxTree: there is a tree in it
};

struct TextureInfo {
    static constexpr std::string_view kKind = "texture";
    std::string label;
    TextureDesc desc;
    MemoryNeed need;
    ViewHandle whole;
    bool shown = false;  // a surface's own
};

struct ViewInfo {
    static constexpr std::string_view kKind = "view";
    std::string label;
    ViewDesc desc;  // counts resolved
    bool whole = false;
};

struct SamplerInfo {
    static constexpr std::string_view kKind = "sampler";
    std::string label;
};

struct ShaderInfo {
    static constexpr std::string_view kKind = "shader module";
    std::string label;
    Reflection reflection;
};

struct GroupLayoutInfo {
    static constexpr std::string_view kKind = "bind group layout";
    std::string label;
    std::vector<BindGroupLayoutEntry> entries;  // by binding
    bool owned = false;                         // by pipelines
};

struct BoundResource {
    BindGroupLayoutEntry slot;
    BufferHandle buffer;
    uint64_t offset = 0;
    uint64_t size = 0;
    TextureHandle texture;
    ViewHandle view;
    Subresources range;
    SamplerHandle sampler;
};

struct GroupInfo {
    static constexpr std::string_view kKind = "bind group";
    std::string label;
    std::vector<BindGroupLayoutEntry> entries;
    std::vector<BoundResource> resources;  // in the order of entries
};

struct LayoutInfo {
    static constexpr std::string_view kKind = "pipeline layout";
    std::string label;
    std::vector<std::vector<BindGroupLayoutEntry>> groups;
    uint32_t push_bytes = 0;
};

struct PipelineInfo {
    std::string label;
    std::vector<std::vector<BindGroupLayoutEntry>> groups;
    uint32_t push_bytes = 0;
    struct Block {
        uint32_t set, binding, bytes;
        std::string name;
    };
    std::vector<Block> blocks;  // least sizes of the buffers bound
};

struct ComputeInfo : PipelineInfo {
    static constexpr std::string_view kKind = "compute pipeline";
};

struct RenderInfo : PipelineInfo {
    static constexpr std::string_view kKind = "render pipeline";
    std::vector<Format> colors;
    Format depth = Format::Undefined;
    bool depth_write = false;
    uint32_t vertex_buffers = 0;
    bool mesh = false;
};

struct TraceInfo : PipelineInfo {
    static constexpr std::string_view kKind = "trace pipeline";
};

struct QueryInfo {
    static constexpr std::string_view kKind = "query set";
    std::string label;
    std::vector<bool> written;
};

struct SurfaceInfo {
    static constexpr std::string_view kKind = "surface";
    std::string label;
    bool configured = false;
    TextureHandle acquired = {};
};

// Objects by the handle that the device below gave them. Remembers the label of the last owner of every slot, so that a
// stale handle can be named.
template <typename H, typename T>
class Table {
public:
    void set(H handle, T info) {
        if (slots_.size() <= handle.index) slots_.resize(handle.index + 1);
        Slot& slot = slots_[handle.index];
        if (!slot.info) ++size_;
        slot.generation = handle.generation;
        slot.label = info.label;
        slot.info.emplace(std::move(info));
    }
    T* find(H handle) {
        if (!handle || handle.index >= slots_.size()) return nullptr;
        Slot& slot = slots_[handle.index];
        return slot.generation == handle.generation && slot.info ? &*slot.info : nullptr;
    }
    void erase(H handle) {
        if (!find(handle)) return;
        slots_[handle.index].info.reset();
        --size_;
    }
    // "buffer 'bricks' was destroyed"
    std::string why_not(H handle) const {
        const std::string kind(T::kKind);
        if (!handle) return "no " + kind + " is given";
        if (handle.index >= slots_.size()) return "this " + kind + " handle is not of this device";
        const Slot& slot = slots_[handle.index];
        if (slot.generation == handle.generation) return kind + " '" + slot.label + "' was destroyed";
        return "a stale " + kind + " handle (its slot now holds '" + slot.label + "')";
    }
    uint32_t size() const { return size_; }
    template <typename F>
    void for_each(F&& f) {
        for (uint32_t i = 0; i < slots_.size(); ++i)
            if (slots_[i].info) f(H{i, slots_[i].generation}, *slots_[i].info);
    }

private:
    struct Slot {
        uint32_t generation = 0;
        std::string label;
        std::optional<T> info;
    };
    std::deque<Slot> slots_;
    uint32_t size_ = 0;
};

struct Objects {
    Table<HeapHandle, HeapInfo> heaps;
    Table<BufferHandle, BufferInfo> buffers;
    Table<TextureHandle, TextureInfo> textures;
    Table<ViewHandle, ViewInfo> views;
    Table<SamplerHandle, SamplerInfo> samplers;
    Table<ShaderModule, ShaderInfo> shaders;
    Table<BindGroupLayout, GroupLayoutInfo> group_layouts;
    Table<BindGroup, GroupInfo> groups;
    Table<PipelineLayout, LayoutInfo> layouts;
    Table<ComputePipeline, ComputeInfo> compute;
    Table<RenderPipeline, RenderInfo> render;
    Table<TracePipeline, TraceInfo> traces;
    Table<QuerySet, QueryInfo> queries;
    Table<SurfaceHandle, SurfaceInfo> surfaces;
};

}  // namespace kiln::rhi::validate
