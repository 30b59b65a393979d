// SPDX-License-Identifier: MIT
#include "field/brick_pool.h"

#include <gtest/gtest.h>

namespace kiln::field {
namespace {

TEST(BrickPool, HandsOutTheLowestFreeSlot) {
    BrickPool pool(5);
    for (uint32_t i = 0; i < 4; ++i) EXPECT_EQ(pool.allocate(), i);
    pool.release(2);
    pool.release(0);
    EXPECT_EQ(pool.in_use(), 2u);
    EXPECT_EQ(pool.allocate(), 0u);
    EXPECT_EQ(pool.allocate(), 2u);
    EXPECT_EQ(pool.allocate(), 4u);
    EXPECT_EQ(pool.slot_count(), 5u);
    EXPECT_EQ(pool.allocate(), kNoSlot);
    EXPECT_EQ(pool.allocate(), kNoSlot);
    EXPECT_EQ(pool.refused(), 2u);
    pool.release(3);
    EXPECT_EQ(pool.allocate(), 3u);
}

TEST(BrickPool, ACopyKeepsItsOwnState) {
    BrickPool pool(100);
    for (uint32_t i = 0; i < 70; ++i) EXPECT_EQ(pool.allocate(), i);
    BrickPool copy = pool;
    pool.release(65);
    EXPECT_TRUE(copy.used(65));
    EXPECT_FALSE(pool.used(65));
    EXPECT_EQ(copy.allocate(), 70u);
    EXPECT_EQ(pool.allocate(), 65u);
    EXPECT_EQ(pool.allocate(), 70u);
}

TEST(BrickPoolDeathTest, ASlotGivenBackTwiceStops) {
    BrickPool pool(4);
    pool.allocate();
    pool.release(0);
    EXPECT_DEATH(pool.release(0), "not in use");
}

}  // namespace
}  // namespace kiln::field
