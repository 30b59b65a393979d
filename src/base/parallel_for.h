// SPDX-License-Identifier: MIT
// Loops over threads. Each i writes only its own slot, so results do not depend on the number of workers or on who ran what.
#pragma once

#include "base/assert.h"

#include <concepts>
#include <limits>
#include <memory>
#include <type_traits>
#include <utility>

namespace kiln {

/// Cores this process may use.
int hardware_workers();

namespace detail {
// A function, without its type: called once an index, from any worker.
struct LoopBody {
    void* object;
    void (*call)(void* object, int i);
};
void parallel_for(int count, int workers, int grain, LoopBody body);
}  // namespace detail

/// Runs fn(i) for every i in [0, count), on at most `workers` threads (0: every core), and returns when all are done.
/// May be called from inside another parallel_for. The caller's thread takes part; with one worker it alone runs, in order.
/// `grain` consecutive indices are one piece of work: raise it where fn takes less than a microsecond.
template <std::integral Count, typename Fn>
requires std::is_invocable_v<Fn&, int>
void parallel_for(Count count, int workers, Fn&& fn, int grain = 1) {
    KILN_ASSERT(std::cmp_less_equal(count, std::numeric_limits<int>::max()), "{} indices", count);
    using Body = std::remove_reference_t<Fn>;
    void* object = const_cast<void*>(static_cast<const void*>(std::addressof(fn)));
    detail::parallel_for(int(count), workers, grain, {object, [](void* o, int i) { (*static_cast<Body*>(o))(i); }});
}

template <std::integral Count, typename Fn>
requires std::is_invocable_v<Fn&, int>
void parallel_for(Count count, Fn&& fn) { parallel_for(count, 0, std::forward<Fn>(fn)); }

}  // namespace kiln
