// SPDX-License-Identifier: MIT

#include "scene/edit_list.h"

#include "base/assert.h"

#include <algorithm>
#include <utility>

namespace kiln::scene {

EditList EditList::copy() const {
    EditList out;
    out.slots_.resize(slots_.size());
    out.names_.reserve(size_);
    for (uint32_t i = 0; i < slots_.size(); ++i) {
        const Slot& s = slots_[i];
        out.slots_[i] = {s.edit ? std::make_unique<Edit>(*s.edit) : nullptr,
                         s.previous,
                         s.next,
                         s.generation,
                         s.next_generation,
                         s.row,
                         s.place};
        if (s.edit) out.names_.emplace(out.slots_[i].edit->name, i);
    }
    out.first_ = first_, out.last_ = last_, out.free_ = free_, out.size_ = size_, out.outlined_ = outlined_;
    return out;
}

EditId EditList::free_id() const {
    if (free_ == kNone) return {uint32_t(slots_.size()), 0};
    return {free_, slots_[free_].next_generation};
}

void EditList::reserve(size_t edits) {
    slots_.reserve(edits);
    names_.reserve(edits);
}

void EditList::take_free(uint32_t slot) {
    const auto [previous, next] = std::pair(slots_[slot].previous, slots_[slot].next);
    (previous == kNone ? free_ : slots_[previous].next) = next;
    if (next != kNone) slots_[next].previous = previous;
}

void EditList::link(uint32_t slot, uint32_t before) {
    const uint32_t previous = before == kNone ? last_ : slots_[before].previous;
    slots_[slot].previous = previous;
    slots_[slot].next = before;
    (previous == kNone ? first_ : slots_[previous].next) = slot;
    (before == kNone ? last_ : slots_[before].previous) = slot;
}

void EditList::unlink(uint32_t slot) {
    const Slot& s = slots_[slot];
    (s.previous == kNone ? first_ : slots_[s.previous].next) = s.next;
    (s.next == kNone ? last_ : slots_[s.next].previous) = s.previous;
}

void EditList::insert(EditId id, std::unique_ptr<Edit> edit, uint32_t before, JsonIndex place) {
    if (id.index == slots_.size()) {
        slots_.emplace_back();
    } else {
        KILN_ASSERT(id.index < slots_.size() && !slots_[id.index].edit, "slot {} is taken", id.index);
        take_free(id.index);
    }
    Slot& s = slots_[id.index];
    s.generation = id.generation;
    s.next_generation = std::max(s.next_generation, id.generation + 1);
    s.row = kNone;
    s.place = place;
    s.edit = std::move(edit);
    const bool fresh = names_.emplace(s.edit->name, id.index).second;
    KILN_ASSERT(fresh, "two edits named {}", s.edit->name);
    link(id.index, before);
    outlined_ += s.edit->outline.has_value();
    ++size_;
}

std::unique_ptr<Edit> EditList::erase(uint32_t slot) {
    Slot& s = slots_[slot];
    names_.erase(s.edit->name);
    unlink(slot);
    s.row = kNone;
    s.place = UINT32_MAX;
    s.previous = kNone;
    s.next = free_;
    if (free_ != kNone) slots_[free_].previous = slot;
    free_ = slot;
    outlined_ -= s.edit->outline.has_value();
    --size_;
    return std::move(s.edit);
}

std::unique_ptr<Edit> EditList::exchange(uint32_t slot, std::unique_ptr<Edit> edit) {
    Slot& s = slots_[slot];
    auto node = names_.extract(s.edit->name);
    node.key() = edit->name;
    const bool fresh = names_.insert(std::move(node)).inserted;
    KILN_ASSERT(fresh, "two edits named {}", edit->name);
    outlined_ += edit->outline.has_value();
    outlined_ -= s.edit->outline.has_value();
    return std::exchange(s.edit, std::move(edit));
}

void EditList::move(uint32_t slot, uint32_t before) {
    if (slot == before || slots_[slot].next == before) return;
    unlink(slot);
    link(slot, before);
}

}  // namespace kiln::scene
