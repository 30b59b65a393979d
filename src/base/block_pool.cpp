// SPDX-License-Identifier: MIT
// Sizes are classes of 64 bytes up to kLargest; larger blocks come from the heap. A thread keeps at most two batches of each class, and
// what is left of the slab that it took last. Slabs of larger classes are huge pages where the system has them: bricks are read all over.

#include "base/block_pool.h"

#include <algorithm>
#include <array>
#include <mutex>
#include <new>
#include <vector>
#if defined(__linux__)
#include <sys/mman.h>
#endif

namespace kiln {
namespace {

constexpr size_t kStep = 64;
constexpr size_t kLargest = 4096;
constexpr size_t kClasses = kLargest / kStep;
constexpr size_t kBatch = 64;
constexpr size_t kSlabBytes = 64 << 10, kHugeBytes = 2 << 20;
constexpr size_t kHugeFrom = 512 / kStep;  // the first class whose slabs are huge

constexpr size_t slab_bytes(size_t c) { return c >= kHugeFrom ? kHugeBytes : kSlabBytes; }

std::byte* take_slab(size_t c) {
    if (c < kHugeFrom) return static_cast<std::byte*>(::operator new(kSlabBytes));
    void* const slab = ::operator new(kHugeBytes, std::align_val_t(kHugeBytes));
#if defined(__linux__)
    (void)madvise(slab, kHugeBytes, MADV_HUGEPAGE);  // a wish: small pages do as well
#endif
    return static_cast<std::byte*>(slab);
}

// Under sanitizers every block is the heap's own, so that a use after its end is seen.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kPooled = false;
#else
constexpr bool kPooled = true;
#endif

using Blocks = std::vector<void*>;

// What no thread holds. Never destroyed: threads may end after it would be.
struct Common {
    std::mutex mutex;
    std::array<Blocks, kClasses> free;
};
Common& common() {
    static Common* const one = new Common;
    return *one;
}

struct Cache {
    std::array<Blocks, kClasses> free;

    Cache() { common(); }
    ~Cache() {
        const std::lock_guard lock(common().mutex);
        for (size_t c = 0; c < kClasses; ++c) {
            Blocks& to = common().free[c];
            to.insert(to.end(), free[c].begin(), free[c].end());
        }
    }

    void fill(size_t c) {
        {
            const std::lock_guard lock(common().mutex);
            Blocks& from = common().free[c];
            const size_t n = std::min(from.size(), kBatch);
            free[c].insert(free[c].end(), from.end() - ptrdiff_t(n), from.end());
            from.resize(from.size() - n);
        }
        if (!free[c].empty()) return;
        const size_t bytes = (c + 1) * kStep, count = slab_bytes(c) / bytes;
        std::byte* const slab = take_slab(c);
        for (size_t i = count; i-- > 0;) free[c].push_back(slab + i * bytes);
    }

    void spill(size_t c) {
        const std::lock_guard lock(common().mutex);
        Blocks& to = common().free[c];
        to.insert(to.end(), free[c].end() - ptrdiff_t(kBatch), free[c].end());
        free[c].resize(free[c].size() - kBatch);
    }
};

thread_local Cache cache;

}  // namespace

void* take_block(size_t bytes) {
    if (!kPooled || bytes > kLargest || bytes == 0) return ::operator new(bytes);
    const size_t c = (bytes - 1) / kStep;
    Blocks& blocks = cache.free[c];
    if (blocks.empty()) cache.fill(c);
    void* const out = blocks.back();
    blocks.pop_back();
    return out;
}

void give_block(void* block, size_t bytes) {
    if (!kPooled || bytes > kLargest || bytes == 0) {
        ::operator delete(block);
        return;
    }
    const size_t c = (bytes - 1) / kStep;
    cache.free[c].push_back(block);
    if (cache.free[c].size() >= 2 * kBatch + slab_bytes(c) / ((c + 1) * kStep)) cache.spill(c);
}

}  // namespace kiln
