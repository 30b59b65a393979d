// SPDX-License-Identifier: MIT
// EditList: the ordered edits of a world under stable ids. Every change costs the same in a list of any length: edits stand in slots that
// are linked in order, names lead to slots. A slot used again has a generation that no edit in it ever had, also after an edit that was
// taken out has come back under its old id, as undo brings it.
#pragma once

#include "scene/json_source.h"

#include <kiln/edit.h>

#include <cstdint>
#include <memory>
#include <string_view>
#include <unordered_map>
#include <vector>

namespace kiln::scene {

class EditList {
public:
    static constexpr uint32_t kNone = UINT32_MAX;

    struct Slot {
        std::unique_ptr<Edit> edit;               ///< null: free
        uint32_t previous = kNone, next = kNone;  ///< slots, in order; of free ones, the other free ones
        uint32_t generation = 0;                  ///< of the edit in it
        uint32_t next_generation = 0;             ///< of the first that is new in it
        uint32_t row = kNone;                     ///< of the program; the compiler's
        JsonIndex place = UINT32_MAX;             ///< in the scene's source
    };

    EditList() = default;
    EditList(EditList&&) = default;
    EditList& operator=(EditList&&) = default;
    /// The same edits under the same ids.
    EditList copy() const;

    uint32_t size() const { return size_; }
    uint32_t outlined() const { return outlined_; }  ///< edits with an outline
    uint32_t first() const { return first_; }
    uint32_t last() const { return last_; }
    const Slot& operator[](uint32_t slot) const { return slots_[slot]; }
    void set_row(uint32_t slot, uint32_t row) { slots_[slot].row = row; }
    void set_place(uint32_t slot, JsonIndex place) { slots_[slot].place = place; }
    EditId id(uint32_t slot) const { return slot == kNone ? EditId{} : EditId{slot, slots_[slot].generation}; }
    /// kNone for an id that is stale or refers to nothing.
    uint32_t find(EditId id) const {
        return id.index < slots_.size() && slots_[id.index].edit && slots_[id.index].generation == id.generation
                   ? id.index
                   : kNone;
    }
    uint32_t find(std::string_view name) const {
        const auto at = names_.find(name);
        return at == names_.end() ? kNone : at->second;
    }
    size_t slots() const { return slots_.size(); }

    /// The id that a new edit will have.
    EditId free_id() const;
    /// Puts an edit before another, or at the end (kNone), under an id that free_id() gave or that an edit had which is gone. Its name
    /// must be no other's.
    void insert(EditId id, std::unique_ptr<Edit> edit, uint32_t before, JsonIndex place);
    std::unique_ptr<Edit> erase(uint32_t slot);
    /// The edit that was there. The new one's name must be no other's.
    std::unique_ptr<Edit> exchange(uint32_t slot, std::unique_ptr<Edit> edit);
    void move(uint32_t slot, uint32_t before);
    void reserve(size_t edits);

    /// Calls fn(slot) in order.
    template <typename Fn>
    void each(Fn&& fn) const {
        for (uint32_t at = first_; at != kNone; at = slots_[at].next) fn(at);
    }

private:
    void link(uint32_t slot, uint32_t before);
    void unlink(uint32_t slot);
    void take_free(uint32_t slot);

    std::vector<Slot> slots_;
    uint32_t first_ = kNone, last_ = kNone, free_ = kNone, size_ = 0, outlined_ = 0;
    std::unordered_map<std::string_view, uint32_t> names_;  // views of the edits' own names
};

}  // namespace kiln::scene
