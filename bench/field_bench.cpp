// SPDX-License-Identifier: MIT
// Building the field: compile, cull, find the bricks (one thread), and bake them on the CPU. 256^3 voxels over [-1, 1]^3.
// Peers on this recipe, kind 0, n = 1000: OpenVDB 1224 ms (batch CSG), libfive 630 ms; one core's roof is about 7 ms.

#include "bench/recipes.h"
#include "field/field.h"
#include "field/host_bricks.h"
#include "sdf/eval.h"

#include <benchmark/benchmark.h>

namespace kiln::bench {
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

void bake_bricks(benchmark::State& state) {
    const auto field = *field::Field::build(program(recipe(int(state.range(0)), 5, 1000)), options());
    for (auto _ : state) benchmark::DoNotOptimize(field::HostBricks::bake(field, 1));
}
BENCHMARK(bake_bricks)->Arg(0)->Arg(1)->Arg(2)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace kiln::bench
