// SPDX-License-Identifier: MIT
// EditIndex: which edits can matter near a place. An octree of pages that snapshots share: copying one is a pointer, adding or removing
// an edit copies the nodes on its way down. Every node knows the tight box of what lies below it, so a search looks like one of a
// bounding volume hierarchy; an edit lies in one node only.
#pragma once

#include "base/shared.h"

#include <kiln/math.h>

#include <algorithm>
#include <cstdint>
#include <vector>

namespace kiln::sdf {

/// An edit as the index sees it.
struct IndexedEdit {
    uint32_t row = 0;
    Box3 solid;               ///< metres; infinite faces for what is everywhere
    float reach = 0;          ///< metres of value: blending begins this far from the solid
    float slowness = 1;       ///< 1 / rate: metres one must go away from `solid` for the value to grow by one
    float bulge = 0;          ///< metres that a blend can add around it
    bool adds = true;         ///< a union: its solid is part of the world's
    bool everywhere = false;  ///< matters at any distance (unbounded, or an intersect)

    /// Where its value may be below `value` or blend with one that is.
    Box3 influence(float value) const { return solid.inflated((value + reach) * slowness); }
};

/// Sums up what lists of smooth edits ask for beyond a value, see EditIndex::blend_allowance().
class BlendAllowance {
public:
    void add(float reach) {
        sum_ += reach;
        largest_ = std::max(largest_, reach);
    }
    float metres() const { return std::min(sum_, kLadder * largest_); }
    static constexpr float kLadder = 6;

private:
    float sum_ = 0, largest_ = 0;
};

class EditIndex {
public:
    void insert(const IndexedEdit& edit);
    /// `edit` as it was inserted.
    void remove(const IndexedEdit& edit);

    /// Appends the rows of all edits whose influence(value) meets the box, and all that are everywhere; in no order.
    void find(const Box3& box, float value, std::vector<uint32_t>& rows) const { find(box, value, 0, rows); }
    /// The same of those that blend.
    void find_blending(const Box3& box, float value, std::vector<uint32_t>& rows) const;
    /// How much farther than `value` one must look for edits around the box, since smooth blends lead values from one to the next: see
    /// edit_index.cpp. Leaves out one row. 0 where nothing blends.
    float blend_allowance(const Box3& box, float value, uint32_t without = UINT32_MAX) const;
    /// Appends the rows of the edits that are everywhere, or of all.
    void everywhere(std::vector<uint32_t>& rows) const;
    void all(std::vector<uint32_t>& rows) const;

    uint32_t size() const;
    /// Whether some union has no end.
    bool fills_space() const;
    /// Of the solids of finite unions, and of the other finite edits.
    Box3 solids() const { return root_ ? root_->solids : Box3{}; }
    Box3 others() const;
    /// Of where finite edits can change a surface of what is everywhere: as far around them as they blend.
    Box3 touched() const { return root_ ? root_->box : Box3{}; }
    /// Largest IndexedEdit::reach.
    float largest_reach() const;

private:
    void find(const Box3& box, float value, float per_reach, std::vector<uint32_t>& rows) const;
    template <typename Enter, typename Fn>
    void each(const Box3& box, float value, float per_reach, Enter&& enter, Fn&& fn) const;

    struct Node {
        Shared<Node> child[8];  ///< x, y, z above the middle: bits 0, 1, 2
        std::vector<IndexedEdit> edits;
        Box3 box;     ///< influence(0) of all below
        Box3 solids;  ///< unions' solids, inflated by what a blend can add
        Box3 others;
        float slowness = 1;  ///< largest below
        float reach = 0;     ///< likewise
        uint32_t count = 0;
    };
    void insert_at(Node& node, vec3 middle, float half, const IndexedEdit& edit, int depth);
    bool remove_at(Shared<Node>& shared, vec3 middle, float half, const IndexedEdit& edit);
    static void refresh(Node& node);
    void grow_to(vec3 point);

    Shared<Node> root_;
    float half_ = 1;  ///< the root is a cube of twice this around the origin
    Shared<std::vector<IndexedEdit>> everywhere_;
};

}  // namespace kiln::sdf
