// SPDX-License-Identifier: MIT
// Brick pool: which slots of the atlas are in use. The lowest free slot is handed out first, so that the same requests get the
// same slots. Capacity is fixed at creation; allocate() answers kNoSlot when full and `refused()` counts it.
#pragma once

#include <cstdint>
#include <functional>
#include <queue>
#include <vector>

namespace kiln::field {

inline constexpr uint32_t kNoSlot = UINT32_MAX;

class BrickPool {
public:
    explicit BrickPool(uint32_t capacity) : capacity_(capacity) {}

    uint32_t allocate();
    void release(uint32_t slot);
    /// Declares slots [0, used.size()) known: those with used[i] true are taken, the others free. Only on a fresh pool.
    void adopt(const std::vector<bool>& used);

    uint32_t in_use() const { return in_use_; }
    uint32_t slot_count() const { return uint32_t(taken_.size()); }  ///< one past the highest slot ever handed out
    uint32_t refused() const { return refused_; }

private:
    uint32_t capacity_, in_use_ = 0, refused_ = 0;
    std::vector<bool> taken_;
    std::priority_queue<uint32_t, std::vector<uint32_t>, std::greater<>> free_;
};

}  // namespace kiln::field
