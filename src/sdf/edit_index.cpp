// SPDX-License-Identifier: MIT
// A node keeps up to kMostHere edits before it hands down those that are no larger than a child; the rest stay. Nodes that lose their
// last edit go.

#include "sdf/edit_index.h"

#include "base/assert.h"

#include <algorithm>
#include <cmath>

namespace kiln::sdf {
namespace {

constexpr size_t kMostHere = 16;
constexpr int kDeepest = 40;

vec3 center_of(const IndexedEdit& edit) { return edit.solid.center(); }

float size_of(const IndexedEdit& edit) {
    const vec3 half = edit.influence(0).half_extents();
    return 2 * std::max({half.x, half.y, half.z});
}

int octant(vec3 p, vec3 middle) {
    return (p.x >= middle.x ? 1 : 0) | (p.y >= middle.y ? 2 : 0) | (p.z >= middle.z ? 4 : 0);
}

vec3 child_middle(vec3 middle, float half, int child) {
    const float step = 0.5f * half;
    return {middle.x + ((child & 1) != 0 ? step : -step), middle.y + ((child & 2) != 0 ? step : -step),
            middle.z + ((child & 4) != 0 ? step : -step)};
}

Box3 reached(const IndexedEdit& edit) { return edit.solid.inflated(edit.bulge); }

}  // namespace

void EditIndex::refresh(Node& node) {
    node.box = node.solids = node.others = Box3{};
    node.slowness = 1;
    node.reach = 0;
    node.count = uint32_t(node.edits.size());
    for (const IndexedEdit& e : node.edits) {
        node.box = box_union(node.box, e.influence(0));
        Box3& part = e.adds ? node.solids : node.others;
        part = box_union(part, reached(e));
        node.slowness = std::max(node.slowness, e.slowness);
        node.reach = std::max(node.reach, e.reach);
    }
    for (const Shared<Node>& child : node.child) {
        if (!child) continue;
        node.box = box_union(node.box, child->box);
        node.solids = box_union(node.solids, child->solids);
        node.others = box_union(node.others, child->others);
        node.slowness = std::max(node.slowness, child->slowness);
        node.reach = std::max(node.reach, child->reach);
        node.count += child->count;
    }
}

void EditIndex::grow_to(vec3 p) {
    const float far = std::max({std::fabs(p.x), std::fabs(p.y), std::fabs(p.z)});
    while (far >= half_) {  // on the border it would be in another octant once the cube has grown
        if (root_ && root_->count > 0) {
            // Each old octant becomes the innermost octant of a new one.
            Node next;
            next.edits = root_->edits;
            for (int o = 0; o < 8; ++o) {
                if (!root_->child[o]) continue;
                Node wrapper;
                wrapper.child[o ^ 7] = root_->child[o];
                refresh(wrapper);
                next.child[o] = Shared<Node>::make(std::move(wrapper));
            }
            refresh(next);
            root_ = Shared<Node>::make(std::move(next));
        }
        half_ *= 2;
    }
}

void EditIndex::insert_at(Node& node, vec3 middle, float half, const IndexedEdit& edit, int depth) {
    bool has_children = false;
    for (const Shared<Node>& child : node.child) has_children = has_children || child;
    const auto goes_down = [&](const IndexedEdit& e) { return depth < kDeepest && size_of(e) <= half; };
    const auto hand_down = [&](const IndexedEdit& e) {
        const int o = octant(center_of(e), middle);
        insert_at(node.child[o].write(), child_middle(middle, half, o), 0.5f * half, e, depth + 1);
    };
    if (has_children && goes_down(edit)) {
        hand_down(edit);
    } else {
        node.edits.push_back(edit);
        if (!has_children && node.edits.size() > kMostHere) {
            const auto rest = std::stable_partition(node.edits.begin(), node.edits.end(),
                                                    [&](const IndexedEdit& e) { return !goes_down(e); });
            for (auto e = rest; e != node.edits.end(); ++e) hand_down(*e);
            node.edits.erase(rest, node.edits.end());
            refresh(node);
            return;
        }
    }
    ++node.count;
    node.box = box_union(node.box, edit.influence(0));
    Box3& part = edit.adds ? node.solids : node.others;
    part = box_union(part, reached(edit));
    node.slowness = std::max(node.slowness, edit.slowness);
    node.reach = std::max(node.reach, edit.reach);
}

void EditIndex::insert(const IndexedEdit& edit) {
    if (edit.everywhere || !edit.solid.finite()) {
        everywhere_.write().push_back(edit);
        return;
    }
    grow_to(center_of(edit));
    insert_at(root_.write(), {0, 0, 0}, half_, edit, 0);
}

bool EditIndex::remove_at(Shared<Node>& shared, vec3 middle, float half, const IndexedEdit& edit) {
    Node& node = shared.write();
    const auto here =
        std::find_if(node.edits.begin(), node.edits.end(), [&](const IndexedEdit& e) { return e.row == edit.row; });
    if (here != node.edits.end()) {
        *here = node.edits.back();
        node.edits.pop_back();
    } else {
        const int o = octant(center_of(edit), middle);
        if (!node.child[o] || !remove_at(node.child[o], child_middle(middle, half, o), 0.5f * half, edit)) return false;
        if (node.child[o]->count == 0) node.child[o] = {};
    }
    refresh(node);
    return true;
}

void EditIndex::remove(const IndexedEdit& edit) {
    if (edit.everywhere || !edit.solid.finite()) {
        std::vector<IndexedEdit>& all = everywhere_.write();
        const auto here = std::find_if(all.begin(), all.end(), [&](const IndexedEdit& e) { return e.row == edit.row; });
        KILN_ASSERT(here != all.end(), "edit {} is not in the index", edit.row);
        all.erase(here);
        return;
    }
    const bool found = root_ && remove_at(root_, {0, 0, 0}, half_, edit);
    KILN_ASSERT(found, "edit {} is not in the index", edit.row);
    if (root_->count == 0) root_ = {};
}

template <typename Enter, typename Fn>
void EditIndex::each(const Box3& box, float value, float per_reach, Enter&& enter, Fn&& fn) const {
    if (everywhere_) {
        for (const IndexedEdit& e : *everywhere_) fn(e);
    }
    if (!root_) return;
    const Node* stack[8 * kDeepest + 8];
    size_t depth = 0;
    stack[depth++] = root_.get();
    while (depth > 0) {
        const Node& node = *stack[--depth];
        if (!enter(node) || !node.box.inflated((value + per_reach * node.reach) * node.slowness).overlaps(box))
            continue;
        for (const IndexedEdit& e : node.edits) {
            if (e.influence(value + per_reach * e.reach).overlaps(box)) fn(e);
        }
        for (const Shared<Node>& child : node.child) {
            if (child) stack[depth++] = child.get();
        }
    }
}

void EditIndex::find(const Box3& box, float value, float per_reach, std::vector<uint32_t>& rows) const {
    each(
        box, value, per_reach, [](const Node&) { return true; }, [&](const IndexedEdit& e) { rows.push_back(e.row); });
}

void EditIndex::find_blending(const Box3& box, float value, std::vector<uint32_t>& rows) const {
    each(
        box, value, 0, [](const Node& node) { return node.reach > 0; },
        [&](const IndexedEdit& e) {
            if (e.reach > 0) rows.push_back(e.row);
        });
}

// A world is a left fold. Say that a result need not be known where it is above T (below -T: likewise, upside down). Then an operand of an
// operation with reach k, and what came before it, need not be known where they are above T + k + S, S being the reaches that come later.
// Proof, backwards: let two states of the running value, at a point, both be above T + S'. If the next edit is a union (reach k, S' = k + S)
// that lies k below both, it alone decides, and they are one. Else the edit lies above T + S, and each of them k above that, so
// smin(T + S + k, T + S) = T + S bounds what comes of each from below. Cuts only raise them. In the end both are above T, or they are one.
// Now take an operand away that is above T + k + S: the running value is as it was, or was less than k below the operand, and before
// and after both are above T + S.
// But each step that a value takes down such a ladder of operands, s < k apart, hands on at most (1 - s/k)/2 of it: over a height of H that
// is less than exp(-2.68 H/k), so six of the largest reaches are always enough (1e-7 of k).
float EditIndex::blend_allowance(const Box3& box, float value, uint32_t without) const {
    BlendAllowance out;
    each(
        box, value, BlendAllowance::kLadder, [](const Node& node) { return node.reach > 0; },
        [&](const IndexedEdit& e) {
            if (e.row != without) out.add(e.reach);
        });
    return out.metres();
}

void EditIndex::everywhere(std::vector<uint32_t>& rows) const {
    if (!everywhere_) return;
    for (const IndexedEdit& e : *everywhere_) rows.push_back(e.row);
}

void EditIndex::all(std::vector<uint32_t>& rows) const {
    find({{-INFINITY, -INFINITY, -INFINITY}, {INFINITY, INFINITY, INFINITY}}, 0, rows);
}

Box3 EditIndex::others() const {
    Box3 out = root_ ? root_->others : Box3{};
    if (!everywhere_) return out;
    for (const IndexedEdit& e : *everywhere_) {
        if (!e.adds && e.solid.finite()) out = box_union(out, reached(e));
    }
    return out;
}

float EditIndex::largest_reach() const {
    float out = root_ ? root_->reach : 0.0f;
    if (!everywhere_) return out;
    for (const IndexedEdit& e : *everywhere_) out = std::max(out, e.reach);
    return out;
}

bool EditIndex::fills_space() const {
    return everywhere_ && std::any_of(everywhere_->begin(), everywhere_->end(),
                                      [](const IndexedEdit& e) { return e.adds && !e.solid.finite(); });
}

uint32_t EditIndex::size() const {
    return (root_ ? root_->count : 0u) + (everywhere_ ? uint32_t(everywhere_->size()) : 0u);
}

}  // namespace kiln::sdf
