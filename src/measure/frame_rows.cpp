// SPDX-License-Identifier: MIT
// `bench frame`: the passes of a frame of bundled scenes. The first two pictures, which make pipelines and bring bricks, do not count; a pass is
// the least of the others. All pictures must be the same to the bit. "movers": a thousand instances against the same things as edits of the world, each
// pass beside that of the other, drawn in turn.

#include "measure/bench_run.h"

#include "measure/frame_work.h"
#include "measure/thousand.h"

#include "base/log.h"

#include <algorithm>
#include <array>

namespace kiln::measure {
namespace {

constexpr std::string_view kScenes[] = {"quarry", "workbench"}, kMovers = "movers";
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

// Those passes together that rays of this kind go through, ms. Their names are Renderer::stats()'s.
double ms_of(const FrameWork& work, std::string_view kind) {
    double out = 0;
    for (const auto& [name, ms] : work.passes())
        if (name.starts_with(kind)) out += ms;
    return out;
}

// Rows have no peer of their own: it is the still world.
void measure_movers(BenchRun& run, FrameWork& still, FrameWork& moving, std::string_view view, int width, int height) {
    constexpr std::string_view kKinds[] = {"march", "resolve", "ao", "shadow", "all"};
    std::array<double, std::size(kKinds)> least, least_still;
    least.fill(1e300);
    least_still.fill(1e300);
    uint64_t checksum = 0, other = 0;
    for (int i = 0; i < kWarmUp + run.options.runs; ++i) {
        const auto of_still = still.draw(width, height), of_moving = moving.draw(width, height);
        if (!of_still) return run.fail(of_still.error());
        if (!of_moving) return run.fail(of_moving.error());
        const uint64_t hash = hash_combine(*of_still, *of_moving);
        if (i == 0) checksum = other = hash;
        if (hash != checksum) other = hash;
        if (i < kWarmUp) continue;
        for (size_t k = 0; k < std::size(kKinds); ++k) {
            least[k] = std::min(least[k], ms_of(moving, kKinds[k]));
            least_still[k] = std::min(least_still[k], ms_of(still, kKinds[k]));
        }
    }
    for (size_t k = 0; k < std::size(kKinds); ++k) {
        BenchRow row;
        row.name = formatted("frame/{}/{}/{}x{}/{}", kMovers, view, width, height, kKinds[k]);
        row.value = least[k];
        row.unit = "ms";
        row.peer = "as edits of the world";
        row.peer_value = least_still[k];
        row.ratio = least_still[k] / least[k];
        run.add_checked(std::move(row), checksum, other);
    }
}

void run_movers(BenchRun& run) {
    auto still = FrameWork::create(), moving = FrameWork::create();
    if (!still || !moving) return log::warn("bench frame/{}: left out, nothing can draw", kMovers);
    for (const bool from_above : {false, true}) {
        const std::string_view view = from_above ? "above" : "among";
        run.stage(formatted("frame/{}/{}", kMovers, view));
        auto frames = thousand(from_above);
        if (!frames) return run.fail(frames.error());
        still->show(frames->still);
        moving->show(frames->moving);
        for (const auto& [width, height] : run.options.sizes) measure_movers(run, *still, *moving, view, width, height);
    }
}

void run_frame(BenchRun& run) {
    if (run.wanted("frame", kMovers)) run_movers(run);
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
    return {{"frame",
             "passes of one picture of a bundled scene, at every --size; a thousand things that move beside what "
             "stands still",
             {kScenes[0], kScenes[1], kMovers}},
            run_frame};
}

}  // namespace kiln::measure
