// SPDX-License-Identifier: MIT
// Triggers: volumes that tell which bodies come in and go out. A body is in one while they share a point; what stands never is.
#pragma once

#include "physics/physics.h"

#include <memory>
#include <span>
#include <vector>

namespace kiln::physics {

using TriggerId = Id<struct TriggerTag>;

struct TriggerEvent {
    TriggerId trigger;
    BodyId body;
    bool entered = false;  ///< else it left: by moving, or because one of the two is no more
    friend bool operator==(const TriggerEvent&, const TriggerEvent&) = default;
};

/// Owner's thread.
class Triggers {
public:
    TriggerId add(std::shared_ptr<const SdfShape> volume, const Pose& pose);
    /// What is in it leaves with the next update().
    void remove(TriggerId id);
    /// After a step.
    void update(const World& world);
    /// Of the last update, by trigger, then by body.
    std::span<const TriggerEvent> events() const { return events_; }

private:
    struct Trigger {
        std::shared_ptr<const SdfShape> volume;
        Pose pose;
        uint32_t generation = 0;
        std::vector<BodyId> in;  // ascending
    };
    std::vector<Trigger> triggers_;
    std::vector<uint32_t> free_;
    std::vector<TriggerEvent> gone_;  // leave with the next update
    std::vector<TriggerEvent> events_;
};

}  // namespace kiln::physics
