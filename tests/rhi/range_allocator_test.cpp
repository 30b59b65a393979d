// SPDX-License-Identifier: MIT
#include "rhi/range_allocator.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <vector>

namespace kiln::rhi {
namespace {

struct Range {
    uint64_t begin, size;
};

// Any order of taking and giving back: ranges lie inside, aligned, apart from each other; when all are back, one free
// range is left.
RC_GTEST_PROP(RangeAllocator, NeverHandsOutTheSameByteTwice, ()) {
    constexpr uint64_t kSize = 1 << 16;
    RangeAllocator a(kSize);
    std::vector<Range> live;
    const int steps = *rc::gen::inRange(1, 200);
    for (int i = 0; i < steps; ++i) {
        if (!live.empty() && *rc::gen::inRange(0, 3) == 0) {
            const size_t k = *rc::gen::inRange<size_t>(0, live.size());
            a.release(live[k].begin);
            live.erase(live.begin() + ptrdiff_t(k));
            continue;
        }
        const uint64_t size = *rc::gen::inRange<uint64_t>(1, 9000);
        const uint64_t alignment = 1ull << *rc::gen::inRange(0, 13);
        const auto begin = a.allocate(size, alignment);
        if (!begin) continue;
        RC_ASSERT(*begin % alignment == 0);
        RC_ASSERT(*begin + size <= kSize);
        for (const Range& r : live) RC_ASSERT(*begin >= r.begin + r.size || r.begin >= *begin + size);
        live.push_back({*begin, size});
    }
    uint64_t used = 0;
    for (const Range& r : live) used += r.size;
    RC_ASSERT(a.free_bytes() == kSize - used);
    for (const Range& r : live) a.release(r.begin);
    RC_ASSERT(a.empty());
    RC_ASSERT(a.free_ranges() == 1u);
    RC_ASSERT(a.allocate(kSize, 1) == std::optional<uint64_t>(0));
}

TEST(RangeAllocator, FullIsNothing) {
    RangeAllocator a(100);
    EXPECT_EQ(a.allocate(101, 1), std::nullopt);
    EXPECT_EQ(a.allocate(60, 1), 0u);
    EXPECT_EQ(a.allocate(41, 1), std::nullopt);
    EXPECT_EQ(a.allocate(36, 64), 64u);
    EXPECT_EQ(a.allocate(5, 1), std::nullopt);
    EXPECT_EQ(a.allocate(4, 1), 60u);
}

}  // namespace
}  // namespace kiln::rhi
