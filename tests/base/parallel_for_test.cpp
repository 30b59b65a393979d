// SPDX-License-Identifier: MIT
// Starts threads.
#include "base/parallel_for.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <thread>
#include <vector>

using kiln::parallel_for;

namespace {

TEST(ParallelFor, RunsEveryIndexOnceForAnyNumberOfWorkers) {
    for (const int workers : {0, 1, 2, 3, 8}) {
        for (const int count : {0, 1, 2, 1000}) {
            for (const int grain : {1, 7, 5000}) {
                std::vector<int> runs(size_t(count), 0);
                parallel_for(
                    count, workers, [&](int i) { runs[size_t(i)]++; }, grain);
                for (const int r : runs) EXPECT_EQ(r, 1) << count << " by " << workers << " workers, grain " << grain;
            }
        }
    }
}

TEST(ParallelFor, SameBytesForAnyNumberOfWorkers) {
    const auto make = [](int workers) {
        std::vector<float> out(5000);
        parallel_for(out.size(), workers, [&](int i) { out[size_t(i)] = std::sin(float(i)) * 0.1f; });
        return out;
    };
    const std::vector<float> one = make(1);
    for (const int workers : {0, 2, 3, 8}) EXPECT_EQ(make(workers), one) << workers << " workers";
}

TEST(ParallelFor, NeverUsesMoreThreadsThanWorkers) {
    for (const int workers : {1, 2, 4}) {
        std::atomic<int> inside = 0, most = 0;
        parallel_for(200, workers, [&](int) {
            const int now = ++inside;
            int seen = most;
            while (now > seen && !most.compare_exchange_weak(seen, now)) {}
            std::this_thread::yield();
            --inside;
        });
        EXPECT_LE(most, workers);
    }
}

TEST(ParallelFor, MayUseMoreThreadsThanCores) {
    const int workers = kiln::hardware_workers() + 2;
    std::atomic<int> inside = 0;
    std::atomic<bool> all_met = false;
    parallel_for(workers, workers, [&](int) {  // each waits until all are inside, or gives up
        ++inside;
        for (int i = 0; i < 2000 && !all_met; ++i) {
            if (inside == workers) all_met = true;
            std::this_thread::sleep_for(std::chrono::milliseconds(1));
        }
        --inside;
    });
    EXPECT_TRUE(all_met) << "never " << workers << " at once";
}

TEST(ParallelFor, MayBeNested) {
    std::vector<int> sums(16, 0);
    parallel_for(16, 4, [&](int i) {
        std::vector<int> part(64, 0);
        parallel_for(64, 2, [&](int j) { part[size_t(j)] = i * j; });
        for (const int p : part) sums[size_t(i)] += p;
    });
    for (int i = 0; i < 16; ++i) EXPECT_EQ(sums[size_t(i)], i * 63 * 32);
}

TEST(ParallelFor, OneWorkerRunsInOrderOnTheCallersThread) {
    std::vector<int> order;
    const auto caller = std::this_thread::get_id();
    parallel_for(100, 1, [&](int i) {
        EXPECT_EQ(std::this_thread::get_id(), caller);
        order.push_back(i);
    });
    for (int i = 0; i < 100; ++i) EXPECT_EQ(order[size_t(i)], i);
}

}  // namespace
