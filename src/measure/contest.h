// SPDX-License-Identifier: MIT
// Fair clocks: contestants take turns, so that a neighbour's load hits all of them, and each is judged by its best turn.
#pragma once

#include <chrono>
#include <functional>
#include <vector>

namespace kiln::measure {

/// Seconds that `work` takes.
template <typename Work>
double seconds_of(Work&& work) {
    const auto start = std::chrono::steady_clock::now();
    work();
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// One contestant: does its work once and answers the seconds that count, leaving out what it prepares.
using Contestant = std::function<double()>;

/// The least of `runs` turns of each.
inline std::vector<double> least_seconds(int runs, const std::vector<Contestant>& contestants) {
    std::vector<double> out(contestants.size(), 1e300);
    for (int run = 0; run < runs; ++run) {
        for (size_t i = 0; i < contestants.size(); ++i) {
            const double seconds = contestants[i]();
            if (seconds < out[i]) out[i] = seconds;
        }
    }
    return out;
}

}  // namespace kiln::measure
