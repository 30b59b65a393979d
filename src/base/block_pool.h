// SPDX-License-Identifier: MIT
// Blocks of memory that come and go by the thousand: kept by size when given back, a few at each thread, the rest for all. Memory that
// was once taken is kept for the next taker of its size. Any thread.
#pragma once

#include <cstddef>

namespace kiln {

inline constexpr size_t kBlockAlign = 16;

/// At least `bytes` of memory, aligned to kBlockAlign.
void* take_block(size_t bytes);
/// Gives back what take_block(bytes) gave.
void give_block(void* block, size_t bytes);

}  // namespace kiln
