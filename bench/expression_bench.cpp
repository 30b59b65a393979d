// SPDX-License-Identifier: MIT
// A large plane model as a picture of 1024 x 1024 pixels: through intervals, and every operation at every pixel (the brute force the
// ratio is taken against). KILN_MODEL names a .vm file; without it a generated model of about 7900 operations is drawn.

#include "measure/letters.h"
#include "sdf/expression_image.h"

#include <benchmark/benchmark.h>

#include <cstdlib>
#include <fstream>
#include <sstream>

namespace kiln::sdf {
namespace {

const Formula& model() {
    static const Formula formula = [] {
        std::string text = measure::letters_model(335);
        if (const char* path = std::getenv("KILN_MODEL")) {
            std::ifstream in(path);
            std::ostringstream all;
            all << in.rdbuf();
            text = all.str();
        }
        auto read = read_vm(text);
        if (!read) {
            std::fprintf(stderr, "KILN_MODEL: %s\n", read.error().message.c_str());
            std::exit(3);
        }
        return std::move(*read);
    }();
    return formula;
}

void BM_model_picture(benchmark::State& state) {
    FormulaImageStats stats;
    std::vector<uint8_t> picture;
    for (auto _ : state) picture = formula_image(model(), {.size_px = 1024}, best_isa(), &stats);
    state.counters["operations"] = double(model().nodes.size());
    state.counters["point_ops_per_pixel"] = double(stats.point_operations) / (1024.0 * 1024.0);
    state.counters["interval_ops"] = double(stats.interval_operations);
    state.counters["copied_ops"] = double(stats.copied_operations);
    uint64_t inside = 0;
    for (const uint8_t v : picture) inside += v != 0;
    state.counters["inside_px"] = double(inside);
}

void BM_model_picture_brute_force(benchmark::State& state) {
    std::vector<uint8_t> picture;
    for (auto _ : state) picture = formula_image_slow(model(), {.size_px = 1024});
    uint64_t inside = 0;
    for (const uint8_t v : picture) inside += v != 0;
    state.counters["inside_px"] = double(inside);
    if (picture != formula_image(model(), {.size_px = 1024})) state.SkipWithError("the pictures differ");
}

void BM_model_read(benchmark::State& state) {
    const std::string text = measure::letters_model(335);
    for (auto _ : state) benchmark::DoNotOptimize(read_vm(text));
}

BENCHMARK(BM_model_picture)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(BM_model_picture_brute_force)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(BM_model_read)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace kiln::sdf
