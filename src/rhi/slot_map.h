// SPDX-License-Identifier: MIT
// Objects behind handles: a slot is reused under a new generation, so an old handle finds nothing.
// References stay valid until remove().
#pragma once

#include "rhi/types.h"

#include <deque>
#include <optional>
#include <utility>

namespace kiln::rhi {

template <typename H, typename T>
class SlotMap {
public:
    H insert(T value) {
        uint32_t index;
        if (free_.empty()) {
            index = uint32_t(slots_.size());
            slots_.emplace_back();
        } else {
            index = free_.back();
            free_.pop_back();
        }
        Slot& slot = slots_[index];
        ++slot.generation;
        slot.value.emplace(std::move(value));
        ++size_;
        return {index, slot.generation};
    }

    T* get(H handle) {
        if (!handle || handle.index >= slots_.size()) return nullptr;
        Slot& slot = slots_[handle.index];
        return slot.generation == handle.generation && slot.value ? &*slot.value : nullptr;
    }
    const T* get(H handle) const { return const_cast<SlotMap*>(this)->get(handle); }

    std::optional<T> remove(H handle) {
        T* found = get(handle);
        if (!found) return std::nullopt;
        std::optional<T> out(std::move(*found));
        slots_[handle.index].value.reset();
        // A slot whose generations ran out is never used again.
        if (slots_[handle.index].generation != ~0u) free_.push_back(handle.index);
        --size_;
        return out;
    }

    uint32_t size() const { return size_; }

    template <typename F>
    void for_each(F&& f) {
        for (uint32_t i = 0; i < slots_.size(); ++i)
            if (slots_[i].value) f(H{i, slots_[i].generation}, *slots_[i].value);
    }
    template <typename F>
    void for_each(F&& f) const {
        for (uint32_t i = 0; i < slots_.size(); ++i)
            if (slots_[i].value) f(H{i, slots_[i].generation}, std::as_const(*slots_[i].value));
    }

private:
    struct Slot {
        uint32_t generation = 0;
        std::optional<T> value;
    };
    std::deque<Slot> slots_;
    std::vector<uint32_t> free_;
    uint32_t size_ = 0;
};

}  // namespace kiln::rhi
