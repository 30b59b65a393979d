// SPDX-License-Identifier: MIT
// Device objects that a runner keeps from frame to frame: transients placed in one heap, histories, views, samplers, bind
// groups, upload and read-back buffers, uniform memory. Whatever a frame asks for a second time is there already; what no
// frame has asked for in a while goes.
#pragma once

#include "render/graph_plan.h"

#include <array>
#include <map>
#include <unordered_map>

namespace kiln::render {

struct HistoryObjects {
    GraphResource like;
    std::array<rhi::TextureHandle, 2> textures{};
    std::array<rhi::BufferHandle, 2> buffers{};
    std::array<std::vector<rhi::Access>, 2> left{};
    size_t current = 0;  // which of the two this frame writes
    bool valid = false;  // the other one holds a frame
};

class GraphObjects {
public:
    explicit GraphObjects(rhi::Device& device) : device_(device) {}
    ~GraphObjects();
    GraphObjects(const GraphObjects&) = delete;
    GraphObjects& operator=(const GraphObjects&) = delete;

    // Everything asked for from now on counts as used in this frame. Drops what went unused.
    void begin_frame(uint64_t frame, uint32_t slot, uint32_t slots);

    rhi::MemoryNeed need(const rhi::TextureDesc& desc);
    rhi::MemoryNeed need(const rhi::BufferDesc& desc);

    // Room for transients. Growing drops every placed object.
    Result<void> reserve(uint64_t bytes);
    uint64_t heap_bytes() const { return heap_bytes_; }
    Result<rhi::TextureHandle> placed(const rhi::TextureDesc& desc, uint64_t offset);
    Result<rhi::BufferHandle> placed(const rhi::BufferDesc& desc, uint64_t offset);

    Result<rhi::ViewHandle> view(rhi::TextureHandle texture, const GraphResource& r, const rhi::Subresources& range,
                                 bool as_array);
    Result<rhi::SamplerHandle> sampler(const rhi::SamplerDesc& desc);
    Result<rhi::BindGroup> group(rhi::BindGroupLayout layout, std::span<const rhi::BindGroupEntry> entries,
                                 std::string_view label);

    // Makes the two objects of a history, or finds them. `usage`: at least this.
    Result<HistoryObjects*> history(const GraphResource& like, const PlanResource& use);
    HistoryObjects* find_history(const std::string& name);

    // This frame's uniform blocks; the offset of the first byte in the buffer.
    Result<uint64_t> blocks(std::span<const std::byte> bytes);
    rhi::BufferHandle block_buffer() const { return blocks_; }
    Result<rhi::BufferHandle> upload(const GraphResource& r, rhi::BufferUsage usage);

    Result<rhi::BufferHandle> readback(uint64_t bytes);
    void give_back(rhi::BufferHandle readback);

    void forget(rhi::TextureHandle texture);
    void forget(rhi::BufferHandle buffer);
    uint64_t made() const { return made_; }

private:
    struct Key {
        std::vector<uint64_t> words;
        friend bool operator==(const Key&, const Key&) = default;
    };
    struct KeyHash {
        size_t operator()(const Key& key) const;
    };
    template <typename H>
    struct Kept {
        H handle;
        uint64_t last_frame = 0;
    };
    struct Group {
        rhi::BindGroup handle;
        uint64_t last_frame = 0;
    };
    struct View {
        rhi::ViewHandle handle;
        rhi::TextureHandle texture;
        uint64_t last_frame = 0;
    };
    struct Upload {
        rhi::BufferHandle handle;
        uint64_t bytes = 0;
        rhi::BufferUsage usage = rhi::BufferUsage::None;
        uint32_t slot = 0;
        uint64_t last_frame = 0;  // one a frame: taken if equal to the frame
    };

    static Key key_of(const rhi::TextureDesc& desc, uint64_t offset);
    static Key key_of(const rhi::BufferDesc& desc, uint64_t offset);
    void drop_views_of(rhi::TextureHandle texture);
    void drop_groups_with(uint64_t bits, uint64_t kind);
    void destroy(HistoryObjects& h);

    rhi::Device& device_;
    uint64_t frame_ = 0;
    uint32_t slot_ = 0, slots_ = 1;
    uint64_t made_ = 0;

    rhi::HeapHandle heap_ = {};
    uint64_t heap_bytes_ = 0;
    std::unordered_map<Key, rhi::MemoryNeed, KeyHash> needs_;
    std::unordered_map<Key, Kept<rhi::TextureHandle>, KeyHash> placed_textures_;
    std::unordered_map<Key, Kept<rhi::BufferHandle>, KeyHash> placed_buffers_;
    std::unordered_map<Key, View, KeyHash> views_;
    std::unordered_map<Key, Kept<rhi::SamplerHandle>, KeyHash> samplers_;
    std::unordered_map<Key, Group, KeyHash> groups_;
    std::map<std::string, HistoryObjects> histories_;
    rhi::BufferHandle blocks_ = {};
    uint64_t blocks_per_slot_ = 0;
    std::vector<Upload> uploads_;
    std::vector<std::pair<uint64_t, rhi::BufferHandle>> free_readbacks_;  // bytes, buffer
};

}  // namespace kiln::render
