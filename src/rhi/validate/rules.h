// SPDX-License-Identifier: MIT
// Small questions that both devices' calls and recorded commands ask. Each answers with a sentence, or nothing when all
// is well.
#pragma once

#include "rhi/validate/objects.h"

namespace kiln::rhi::validate {

std::string check_access(Access access, const BufferInfo& buffer);
std::string check_access(Access access, const TextureInfo& texture);

// The box of a copy against a mip's size.
std::string check_region(const TextureInfo& texture, const TexturePlace& place, Extent size);

// The buffer side of a copy; `buffer_bytes` is what there is from offset 0.
std::string check_rows(const TextureInfo& texture, const BufferLayout& layout, Extent size, uint64_t buffer_bytes,
                       const Limits& limits);

// Counts a stage's entries against the floor.
std::string check_counts(std::span<const std::vector<BindGroupLayoutEntry>> groups);

bool overlap(const Subresources& a, const Subresources& b);

// How a shader touches what stands in this slot.
Access access_of(const BindGroupLayoutEntry& slot, bool compute);

}  // namespace kiln::rhi::validate
