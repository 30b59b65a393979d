// SPDX-License-Identifier: MIT
#include "base/parallel_for.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>

#ifdef __SANITIZE_THREAD__
// The sanitizer cannot see into libtbb: say what it guarantees, that work follows its start and the end follows all work.
extern "C" void __tsan_acquire(void*);
extern "C" void __tsan_release(void*);
#else
static void __tsan_acquire(void*) {}
static void __tsan_release(void*) {}
#endif

namespace kiln {

int hardware_workers() {
    static const int count = tbb::this_task_arena::max_concurrency();
    return count;
}

namespace detail {

void parallel_for(int count, int workers, int grain, LoopBody body) {
    KILN_ASSERT(workers >= 0 && grain >= 1, "{} workers, grain {}", workers, grain);
    if (count <= 0) return;
    if (workers == 1 || count <= grain) {
        for (int i = 0; i < count; ++i) body.call(body.object, i);
        return;
    }
    char start = 0, end = 0;
    __tsan_release(&start);
    const auto loop = [&] {
        tbb::parallel_for(tbb::blocked_range<int>(0, count, size_t(grain)), [&](const tbb::blocked_range<int>& range) {
            __tsan_acquire(&start);
            for (int i = range.begin(); i != range.end(); ++i) body.call(body.object, i);
            __tsan_release(&end);
        });
    };
    // More workers than cores are allowed, so that tests of "any number of workers" mean something on a small machine.
    tbb::task_arena arena(workers == 0 ? tbb::task_arena::automatic : workers);
    arena.execute(loop);
    __tsan_acquire(&end);
}

}  // namespace detail
}  // namespace kiln
