// SPDX-License-Identifier: MIT
#include "rhi/validate/tracker.h"

#include "base/format.h"
#include "rhi/texture_math.h"

#include <algorithm>

namespace kiln::rhi::validate {

namespace {

bool contains(Access set, Access part) { return !any(part & ~set); }

std::string name_of(const TextureInfo& t, uint32_t mip, uint32_t layer) {
    std::string out = formatted("texture '{}'", t.label);
    if (t.desc.mips > 1) out += formatted(" mip {}", mip);
    if (layer_count(t.desc) > 1) out += formatted(" layer {}", layer);
    return out;
}

}  // namespace

void Tracker::add(BufferHandle handle, bool placed) { buffers_[handle.bits()] = {.settled = !placed}; }

void Tracker::add(TextureHandle handle) {
    const TextureInfo* t = objects_.textures.find(handle);
    textures_[handle.bits()].resize(size_t{t->desc.mips} * layer_count(t->desc));
}

void Tracker::wrote(BufferHandle handle) {
    if (const auto it = buffers_.find(handle.bits()); it != buffers_.end()) it->second = {.settled = true};
}

std::string Tracker::wrote(const TextureWrite& write) {
    const auto it = textures_.find(write.place.texture.bits());
    const TextureInfo* t = objects_.textures.find(write.place.texture);
    if (it == textures_.end() || !t) return {};
    const bool volume = t->desc.dimension == Dimension::D3;
    const uint32_t first = volume ? 0 : write.place.origin.z;
    for (uint32_t layer = first; layer < first + (volume ? 1 : write.size.depth); ++layer) {
        State& s = it->second[write.place.mip + layer * t->desc.mips];
        if (any(write.before) && write.before != s.allowed)
            return formatted("write_texture: {} is said to be in {} before, but is in {}",
                             name_of(*t, write.place.mip, layer), name(write.before), name(s.allowed));
        s = {.allowed = write.after};
    }
    return {};
}

bool Tracker::ready_for_host(BufferHandle handle) {
    const auto it = buffers_.find(handle.bits());
    return it != buffers_.end() && (it->second.settled || any(it->second.allowed & Access::HostRead));
}

bool Tracker::ready_to_present(TextureHandle handle) {
    const auto it = textures_.find(handle.bits());
    return it != textures_.end() && it->second.front().allowed == Access::Present;
}

std::string Tracker::use(State& s, Access access, const std::string& what) {
    if (s.settled) {
        if (!writes(access)) {
            s.used |= access;
            return {};
        }
        if (any(s.used))
            return formatted("{} is written as {} after it was used as {}, without a barrier between", what,
                             name(access), name(s.used));
        s = {.allowed = access, .used = access};
        return {};
    }
    if (!any(s.allowed)) return formatted("{} is used as {}, but no barrier ever gave it contents", what, name(access));
    if (!contains(s.allowed, access))
        return formatted("{} is used as {}, but is ready for {}; a barrier is missing", what, name(access),
                         name(s.allowed));
    if (writes(s.used))
        return formatted("{} is used as {} after it was written as {}, without a barrier between", what, name(access),
                         name(s.used));
    s.used |= access;
    return {};
}

std::string Tracker::use_texture(State& s, const Use& u, const std::string& what) {
    if (u.access != Access::CopyWrite || u.size == Extent{0, 0, 0}) return use(s, u.access, what);
    const auto apart = [](uint32_t a, uint32_t n, uint32_t b, uint32_t m) { return a + n <= b || b + m <= a; };
    const bool beside = s.used == Access::CopyWrite && !s.pieces.empty() &&
                        std::all_of(s.pieces.begin(), s.pieces.end(), [&](const Use& p) {
                            return apart(p.at.x, p.size.width, u.at.x, u.size.width) ||
                                   apart(p.at.y, p.size.height, u.at.y, u.size.height) ||
                                   apart(p.at.z, p.size.depth, u.at.z, u.size.depth);
                        });
    if (!beside) {
        std::string fault = use(s, u.access, what);
        if (!fault.empty()) return fault;
    }
    s.pieces.push_back(u);
    return {};
}

std::string Tracker::barrier(State& s, const Barrier& b, bool is_texture, const std::string& what) {
    const Access waits_for = b.before | b.alias_before;
    // What must have finished: the uses since the last barrier, or, if there were none, what that barrier promised.
    const Access pending = s.settled || any(s.used) ? s.used : s.allowed;
    const Access promised = s.allowed;
    const bool settled = s.settled;
    s = {.allowed = b.after};
    if (!contains(waits_for, pending))
        return formatted("barrier on {}: it waits for {}, but the last access was {}", what, name(waits_for),
                         name(pending));
    if (is_texture && any(b.before) && b.before != promised)
        return formatted("barrier on {}: it is said to be in {} before, but is in {}", what, name(b.before),
                         name(promised));
    if (!is_texture && !settled && any(b.before) && !any(promised) && !any(pending))
        return formatted("barrier on {}: it is said to be in {} before, but no barrier ever gave it contents", what,
                         name(b.before));
    return {};
}

std::string Tracker::end_aliases(HeapHandle heap, uint64_t begin, uint64_t end, const Barrier& b,
                                 const std::string& what) {
    std::string fault;
    const auto hand_over = [&](State& s, const std::string& other) {
        const Access pending = any(s.used) ? s.used : s.allowed;
        if (!contains(b.alias_before, pending) && fault.empty())
            fault = formatted("barrier on {}: it takes over the memory of {}, last accessed as {}, but waits for {}",
                              what, other, name(pending), name(b.alias_before));
        s = {};
    };
    objects_.buffers.for_each([&](BufferHandle h, BufferInfo& other) {
        if (other.desc.heap != heap || h == b.buffer || other.desc.heap_offset >= end ||
            other.desc.heap_offset + other.need.size <= begin)
            return;
        hand_over(buffers_[h.bits()], formatted("buffer '{}'", other.label));
    });
    objects_.textures.for_each([&](TextureHandle h, TextureInfo& other) {
        if (other.desc.heap != heap || h == b.texture || other.desc.heap_offset >= end ||
            other.desc.heap_offset + other.need.size <= begin)
            return;
        for (State& s : textures_[h.bits()]) hand_over(s, formatted("texture '{}'", other.label));
    });
    return fault;
}

std::vector<std::string> Tracker::play(const Recording& recording) {
    std::vector<std::string> faults;
    for (const Event& e : recording.events) {
        const std::string& place = recording.places[e.place];
        const auto fault = [&](const std::string& text) {
            if (!text.empty()) faults.push_back(place + ": " + text);
        };
        const BufferHandle buffer = e.is_barrier ? e.barrier.buffer : e.use.buffer;
        const TextureHandle texture = e.is_barrier ? e.barrier.texture : e.use.texture;
        if (buffer) {
            BufferInfo* info = objects_.buffers.find(buffer);
            if (!info) {
                fault(objects_.buffers.why_not(buffer) + " between recording and submit");
                continue;
            }
            if (info->mapped) fault(formatted("buffer '{}' is mapped while the GPU uses it", info->label));
            State& s = buffers_[buffer.bits()];
            const std::string what = formatted("buffer '{}'", info->label);
            if (!e.is_barrier) {
                fault(use(s, e.use.access, what));
                continue;
            }
            if (info->desc.heap && !any(e.barrier.before))
                fault(end_aliases(info->desc.heap, info->desc.heap_offset, info->desc.heap_offset + info->need.size,
                                  e.barrier, what));
            fault(barrier(s, e.barrier, false, what));
        } else {
            TextureInfo* info = objects_.textures.find(texture);
            if (!info) {
                fault(objects_.textures.why_not(texture) + " between recording and submit");
                continue;
            }
            if (e.is_barrier && info->desc.heap && !any(e.barrier.before))
                fault(end_aliases(info->desc.heap, info->desc.heap_offset, info->desc.heap_offset + info->need.size,
                                  e.barrier, formatted("texture '{}'", info->label)));
            std::vector<State>& states = textures_[texture.bits()];
            const Subresources r = e.is_barrier ? resolved(info->desc, e.barrier.range) : e.use.range;
            bool said = false;  // once a use, not once a mip and layer
            for (uint32_t layer = r.base_layer; layer < r.base_layer + r.layer_count; ++layer)
                for (uint32_t mip = r.base_mip; mip < r.base_mip + r.mip_count; ++mip) {
                    State& s = states[mip + layer * info->desc.mips];
                    const std::string text = e.is_barrier ? barrier(s, e.barrier, true, name_of(*info, mip, layer))
                                                          : use_texture(s, e.use, name_of(*info, mip, layer));
                    if (!said) fault(text);
                    said = said || !text.empty();
                }
        }
    }
    return faults;
}

}  // namespace kiln::rhi::validate
