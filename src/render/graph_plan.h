// SPDX-License-Identifier: MIT
// A compiled graph: which passes run, in which levels, which barriers stand ahead of each level, and where transients lie
// in the memory they share. Pure data; text() is what the golden files hold.
//
// Levels: passes keep the order they were recorded in; a pass joins the level of the pass before it unless the two touch
// a subresource that one of them writes. So the barriers of a level can stand together ahead of it.
// Reads between two writes of a subresource are one state: the barrier ahead of the first makes the write visible to all.
#pragma once

#include "render/graph.h"

#include <functional>

namespace kiln::render {

struct PlanBarrier {
    uint32_t resource = 0;
    rhi::Subresources range = {};  // counts resolved; images
    rhi::Access before = rhi::Access::Undefined;
    rhi::Access after = rhi::Access::Undefined;
    rhi::Access alias_before = rhi::Access::Undefined;
    friend bool operator==(const PlanBarrier&, const PlanBarrier&) = default;
};

struct PlanLevel {
    std::vector<PlanBarrier> barriers = {};  // ahead of the passes; by resource, then range
    std::vector<uint32_t> passes = {};       // indices into Plan::passes
};

// A transient's place in the shared memory.
struct Placement {
    uint32_t resource = 0;
    uint64_t offset = 0;
    uint64_t size = 0;
    uint64_t alignment = 1;
    uint32_t first_level = 0;                          // it holds the memory from this level …
    uint32_t last_level = 0;                           // … to this one, both included
    rhi::Access last_access = rhi::Access::Undefined;  // to be waited for by the next owner
};

// Memory that earlier frames may still be using.
struct MemoryTail {
    uint64_t offset = 0;
    uint64_t size = 0;
    rhi::Access access = rhi::Access::Undefined;
    friend bool operator==(const MemoryTail&, const MemoryTail&) = default;
};

struct PlanResource {
    bool used = false;  // by a pass that was not culled
    rhi::TextureUsage texture_usage = rhi::TextureUsage::None;
    rhi::BufferUsage buffer_usage = rhi::BufferUsage::None;
    std::vector<rhi::Access> leave = {};  // one a subresource: the access it is in after the frame; used resources
    bool written = false;
};

struct Plan {
    std::vector<GraphResource> resources = {};  // copies without payloads, for text() and checks
    std::vector<GraphPass> passes = {};         // those that run, in order, including inserted ones
    std::vector<uint32_t> recorded = {};        // of each, its index in Graph::passes(); ~0 for inserted ones
    std::vector<std::string> culled = {};       // names, in order of recording
    std::vector<PlanLevel> levels = {};
    std::vector<PlanBarrier> epilogue =
        {};  // after the last level: outputs and read-backs into the access they are left in
    std::vector<PlanResource> uses = {};     // one a resource
    std::vector<Placement> placements = {};  // by resource
    uint64_t peak_bytes = 0;                 // size of the shared memory
    uint64_t unaliased_bytes = 0;            // what the transients would need one beside the other
    uint64_t most_of_a_pass = 0;  // what the transients of one pass need: no order and no packing has a lower peak
    bool aliasing = true;
    std::vector<MemoryTail> tail_before = {};  // CompileOptions::tail
    std::vector<MemoryTail> tail = {};         // for the next frame's CompileOptions

    size_t barrier_count() const;
    std::string text() const;
};

struct CompileOptions {
    bool aliasing = true;
    bool poison = false;  // every transient is filled with NaN or 0xCD bytes ahead of its first use
    std::vector<MemoryTail> tail = {};
    // Room of a transient in memory. Default: nominal sizes that are the same everywhere (texels rounded up to 1 KiB).
    std::function<rhi::MemoryNeed(const rhi::TextureDesc&)> texture_need = {};
    std::function<rhi::MemoryNeed(const rhi::BufferDesc&)> buffer_need = {};
};

// Bytes of what lives for this frame that the pass names, each texel counted once as read and once as written. What stays from frame to
// frame (atlas, meshes, maps) is left out: a pass reads some of it, and which depends on the picture.
uint64_t frame_bytes(const Plan& plan, const GraphPass& pass);

// The same kind, size and format.
bool same_shape(const GraphResource& a, const GraphResource& b);

// What a transient is made with.
rhi::TextureDesc texture_desc(const GraphResource& resource, rhi::TextureUsage usage);
rhi::BufferDesc buffer_desc(const GraphResource& resource, rhi::BufferUsage usage);

}  // namespace kiln::render
