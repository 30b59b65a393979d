// SPDX-License-Identifier: MIT

#include "physics/triggers.h"

#include <algorithm>

namespace kiln::physics {

TriggerId Triggers::add(std::shared_ptr<const SdfShape> volume, const Pose& pose) {
    uint32_t index = uint32_t(triggers_.size());
    if (free_.empty()) {
        triggers_.emplace_back();
    } else {
        index = free_.back();
        free_.pop_back();
    }
    Trigger& t = triggers_[index];
    t.volume = std::move(volume);
    t.pose = pose;
    return {index, t.generation};
}

void Triggers::remove(TriggerId id) {
    if (id.index >= triggers_.size()) return;
    Trigger& t = triggers_[id.index];
    if (t.generation != id.generation || t.volume == nullptr) return;
    for (const BodyId body : t.in) gone_.push_back({id, body, false});
    t.in.clear();
    t.volume = nullptr;
    ++t.generation;
    free_.push_back(id.index);
}

void Triggers::update(const World& world) {
    events_.swap(gone_);
    gone_.clear();
    for (uint32_t i = 0; i < triggers_.size(); ++i) {
        Trigger& t = triggers_[i];
        if (t.volume == nullptr) continue;
        std::vector<BodyId> now = world.overlap(*t.volume, t.pose);
        std::erase_if(now, [&](BodyId b) { return world.motion(b) == Motion::Static; });
        std::sort(now.begin(), now.end());
        const auto tell = [&](const std::vector<BodyId>& of, const std::vector<BodyId>& not_of, bool entered) {
            for (const BodyId b : of)
                if (!std::binary_search(not_of.begin(), not_of.end(), b))
                    events_.push_back({{i, t.generation}, b, entered});
        };
        tell(t.in, now, false);
        tell(now, t.in, true);
        t.in = std::move(now);
    }
    std::stable_sort(events_.begin(), events_.end(), [](const TriggerEvent& a, const TriggerEvent& b) {
        return a.trigger != b.trigger ? a.trigger < b.trigger : a.body < b.body;
    });
}

}  // namespace kiln::physics
