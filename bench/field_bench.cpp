// SPDX-License-Identifier: MIT
// Building the field: compile, cull, find the bricks (one thread), and bake them on the CPU. 256^3 voxels over [-1, 1]^3.
// Peers on this recipe, kind 0, n = 1000: OpenVDB 1224 ms (batch CSG), libfive 630 ms; one core's roof is about 7 ms.

#include "measure/recipes.h"
#include "field/field.h"
#include "field/host_bricks.h"
#include "sdf/eval.h"

#include <benchmark/benchmark.h>

namespace kiln::measure {
namespace {

field::FieldOptions options() {
    field::FieldOptions out;
    out.voxel_size = 2.0f / 256;
    out.bounds = {{-1, -1, -1}, {1, 1, 1}};
    out.workers = 1;
    return out;
}

std::shared_ptr<const sdf::Program> program(const std::vector<Edit>& edits) {
    return std::make_shared<const sdf::Program>(*sdf::compile({edits, {}, {}}));
}

void compile_edits(benchmark::State& state) {
    const std::vector<Edit> edits = recipe(0, 5, uint32_t(state.range(0)));
    for (auto _ : state) benchmark::DoNotOptimize(program(edits));
    state.SetItemsProcessed(state.iterations() * state.range(0));
}
BENCHMARK(compile_edits)->Arg(1000)->Arg(100000)->Unit(benchmark::kMillisecond);

void build_field(benchmark::State& state) {
    const auto p = program(recipe(int(state.range(0)), 5, uint32_t(state.range(1))));
    uint32_t bricks = 0;
    uint64_t tested = 0;
    for (auto _ : state) {
        const auto field = *field::Field::build(p, options());
        bricks = field->stats().bricks;
        tested = field->stats().cells_tested;
    }
    state.counters["bricks"] = bricks;
    state.counters["tested"] = double(tested);
    state.counters["d(0,0,0)"] = sdf::evaluate(sdf::view(*p), dvec3{0, 0, 0});
}
BENCHMARK(build_field)
    ->Args({0, 1000})
    ->Args({1, 1000})
    ->Args({2, 1000})
    ->Args({0, 10000})
    ->Unit(benchmark::kMillisecond);

void build_and_bake(benchmark::State& state) {
    const auto p = program(recipe(int(state.range(0)), 5, uint32_t(state.range(1))));
    field::HostBricks last;
    for (auto _ : state) {
        auto bricks = field::HostBricks::build(p, options());
        last = std::move(*bricks);
    }
    const field::BuildStats& stats = last.field().stats();
    state.counters["bricks"] = stats.bricks;
    state.counters["evaluated"] = double(stats.cells_evaluated);
    state.counters["tested"] = double(stats.cells_tested);
    state.counters["code"] = double(last.field().code().size()) / stats.bricks;
}
BENCHMARK(build_and_bake)
    ->Args({0, 1000})
    ->Args({1, 1000})
    ->Args({2, 1000})
    ->Args({0, 10000})
    ->Args({0, 100000})
    ->Unit(benchmark::kMillisecond);

void one_edit(benchmark::State& state) {
    const auto p = program(recipe(int(state.range(0)), 5, uint32_t(state.range(1))));
    const field::HostBricks fresh = *field::HostBricks::build(p, options());
    double bricks = 0;
    uint32_t m = 0;
    field::HostBricks bricks_now = fresh;
    for (auto _ : state) {
        if (m % 20 == 0) {
            state.PauseTiming();
            bricks_now = fresh;
            state.ResumeTiming();
        }
        sdf::Program next = bricks_now.field().program();
        const uint32_t row =
            *sdf::insert(next, bite(m % 20), {}, {}, sdf::order_between(next.edits.back().order, UINT64_MAX), 0);
        const field::RowChange change{field::kNoRow, row};
        (void)bricks_now.update(std::make_shared<const sdf::Program>(std::move(next)), {&change, 1});
        bricks += double(bricks_now.field().jobs().size());
        ++m;
    }
    state.counters["bricks"] = bricks / m;
}
BENCHMARK(one_edit)
    ->Args({0, 1000})
    ->Args({1, 1000})
    ->Args({2, 1000})
    ->Args({0, 100000})
    ->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace kiln::measure
