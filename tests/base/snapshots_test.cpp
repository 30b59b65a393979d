// SPDX-License-Identifier: MIT
// Starts threads.
// What snapshots are made of: what one holder changes, another never sees.

#include "base/append_array.h"
#include "base/block_pool.h"
#include "base/paged_array.h"
#include "base/shared.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <thread>
#include <utility>
#include <vector>

namespace kiln {
namespace {

TEST(Shared, WritesInPlaceWhenAloneAndToACopyWhenNot) {
    auto a = Shared<std::vector<int>>::make(std::vector<int>{1, 2});
    const std::vector<int>* const where = a.get();
    a.write().push_back(3);
    EXPECT_EQ(a.get(), where);
    const Shared<std::vector<int>> b = a;
    a.write().push_back(4);
    EXPECT_EQ(b->size(), 3u);
    EXPECT_EQ(a->size(), 4u);
    EXPECT_EQ(b.get(), where);
    EXPECT_FALSE(a == b);
    Shared<std::vector<int>> c = b;
    EXPECT_TRUE(c.renew().empty());  // a vector has an initialiser of its own
    EXPECT_EQ(b->size(), 3u);
    Shared<int> none;
    EXPECT_FALSE(none);
    EXPECT_EQ(none.write(), 0);
}

TEST(Shared, HoldersOnOtherThreadsKeepTheirValue) {
    auto value = Shared<std::vector<int>>::make(std::vector<int>(1000, 7));
    std::vector<std::thread> readers;
    for (int t = 0; t < 3; ++t) {
        readers.emplace_back([held = value] {
            Shared<std::vector<int>> mine = held;
            EXPECT_EQ(std::accumulate(mine->begin(), mine->end(), 0), 7000);
        });
    }
    for (int i = 0; i < 100; ++i) value.write()[size_t(i)] = i;
    for (std::thread& t : readers) t.join();
}

TEST(BlockPool, BlocksOfEverySizeAreApartAndWholeOnEveryThread) {
    std::vector<std::thread> threads;
    for (int t = 0; t < 3; ++t) {
        threads.emplace_back([t] {
            std::vector<std::pair<unsigned char*, size_t>> held;
            for (size_t round = 0; round < 3; ++round) {
                for (size_t i = 0; i < 1500; ++i) {
                    const size_t bytes = 1 + (i * 37 + size_t(t)) % 5000;
                    auto* const block = static_cast<unsigned char*>(take_block(bytes));
                    ASSERT_EQ(reinterpret_cast<uintptr_t>(block) % kBlockAlign, 0u);
                    std::fill_n(block, bytes, static_cast<unsigned char>(i + size_t(t)));
                    held.emplace_back(block, bytes);
                }
                for (size_t i = 0; i < held.size(); ++i) {
                    const auto [block, bytes] = held[i];
                    ASSERT_EQ(block[0], static_cast<unsigned char>(i + size_t(t)));
                    ASSERT_EQ(block[bytes - 1], static_cast<unsigned char>(i + size_t(t)));
                    give_block(block, bytes);
                }
                held.clear();
            }
        });
    }
    for (std::thread& t : threads) t.join();
}

TEST(AppendArray, ACopyKeepsItsLengthWhileTheNewestGrowsInPlace) {
    AppendArray<int> a;
    a.append({1, 2, 3});
    const AppendArray<int> then = a;
    const int* const where = a.data();
    for (int i = 4; i < 40; ++i) a.push_back(i);
    EXPECT_EQ(a.data(), where);
    EXPECT_TRUE(a.extends(then));
    EXPECT_EQ(then.size(), 3u);
    AppendArray<int> fork = then;
    fork.push_back(99);
    EXPECT_NE(fork.data(), where) << "the place after the third is taken";
    EXPECT_EQ(a[3], 4);
    EXPECT_EQ(fork[3], 99);
    EXPECT_FALSE(fork.extends(a));
    for (int i = 0; i < 1000; ++i) a.push_back(i);
    EXPECT_EQ(then[2], 3);
    EXPECT_EQ(a.size(), 1039u);
    EXPECT_EQ(a.subspan(36, 3)[1], 38) << "moved with all it held";
}

TEST(PagedArray, ChangesOnePageAndSharesTheRest) {
    PagedArray<int, 8> a(-1);
    a.resize_pages(200);
    EXPECT_EQ(a[1599], -1);
    EXPECT_EQ(a.find(3), nullptr);
    a.write(25) = 5;
    EXPECT_EQ(a[24], -1);
    const PagedArray<int, 8> then = a;
    a.write(26) = 6;
    a.write(1000) = 7;
    EXPECT_EQ(then[26], -1);
    EXPECT_EQ(a[25], 5);
    EXPECT_FALSE(a.same_page(then, 3));
    EXPECT_TRUE(a.same_page(then, 4));
    EXPECT_FALSE(a.same_page(then, 125));
    a.resize_pages(300);
    EXPECT_EQ(a[2399], -1);
    EXPECT_EQ(then.size(), 1600u);
    const PagedArray<int, 8> later = a;
    for (const size_t i : {0u, 26u, 1000u, 2047u, 2048u, 2399u}) a.write(i) = 8;
    std::vector<size_t> pages;
    a.each_other_page(later, [&](size_t page) { pages.push_back(page); });
    EXPECT_EQ(pages, (std::vector<size_t>{0, 3, 125, 255, 256, 299}));
    EXPECT_EQ(later[2399], -1);
}

TEST(PagedArray, PagesThatHoldSharedsKeepTheirCount) {
    struct Held {
        Shared<int> value;
        void prefetch() const { value.prefetch(); }
    };
    const auto one = Shared<int>::make(7);
    PagedArray<Held, 4> a;
    a.resize_pages(20);
    for (size_t i = 0; i < 80; i += 3) a.write(i).value = one;
    PagedArray<Held, 4> b = a;
    a.write(0).value.write() = 8;
    b.write(3).value = {};
    EXPECT_EQ(*b[0].value, 7);
    EXPECT_EQ(*a[0].value, 8);
    EXPECT_EQ(a[3].value, one);
    EXPECT_FALSE(b[3].value);
    EXPECT_FALSE(b[1].value);
}

}  // namespace
}  // namespace kiln
