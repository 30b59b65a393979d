// SPDX-License-Identifier: MIT
#include "render/graph_objects.h"

#include "base/hash.h"

#include <algorithm>
#include <bit>

namespace kiln::render {

namespace {

constexpr uint64_t kFramesKept = 32;  // an object unused for so many frames goes
constexpr uint64_t kHeapStep = 1 << 20;

// What an entry of a bind group is bound to, for keys.
enum EntryKind : uint64_t { kBuffer, kView, kSampler };

uint64_t pair_of(uint32_t a, uint32_t b) { return uint64_t{a} << 32 | b; }

}  // namespace

size_t GraphObjects::KeyHash::operator()(const Key& key) const {
    return size_t(hash64_of(std::span<const uint64_t>(key.words)));
}

GraphObjects::Key GraphObjects::key_of(const rhi::TextureDesc& d, uint64_t offset) {
    return {{offset, pair_of(uint32_t(d.dimension), uint32_t(d.format)), pair_of(d.size.width, d.size.height),
             pair_of(d.size.depth, d.mips), uint64_t(d.usage)}};
}

GraphObjects::Key GraphObjects::key_of(const rhi::BufferDesc& d, uint64_t offset) {
    return {{offset, d.size, uint64_t(d.usage)}};
}

GraphObjects::~GraphObjects() {
    for (const auto& [key, g] : groups_) device_.destroy(g.handle);
    for (const auto& [key, v] : views_) device_.destroy(v.handle);
    groups_.clear();
    views_.clear();
    for (const auto& [key, s] : samplers_) device_.destroy(s.handle);
    for (const auto& [key, t] : placed_textures_) device_.destroy(t.handle);
    for (const auto& [key, b] : placed_buffers_) device_.destroy(b.handle);
    for (auto& [name, h] : histories_) destroy(h);
    for (const Upload& u : uploads_) device_.destroy(u.handle);
    for (const auto& [bytes, buffer] : free_readbacks_) device_.destroy(buffer);
    if (blocks_) device_.destroy(blocks_);
    if (heap_) device_.destroy(heap_);
}

void GraphObjects::begin_frame(uint64_t frame, uint32_t slot, uint32_t slots) {
    frame_ = frame;
    slot_ = slot;
    slots_ = slots;
    const auto old = [&](const auto& kept) { return kept.last_frame + kFramesKept < frame_; };
    std::erase_if(groups_, [&](const auto& entry) {
        if (!old(entry.second)) return false;
        device_.destroy(entry.second.handle);
        return true;
    });
    std::erase_if(views_, [&](const auto& entry) {
        if (!old(entry.second)) return false;
        drop_groups_with(entry.second.handle.bits(), kView);
        device_.destroy(entry.second.handle);
        return true;
    });
    std::erase_if(placed_textures_, [&](const auto& entry) {
        if (!old(entry.second)) return false;
        drop_views_of(entry.second.handle);
        device_.destroy(entry.second.handle);
        return true;
    });
    std::erase_if(placed_buffers_, [&](const auto& entry) {
        if (!old(entry.second)) return false;
        drop_groups_with(entry.second.handle.bits(), kBuffer);
        device_.destroy(entry.second.handle);
        return true;
    });
    std::erase_if(uploads_, [&](const Upload& u) {
        if (!old(u)) return false;
        drop_groups_with(u.handle.bits(), kBuffer);
        device_.destroy(u.handle);
        return true;
    });
}

// ---- transients

rhi::MemoryNeed GraphObjects::need(const rhi::TextureDesc& desc) {
    const auto [it, fresh] = needs_.try_emplace(key_of(desc, 0));
    if (fresh) it->second = device_.memory_need(desc);
    return it->second;
}

rhi::MemoryNeed GraphObjects::need(const rhi::BufferDesc& desc) {
    const auto [it, fresh] = needs_.try_emplace(key_of(desc, 0));
    if (fresh) it->second = device_.memory_need(desc);
    return it->second;
}

Result<void> GraphObjects::reserve(uint64_t bytes) {
    if (bytes <= heap_bytes_) return {};
    for (const auto& [key, t] : placed_textures_) {
        drop_views_of(t.handle);
        device_.destroy(t.handle);
    }
    placed_textures_.clear();
    for (const auto& [key, b] : placed_buffers_) {
        drop_groups_with(b.handle.bits(), kBuffer);
        device_.destroy(b.handle);
    }
    placed_buffers_.clear();
    if (heap_) device_.destroy(heap_);
    heap_ = {};
    heap_bytes_ = 0;
    const uint64_t size = (bytes + kHeapStep - 1) / kHeapStep * kHeapStep;
    const auto heap = device_.create_heap({.size = size, .label = "transients"});
    if (!heap) return heap.error();
    ++made_;
    heap_ = *heap;
    heap_bytes_ = size;
    return {};
}

Result<rhi::TextureHandle> GraphObjects::placed(const rhi::TextureDesc& desc, uint64_t offset) {
    const Key key = key_of(desc, offset);
    if (const auto it = placed_textures_.find(key); it != placed_textures_.end()) {
        it->second.last_frame = frame_;
        return it->second.handle;
    }
    rhi::TextureDesc in_heap = desc;
    in_heap.heap = heap_;
    in_heap.heap_offset = offset;
    const auto texture = device_.create_texture(in_heap);
    if (!texture) return texture.error();
    ++made_;
    placed_textures_.emplace(key, Kept<rhi::TextureHandle>{*texture, frame_});
    return *texture;
}

Result<rhi::BufferHandle> GraphObjects::placed(const rhi::BufferDesc& desc, uint64_t offset) {
    const Key key = key_of(desc, offset);
    if (const auto it = placed_buffers_.find(key); it != placed_buffers_.end()) {
        it->second.last_frame = frame_;
        return it->second.handle;
    }
    rhi::BufferDesc in_heap = desc;
    in_heap.heap = heap_;
    in_heap.heap_offset = offset;
    const auto buffer = device_.create_buffer(in_heap);
    if (!buffer) return buffer.error();
    ++made_;
    placed_buffers_.emplace(key, Kept<rhi::BufferHandle>{*buffer, frame_});
    return *buffer;
}

// ---- what is bound

Result<rhi::ViewHandle> GraphObjects::view(rhi::TextureHandle texture, const GraphResource& r,
                                           const rhi::Subresources& range, bool as_array) {
    const bool whole =
        range.base_mip == 0 && range.mip_count == r.mips && range.base_layer == 0 && range.layer_count == r.layers();
    if (whole && (r.dimension != rhi::Dimension::D2Array || as_array)) return device_.whole_view(texture);
    const Key key{{texture.bits(), pair_of(range.base_mip, range.mip_count),
                   pair_of(range.base_layer, range.layer_count), as_array}};
    if (const auto it = views_.find(key); it != views_.end()) {
        it->second.last_frame = frame_;
        return it->second.handle;
    }
    const auto made = device_.create_view({.texture = texture, .range = range, .as_array = as_array, .label = r.name});
    if (!made) return made.error();
    ++made_;
    views_.emplace(key, View{*made, texture, frame_});
    return *made;
}

Result<rhi::SamplerHandle> GraphObjects::sampler(const rhi::SamplerDesc& d) {
    const Key key{{pair_of(uint32_t(d.mag), uint32_t(d.min)), pair_of(uint32_t(d.mip), uint32_t(d.address)),
                   pair_of(std::bit_cast<uint32_t>(d.lod_min), std::bit_cast<uint32_t>(d.lod_max)),
                   uint64_t(d.compare)}};
    if (const auto it = samplers_.find(key); it != samplers_.end()) return it->second.handle;
    const auto made = device_.create_sampler(d);
    if (!made) return made.error();
    ++made_;
    samplers_.emplace(key, Kept<rhi::SamplerHandle>{*made, frame_});
    return *made;
}

Result<rhi::BindGroup> GraphObjects::group(rhi::BindGroupLayout layout, std::span<const rhi::BindGroupEntry> entries,
                                           std::string_view label) {
    Key key{{layout.bits()}};
    for (const rhi::BindGroupEntry& e : entries) {
        const uint64_t kind = e.buffer ? kBuffer : e.view ? kView : kSampler;
        key.words.push_back(pair_of(e.binding, uint32_t(kind)));
        key.words.push_back(e.buffer ? e.buffer.bits() : e.view ? e.view.bits() : e.sampler.bits());
        key.words.push_back(e.offset);
        key.words.push_back(e.size);
    }
    if (const auto it = groups_.find(key); it != groups_.end()) {
        it->second.last_frame = frame_;
        return it->second.handle;
    }
    const auto made = device_.create_bind_group({.layout = layout, .entries = entries, .label = label});
    if (!made) return made.error();
    ++made_;
    groups_.emplace(std::move(key), Group{*made, frame_});
    return *made;
}

void GraphObjects::drop_groups_with(uint64_t bits, uint64_t kind) {
    std::erase_if(groups_, [&](const auto& entry) {
        const std::vector<uint64_t>& w = entry.first.words;
        for (size_t i = 1; i < w.size(); i += 4) {
            if ((w[i] & 0xffffffffu) != kind || w[i + 1] != bits) continue;
            device_.destroy(entry.second.handle);
            return true;
        }
        return false;
    });
}

void GraphObjects::drop_views_of(rhi::TextureHandle texture) {
    if (const rhi::ViewHandle whole = device_.whole_view(texture)) drop_groups_with(whole.bits(), kView);
    std::erase_if(views_, [&](const auto& entry) {
        if (entry.second.texture != texture) return false;
        drop_groups_with(entry.second.handle.bits(), kView);
        device_.destroy(entry.second.handle);
        return true;
    });
}

void GraphObjects::forget(rhi::TextureHandle texture) { drop_views_of(texture); }

void GraphObjects::forget(rhi::BufferHandle buffer) { drop_groups_with(buffer.bits(), kBuffer); }

// ---- histories

void GraphObjects::destroy(HistoryObjects& h) {
    for (const rhi::TextureHandle t : h.textures) {
        if (!t) continue;
        drop_views_of(t);
        device_.destroy(t);
    }
    for (const rhi::BufferHandle b : h.buffers) {
        if (!b) continue;
        drop_groups_with(b.bits(), kBuffer);
        device_.destroy(b);
    }
}

HistoryObjects* GraphObjects::find_history(const std::string& name) {
    const auto it = histories_.find(name);
    return it == histories_.end() ? nullptr : &it->second;
}

Result<HistoryObjects*> GraphObjects::history(const GraphResource& like, const PlanResource& use) {
    HistoryObjects* found = find_history(like.history);
    if (found && same_shape(found->like, like)) return found;
    if (found) destroy(*found);
    HistoryObjects made;
    made.like = like;
    for (size_t i = 0; i < 2; ++i) {
        if (like.is_image) {
            // Enough for both roles in every frame.
            using U = rhi::TextureUsage;
            U usage = U::Sampled | U::CopySrc | U::CopyDst | use.texture_usage;
            if (rhi::is_depth(like.format)) {
                usage |= U::Depth;
            } else if (rhi::info(like.format).core_storage || device_.caps().storage_r16f) {
                usage |= U::Storage;
            }
            if (like.format == rhi::Format::Rgba8Unorm || like.format == rhi::Format::Rgba16Float) usage |= U::Color;
            const auto texture = device_.create_texture(texture_desc(like, usage));
            if (!texture) return texture.error();
            made.textures[i] = *texture;
        } else {
            using U = rhi::BufferUsage;
            const auto buffer =
                device_.create_buffer(buffer_desc(like, U::Storage | U::CopySrc | U::CopyDst | use.buffer_usage));
            if (!buffer) return buffer.error();
            made.buffers[i] = *buffer;
        }
        ++made_;
        made.left[i].assign(like.subresources(), rhi::Access::Undefined);
    }
    return &(histories_[like.history] = std::move(made));
}

// ---- bytes from the CPU

Result<uint64_t> GraphObjects::blocks(std::span<const std::byte> bytes) {
    if (bytes.empty()) return uint64_t{0};
    if (bytes.size() > blocks_per_slot_) {
        if (blocks_) {
            drop_groups_with(blocks_.bits(), kBuffer);
            device_.destroy(blocks_);
            blocks_ = {};
        }
        blocks_per_slot_ = std::bit_ceil(std::max<uint64_t>(bytes.size(), 4096));
        const auto made = device_.create_buffer({.size = blocks_per_slot_ * slots_,
                                                 .usage = rhi::BufferUsage::Uniform | rhi::BufferUsage::CopyDst,
                                                 .label = "uniform blocks"});
        if (!made) {
            blocks_per_slot_ = 0;
            return made.error();
        }
        ++made_;
        blocks_ = *made;
    }
    const uint64_t base = blocks_per_slot_ * slot_;
    if (const auto r = device_.write_buffer(blocks_, base, bytes); !r) return r.error();
    return base;
}

Result<rhi::BufferHandle> GraphObjects::upload(const GraphResource& r, rhi::BufferUsage usage) {
    usage |= rhi::BufferUsage::CopyDst;
    const uint64_t capacity =
        std::bit_ceil(std::max<uint64_t>(r.bytes, 256));  // lists grow and shrink from frame to frame
    Upload* found = nullptr;
    for (Upload& u : uploads_) {
        if (u.slot != slot_ || u.last_frame == frame_ || u.bytes != capacity || u.usage != usage) continue;
        found = &u;
        break;
    }
    if (!found) {
        const auto made = device_.create_buffer({.size = capacity, .usage = usage, .label = r.name});
        if (!made) return made.error();
        ++made_;
        uploads_.push_back({*made, capacity, usage, slot_, 0});
        found = &uploads_.back();
    }
    found->last_frame = frame_;
    if (const auto written = device_.write_buffer(found->handle, 0, r.data); !written) return written.error();
    return found->handle;
}

Result<rhi::BufferHandle> GraphObjects::readback(uint64_t bytes) {
    for (auto it = free_readbacks_.begin(); it != free_readbacks_.end(); ++it) {
        if (it->first != bytes) continue;
        const rhi::BufferHandle out = it->second;
        free_readbacks_.erase(it);
        return out;
    }
    auto made = device_.create_buffer(
        {.size = bytes, .usage = rhi::BufferUsage::CopyDst, .memory = rhi::MemoryKind::Readback, .label = "read-back"});
    if (made) ++made_;
    return made;
}

void GraphObjects::give_back(rhi::BufferHandle readback) {
    constexpr size_t kMostFree = 8;
    if (free_readbacks_.size() == kMostFree) {
        device_.destroy(free_readbacks_.front().second);
        free_readbacks_.erase(free_readbacks_.begin());
    }
    free_readbacks_.push_back({device_.desc(readback).size, readback});
}

}  // namespace kiln::render
