// SPDX-License-Identifier: MIT
#include "field/brick_pool.h"

#include "base/assert.h"

namespace kiln::field {

uint32_t BrickPool::allocate() {
    if (in_use_ == capacity_) {
        ++refused_;
        return kNoSlot;
    }
    ++in_use_;
    uint32_t slot = uint32_t(taken_.size());
    if (free_.empty()) {
        taken_.push_back(true);
    } else {
        slot = free_.top();
        free_.pop();
        taken_[slot] = true;
    }
    return slot;
}

void BrickPool::release(uint32_t slot) {
    KILN_ASSERT(slot < taken_.size() && taken_[slot], "slot {} of {} is not in use", slot, taken_.size());
    taken_[slot] = false;
    free_.push(slot);
    --in_use_;
}

void BrickPool::adopt(const std::vector<bool>& used) {
    KILN_ASSERT(taken_.empty() && used.size() <= capacity_, "{} slots known, {} adopted", taken_.size(), used.size());
    taken_ = used;
    for (uint32_t slot = 0; slot < used.size(); ++slot) {
        if (used[slot]) {
            ++in_use_;
        } else {
            free_.push(slot);
        }
    }
}

}  // namespace kiln::field
