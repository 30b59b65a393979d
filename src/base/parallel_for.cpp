// SPDX-License-Identifier: MIT
#include "base/parallel_for.h"

#include <tbb/blocked_range.h>
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <thread>
#include <vector>

namespace kiln {

int hardware_workers() {
    static const int count = tbb::this_task_arena::max_concurrency();
    return count;
}

namespace detail {

#ifdef __SANITIZE_THREAD__

// Debian's libtbb is not instrumented: the sanitizer would report its hand-overs, and a list that silences those silences
// the loop bodies too. So under the thread sanitizer the same bodies run on plain threads.
static void run(int count, int workers, int grain, LoopBody body) {
    std::atomic<int> next = 0;
    const auto work = [&] {
        for (int from = next.fetch_add(grain); from < count; from = next.fetch_add(grain)) {
            for (int i = from; i < std::min(from + grain, count); ++i) body.call(body.object, i);
        }
    };
    std::vector<std::thread> others;
    const int threads = std::min(workers == 0 ? std::max(4, hardware_workers()) : workers, (count - 1) / grain + 1);
    for (int i = 1; i < threads; ++i) others.emplace_back(work);
    work();
    for (std::thread& other : others) other.join();
}

#else

static void run(int count, int workers, int grain, LoopBody body) {
    // More workers than cores are allowed, so that tests of "any number of workers" mean something on a small machine.
    static const tbb::global_control many(tbb::global_control::max_allowed_parallelism,
                                          size_t(std::max(64, hardware_workers())));
    tbb::task_arena arena(workers == 0 ? tbb::task_arena::automatic : workers);
    arena.execute([&] {
        tbb::parallel_for(tbb::blocked_range<int>(0, count, size_t(grain)), [&](const tbb::blocked_range<int>& range) {
            for (int i = range.begin(); i != range.end(); ++i) body.call(body.object, i);
        });
    });
}

#endif

void parallel_for(int count, int workers, int grain, LoopBody body) {
    KILN_ASSERT(workers >= 0 && grain >= 1, "{} workers, grain {}", workers, grain);
    if (count <= 0) return;
    if (workers == 1 || count <= grain) {
        for (int i = 0; i < count; ++i) body.call(body.object, i);
        return;
    }
    run(count, workers, grain, body);
}

}  // namespace detail
}  // namespace kiln
