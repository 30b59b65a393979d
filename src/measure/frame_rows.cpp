// SPDX-License-Identifier: MIT
// `bench frame`: the passes of a frame of bundled scenes. The first two pictures, which make pipelines and bring bricks, do not count; a pass is
// the least of the others. All pictures must be the same to the bit.

#include "measure/bench_run.h"

#include "measure/frame_work.h"

#include "base/log.h"

#include <algorithm>

namespace kiln::measure {
namespace {

constexpr std::string_view kScenes[] = {"quarry", "workbench"};
constexpr int kWarmUp = 2;

void measure_size(BenchRun& run, FrameWork& work, std::string_view scene, int width, int height) {
    std::vector<std::pair<std::string, double>> least;
    uint64_t checksum = 0, other = 0;
    for (int i = 0; i < kWarmUp + run.options.runs; ++i) {
        const auto hash = work.draw(width, height);
        if (!hash) return run.fail(hash.error());
        if (i == 0) checksum = other = *hash;
        if (*hash != checksum) other = *hash;
        if (i < kWarmUp) continue;
        const auto passes = work.passes();
        if (i == kWarmUp) least = passes;
        for (const auto& [name, ms] : passes)
            for (auto& [known, best] : least)
                if (known == name) best = std::min(best, ms);
    }
    for (const auto& [pass, ms] : least) {
        if (pass.starts_with("copy ") || pass.starts_with("clear ")) continue;  // they are in "all"
        BenchRow row;
        row.name = formatted("frame/{}/{}x{}/{}", scene, width, height, pass);
        row.value = ms;
        row.unit = "ms";
        run.add_checked(std::move(row), checksum, other);
    }
}

void run_frame(BenchRun& run) {
    if (std::ranges::none_of(kScenes, [&](std::string_view scene) { return run.wanted("frame", scene); })) return;
    auto work = FrameWork::create();
    if (!work) return log::warn("bench frame: left out, {}", work.error().message);
    for (const std::string_view scene : kScenes) {
        if (!run.wanted("frame", scene)) continue;
        run.stage(formatted("frame/{}", scene));
        if (auto loaded = work->load(scene); !loaded) return run.fail(loaded.error());
        for (const auto& [width, height] : run.options.sizes) measure_size(run, *work, scene, width, height);
    }
}

}  // namespace

BenchFamily frame_family() {
    return {{"frame", "passes of one picture of a bundled scene, at every --size", {kScenes[0], kScenes[1]}},
            run_frame};
}

}  // namespace kiln::measure
