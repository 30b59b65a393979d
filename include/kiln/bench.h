// SPDX-License-Identifier: MIT
// Benchmarks: how fast this machine does the engine's work, beside other libraries doing the same where they are installed, and
// beside what the processor could do at best. Every row's result is checked against the same work done the slow way.
#pragma once

#include <kiln/result.h>

#include <cstdint>
#include <functional>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace kiln {

/// A family of rows: `kiln bench NAME`.
struct BenchInfo {
    std::string_view name;
    std::string_view about;              ///< one line
    std::vector<std::string_view> rows;  ///< their names, in order
};
std::vector<BenchInfo> bench_list();

inline constexpr uint32_t kMostBenchEdits = 1000000;

/// The scene family of `bench field` and how it is measured.
struct BenchOptions {
    std::vector<int> kinds{0};  ///< 0: pebbles, 1: carve (three of ten edits subtract), 2: cluster
    uint32_t seed = 5;
    uint32_t count = 1000;  ///< edits, 1 … kMostBenchEdits
    int threads = 0;        ///< 0: one thread, and rows for every core beside; otherwise just that many
    int runs = 7;           ///< a row is the least of so many, taken in turn with its peer's
    int resolution = 256;   ///< voxels along a side of [-1, 1]³
    std::vector<std::pair<int, int>> sizes{{480, 270}};  ///< of the pictures of `bench frame`, pixels
    std::string scene;  ///< a scene file or a bundled scene's name for `bench field` instead of kinds, seed and count
};

inline constexpr double kNoBenchValue = std::numeric_limits<double>::quiet_NaN();

struct BenchRow {
    std::string name;
    double value = 0;
    std::string unit;
    bool more_is_better = false;
    int threads = 1;
    std::string peer;  ///< who did the same, with "(anchor)" where the number is a published one; empty: nobody
    double peer_value = kNoBenchValue;  ///< in `unit`
    double ratio = kNoBenchValue;       ///< above 1: Kiln is better
    double roof_ratio = kNoBenchValue;  ///< share of what the processor could do, 1 at best
    std::string checksum;               ///< of what was computed
    int kind = 0;
    uint32_t seed = 0, count = 0;
    std::string scene;    ///< where it was not one of the kinds
    double bricks = 0;    ///< that the row baked; of rows of edits, a mean edit's
    uint64_t texels = 0;  ///< in them
};

struct BenchReport {
    std::string machine;  ///< processor, instruction set, cores
    double load =
        0;  ///< of the last minute, the larger of before and after; above the threads used, figures are worse than they could be
    std::vector<BenchRow> rows;
};

/// Called now and then with what is being measured and how much of all is done, [0, 1].
using BenchProgress = std::function<void(std::string_view stage, double done)>;

/// Runs the named families or rows ("field", "field/rays"; none: everything). Fails on an unknown name (Usage), and when a result
/// differs from the same work done the slow way (Failed). Takes seconds to minutes. Owner's thread; nothing else should run.
Result<BenchReport> run_bench(std::span<const std::string> names, const BenchOptions& options,
                              const BenchProgress& progress = {});

}  // namespace kiln
