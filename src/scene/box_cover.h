// SPDX-License-Identifier: MIT
// A few boxes that cover many: one more than there is room for widens the one that grows least by it.
#pragma once

#include <kiln/math.h>

#include <limits>
#include <vector>

namespace kiln::scene {

class BoxCover {
public:
    static constexpr size_t kMost = 32;

    void add(const Box3& box) {
        if (box.empty()) return;
        size_t least = boxes_.size();
        float growth = std::numeric_limits<float>::infinity();
        for (size_t i = 0; i < boxes_.size(); ++i) {
            const Box3 both = box_union(boxes_[i], box);
            if (both == boxes_[i]) return;
            const float grows = sides(both) - sides(boxes_[i]);
            if (!(grows < growth)) continue;
            growth = grows;
            least = i;
        }
        if (boxes_.size() < kMost)
            boxes_.push_back(box);
        else if (least < boxes_.size())
            boxes_[least] = box_union(boxes_[least], box);
        else
            boxes_.assign(1, box_union(boxes_[0], box));  // without an end, like all that are here
    }
    const std::vector<Box3>& boxes() const { return boxes_; }
    void clear() { boxes_.clear(); }

private:
    // Not the volume: flat boxes have none.
    static float sides(const Box3& b) { return b.max.x - b.min.x + b.max.y - b.min.y + b.max.z - b.min.z; }

    std::vector<Box3> boxes_;
};

}  // namespace kiln::scene
