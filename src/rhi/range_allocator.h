// SPDX-License-Identifier: MIT
// Hands out ranges of one block of memory: best fit, neighbours merged at once. O(log n) per call.
// Knows offsets only, so it serves any kind of memory.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>

namespace kiln::rhi {

class RangeAllocator {
public:
    explicit RangeAllocator(uint64_t size) : size_(size), free_bytes_(size) { add(0, size); }

    // Offset of a range of `size` bytes, a multiple of `alignment` (a power of two). Nothing when none is long enough.
    std::optional<uint64_t> allocate(uint64_t size, uint64_t alignment) {
        if (size == 0) size = 1;
        for (auto it = by_size_.lower_bound({size, 0}); it != by_size_.end(); ++it) {
            const auto [length, begin] = *it;
            const uint64_t offset = (begin + alignment - 1) & ~(alignment - 1);
            const uint64_t lead = offset - begin;
            if (lead > length || length - lead < size) continue;
            by_size_.erase(it);
            by_offset_.erase(begin);
            if (lead > 0) add(begin, lead);
            if (length - lead > size) add(offset + size, length - lead - size);
            used_.emplace(offset, size);
            free_bytes_ -= size;
            return offset;
        }
        return std::nullopt;
    }

    // `offset` as allocate() gave it.
    void release(uint64_t offset) {
        const auto used = used_.find(offset);
        if (used == used_.end()) return;
        uint64_t begin = offset;
        uint64_t length = used->second;
        free_bytes_ += length;
        used_.erase(used);
        if (auto next = by_offset_.find(begin + length); next != by_offset_.end()) {
            length += next->second;
            by_size_.erase({next->second, next->first});
            by_offset_.erase(next);
        }
        if (auto after = by_offset_.lower_bound(begin); after != by_offset_.begin()) {
            const auto before = std::prev(after);
            if (before->first + before->second == begin) {
                begin = before->first;
                length += before->second;
                by_size_.erase({before->second, before->first});
                by_offset_.erase(before);
            }
        }
        add(begin, length);
    }

    bool empty() const { return used_.empty(); }
    uint64_t size() const { return size_; }
    uint64_t free_bytes() const { return free_bytes_; }
    size_t free_ranges() const { return by_offset_.size(); }

private:
    void add(uint64_t begin, uint64_t length) {
        by_offset_.emplace(begin, length);
        by_size_.emplace(length, begin);
    }

    uint64_t size_;
    uint64_t free_bytes_;
    std::map<uint64_t, uint64_t> by_offset_;           // free: begin -> length
    std::set<std::pair<uint64_t, uint64_t>> by_size_;  // free: (length, begin)
    std::map<uint64_t, uint64_t> used_;                // begin -> length
};

}  // namespace kiln::rhi
