// SPDX-License-Identifier: MIT
// World: what moved in its field between two frames. An edit that is the same thing at another place gives motion to all that is nearest to
// it; where one came, went or became something else, pictures over time begin anew.

#include "scene/movers.h"
#include "scene/world_impl.h"

#include <kiln/renderer.h>

#include <limits>

namespace kiln {

namespace {

constexpr float kForever = std::numeric_limits<float>::infinity();
constexpr Box3 kEverywhere{{-kForever, -kForever, -kForever}, {kForever, kForever, kForever}};
/// More edits than this are not followed one by one: each is asked of every pixel. The others are covered by a few boxes.
constexpr size_t kMostFollowed = 64;

/// The same but for its place and its measures. Paint has no surface that could move.
bool same_thing(Edit a, const Edit& b) {
    a.node.transform = b.node.transform;
    if (a.node.shape.kind == b.node.shape.kind) a.node.shape.params = b.node.shape.params;
    return a.node == b.node && a.op == b.op && a.op != Op::Paint && a.hidden == b.hidden;
}

}  // namespace

/// `was`: what the slot's edit was before; `removed`, `inserted`: its rows.
void World::Impl::changed_since_frame(uint32_t slot, const Edit* was, uint32_t removed, uint32_t inserted) {
    if (!has_shown || all_is_new) return;
    Box3 reach;
    for (const uint32_t row : {removed, inserted}) {
        if (row == field::kNoRow || list.edits[row].count == 0) continue;
        const sdf::EditSpan& span = list.edits[row];
        reach = box_union(reach, span.everywhere() ? kEverywhere : span.indexed(row).influence(0));
    }
    reach = box_union(reach, mover_box(slot));
    if (shown.size() >= kMostFollowed && !shown.contains(slot)) {
        shown_beside.add(reach);
        return;
    }
    const bool is_new = inserted != field::kNoRow && removed == field::kNoRow;
    const auto [at, first] = shown.try_emplace(slot);
    if (first && was != nullptr && !is_new) at->second.edit = *was;
    at->second.reach = box_union(at->second.reach, reach);
}

/// Of what the edit is a part of, where that stands apart.
Box3 World::Impl::mover_box(uint32_t slot) const {
    const auto found = mover_of.find(slot);
    if (found == mover_of.end()) return {};
    const scene::Mover& m = movers.at(found->second);
    return m.apart ? scene::posed_box(*m.object, m.pose) : Box3{};
}

void World::Impl::motions_of(Frame& out) {
    const std::lock_guard lock(mutex);
    if (all_is_new) shown_beside.add(kEverywhere);
    for (const auto& [slot, before] : shown) {
        const Edit* const now = slot < edits.slots() ? edits[slot].edit.get() : nullptr;
        if (now == nullptr && !before.edit) continue;  // it came and went
        const bool same = now != nullptr && before.edit && same_thing(*before.edit, *now);
        const bool stands = same && before.edit->node.transform == now->node.transform;
        if (stands && before.edit->node.shape.params == now->node.shape.params) continue;
        // What stands apart has a pose, and no other motion; what only has other measures, none.
        if (same && !stands && !mover_of.contains(slot))
            out.moved.push_back({edits[slot].row, now->node.transform, before.edit->node.transform});
        else
            shown_beside.add(box_union(before.reach, mover_box(slot)));
    }
    if (has_shown) out.changed.insert(out.changed.end(), shown_beside.boxes().begin(), shown_beside.boxes().end());
    // Dynamic edits whose rows are in the list, at their poses.
    for (auto& [key, m] : movers) {
        if (m.apart) continue;
        if (!(m.pose == m.before)) {
            const vec3 scale = edits[key].edit->node.transform.scale;
            out.moved.push_back({edits[key].row,
                                 {m.pose.position, m.pose.rotation, scale},
                                 {m.before.position, m.before.rotation, scale}});
        }
        m.before = m.pose;
    }
    shown.clear();
    shown_beside.clear();
    all_is_new = false;
    has_shown = true;
}

}  // namespace kiln
