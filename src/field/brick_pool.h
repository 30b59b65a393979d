// SPDX-License-Identifier: MIT
// Brick pool: which slots of the atlas are in use. The lowest free slot is handed out first, so that the same requests get the
// same slots. Capacity is fixed at creation; allocate() answers kNoSlot when full and `refused()` counts it. A copy is cheap.
#pragma once

#include "base/paged_array.h"

#include <cstdint>

namespace kiln::field {

inline constexpr uint32_t kNoSlot = UINT32_MAX;

class BrickPool {
public:
    explicit BrickPool(uint32_t capacity) : capacity_(capacity) {}

    uint32_t allocate();
    void release(uint32_t slot);
    bool used(uint32_t slot) const { return slot < slot_count_ && (taken_[slot / 64] >> (slot % 64) & 1u) != 0; }

    uint32_t in_use() const { return in_use_; }
    uint32_t slot_count() const { return slot_count_; }  ///< one past the highest slot ever handed out
    uint32_t refused() const { return refused_; }

private:
    uint32_t capacity_, in_use_ = 0, refused_ = 0, slot_count_ = 0;
    uint32_t first_free_ = 0;            // no free slot is below
    PagedArray<uint64_t, 64> taken_{0};  // a bit a slot
};

}  // namespace kiln::field
