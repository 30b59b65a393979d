// SPDX-License-Identifier: MIT
#include "field/brick_pool.h"

#include "base/assert.h"

#include <algorithm>
#include <bit>

namespace kiln::field {

uint32_t BrickPool::allocate() {
    if (in_use_ == capacity_) {
        ++refused_;
        return kNoSlot;
    }
    uint32_t slot = slot_count_;
    for (uint32_t word = first_free_ / 64; word * 64 < slot_count_; ++word) {
        const uint64_t free = ~taken_[word];
        if (free == 0) continue;
        slot = std::min(slot_count_, word * 64 + uint32_t(std::countr_zero(free)));
        break;
    }
    if (slot == slot_count_) {
        ++slot_count_;
        taken_.resize_pages(slot / 64 / 64 + 1);
    }
    taken_.write(slot / 64) |= uint64_t(1) << (slot % 64);
    first_free_ = slot + 1;
    ++in_use_;
    return slot;
}

void BrickPool::release(uint32_t slot) {
    KILN_ASSERT(used(slot), "slot {} of {} is not in use", slot, slot_count_);
    taken_.write(slot / 64) &= ~(uint64_t(1) << (slot % 64));
    first_free_ = std::min(first_free_, slot);
    --in_use_;
}

}  // namespace kiln::field
