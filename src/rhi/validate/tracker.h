// SPDX-License-Identifier: MIT
// Are the barriers right? Follows every buffer, and every mip and layer of every texture, through the queue's commands in
// the order in which they run, and says where one is used in a way for which no barrier made it ready.
#pragma once

#include "rhi/validate/objects.h"

#include <unordered_map>

namespace kiln::rhi::validate {

// One touch of a resource by a dispatch, a render pass or a copy.
struct Use {
    BufferHandle buffer;
    TextureHandle texture;
    Subresources range;  // counts resolved
    Access access = Access::Undefined;
    Origin at = {};  // of a copy into a texture: the texels it writes; size (0, 0, 0): not said
    Extent size = {0, 0, 0};
};

// A recorded step: a use or a barrier, and where it stands.
struct Event {
    bool is_barrier = false;
    Use use;
    Barrier barrier;
    uint32_t place = 0;  // index into Recording::places
};

struct Recording {
    std::vector<Event> events;
    std::vector<std::string> places;  // "dispatch 2 of 'march'"
};

class Tracker {
public:
    explicit Tracker(Objects& objects) : objects_(objects) {}

    void add(BufferHandle handle, bool placed);
    void add(TextureHandle handle);
    void remove(BufferHandle handle) { buffers_.erase(handle.bits()); }
    void remove(TextureHandle handle) { textures_.erase(handle.bits()); }

    // Queue writes, ahead of a submit's commands. Each answers with a sentence about what is wrong, or nothing.
    void wrote(BufferHandle handle);
    std::string wrote(const TextureWrite& write);

    // Plays a submit's commands; sentences about what is wrong.
    std::vector<std::string> play(const Recording& recording);

    bool ready_for_host(BufferHandle handle);
    bool ready_to_present(TextureHandle handle);

private:
    struct State {
        Access allowed = Access::Undefined;  // `after` of the last barrier
        Access used = Access::Undefined;     // since then
        bool settled = false;                // no work is under way: the first use needs no barrier
        std::vector<Use> pieces = {};        // copies into parts of it since then, when there was nothing else
    };

    std::string use(State& state, Access access, const std::string& what);
    // Copies that write different texels need no barrier between them.
    std::string use_texture(State& state, const Use& use, const std::string& what);
    std::string barrier(State& state, const Barrier& b, bool is_texture, const std::string& what);
    // Resources in the same memory as the one that a barrier brings to life: their contents end here.
    std::string end_aliases(HeapHandle heap, uint64_t begin, uint64_t end, const Barrier& b, const std::string& what);

    Objects& objects_;
    std::unordered_map<uint64_t, State> buffers_;
    std::unordered_map<uint64_t, std::vector<State>> textures_;  // mip + layer * mips
};

}  // namespace kiln::rhi::validate
