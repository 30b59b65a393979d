// SPDX-License-Identifier: MIT
#include "rhi/slot_map.h"

#include <gtest/gtest.h>

namespace kiln::rhi {
namespace {

TEST(SlotMap, OldHandlesFindNothingAfterTheirSlotIsReused) {
    SlotMap<BufferHandle, int> map;
    const BufferHandle old = map.insert(1);
    EXPECT_EQ(map.remove(old), 1);
    EXPECT_EQ(map.get(old), nullptr);
    const BufferHandle fresh = map.insert(2);
    EXPECT_EQ(fresh.index, old.index);
    EXPECT_NE(fresh.generation, old.generation);
    EXPECT_EQ(map.get(old), nullptr);
    EXPECT_EQ(map.remove(old), std::nullopt);
    ASSERT_NE(map.get(fresh), nullptr);
    EXPECT_EQ(*map.get(fresh), 2);
    EXPECT_EQ(map.size(), 1u);
    EXPECT_EQ(map.get({}), nullptr);
    EXPECT_EQ(map.get({77, 1}), nullptr);
}

TEST(SlotMap, ReferencesStayWhereTheyAre) {
    SlotMap<BufferHandle, int> map;
    const BufferHandle first = map.insert(5);
    const int* place = map.get(first);
    for (int i = 0; i < 10000; ++i) map.insert(i);
    EXPECT_EQ(map.get(first), place);
    EXPECT_EQ(*place, 5);
}

}  // namespace
}  // namespace kiln::rhi
