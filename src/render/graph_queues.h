// SPDX-License-Identifier: MIT
// What the passes of a plan wait for, pass by pass: for devices with several queues, and to see how short a frame could be on them.
// A plan's barriers stand between levels of one queue. On several a pass starts once those that it depends on have ended, wherever they ran:
// those that wrote what it reads, that touched what it writes, that had an image in another layout, and that held the memory it takes over.
#pragma once

#include "render/graph_plan.h"

namespace kiln::render {

// Of each pass the earlier ones that it must come after, in order, without those that others of them come after anyway.
std::vector<std::vector<uint32_t>> dependencies(const Plan& plan);

// A pass starts once another, of another queue, has ended.
struct QueueWait {
    uint32_t pass = 0, on = 0;
    friend bool operator==(const QueueWait&, const QueueWait&) = default;
};
// What must be waited for where pass i is on queue queues[i] and every queue runs its passes in the plan's order. A signal of a pass tells of
// all before it on its queue too, and a wait holds for all after it. No wait follows from the others.
std::vector<QueueWait> queue_waits(const Plan& plan, std::span<const uint32_t> queues);

// The longest way through dependencies(), where pass i takes lasts[i]: what the frame takes with as many queues as it likes.
double critical_path(std::span<const std::vector<uint32_t>> dependencies, std::span<const double> lasts);

}  // namespace kiln::render
