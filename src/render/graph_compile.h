// SPDX-License-Identifier: MIT
// Parts of compile(): when passes may share a resource, and where transients lie in memory.
#pragma once

#include "render/graph_plan.h"

namespace kiln::render {

// Can a subresource be in one state for both?
bool together(const GraphResource& r, rhi::Access a, rhi::Access b);

// Texels of all mips and layers, rounded up to 1 KiB: what a device would need, about.
uint64_t nominal_bytes(const GraphResource& image);

// Gives every placement an offset, and the plan its sums: the peak, without aliasing, and of one pass. Two placements share bytes only if one's last
// level is ahead of the other's first. Without aliasing nobody shares.
void pack(Plan& plan);

// The tail for the next frame: what this one used last, and of `before` what this one did not cover.
std::vector<MemoryTail> tail_after(std::span<const Placement> placements, std::span<const MemoryTail> before);

}  // namespace kiln::render
