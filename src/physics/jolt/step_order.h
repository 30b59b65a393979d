// SPDX-License-Identifier: MIT
// Jolt hands work to its threads and takes it back in its own library, which a thread sanitizer does not see. Under one, our code says
// what that hand-over promises: what Jolt calls of ours in a step sees what was written before the step, and who waited for the step
// sees what the called ones wrote. Otherwise nothing. Calls among each other stay unordered: their races are found.
#pragma once

#ifdef __SANITIZE_THREAD__
#include <atomic>

namespace kiln::physics {

inline std::atomic<unsigned> step_begun{0}, call_done{0};

inline void step_begins() { step_begun.fetch_add(1, std::memory_order_release); }
inline void step_ended() { (void)call_done.load(std::memory_order_acquire); }

/// Lives as long as a call by Jolt.
struct CallInStep {
    CallInStep() { (void)step_begun.load(std::memory_order_acquire); }
    ~CallInStep() { call_done.fetch_add(1, std::memory_order_release); }
};

}  // namespace kiln::physics
#else
namespace kiln::physics {

inline void step_begins() {}
inline void step_ended() {}
struct CallInStep {
    ~CallInStep() {}  // not trivial: a variable of it counts as used
};

}  // namespace kiln::physics
#endif
