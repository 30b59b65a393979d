// SPDX-License-Identifier: MIT
// Evaluation and pruning of tapes: 200 smooth edits of several shapes in a cube of 2 m.
#include "sdf/eval.h"
#include "sdf/program.h"
#include "sdf/prune.h"

#include <kiln/shapes.h>

#include <benchmark/benchmark.h>

#include <random>

namespace {

using namespace kiln;

const sdf::Program& program() {
    static const sdf::Program one = [] {
        std::mt19937 random(1);
        std::uniform_real_distribution<float> in_cube(-1, 1), size(0.03f, 0.15f);
        std::vector<Edit> edits(200);
        for (size_t i = 0; i < edits.size(); ++i) {
            Edit& edit = edits[i];
            const float r = size(random);
            if (i % 3 == 0) edit.node.shape = Sphere{.radius = r};
            if (i % 3 == 1) edit.node.shape = Box{.half_extents = {r, 0.5f * r, r}};
            if (i % 3 == 2) edit.node.shape = Torus{.major_radius = r, .minor_radius = 0.3f * r};
            edit.node.transform.position = {in_cube(random), in_cube(random), in_cube(random)};
            edit.node.transform.rotation = axis_angle({0, 0, 1}, in_cube(random));
            edit.op = i % 5 == 4 ? Op::Subtract : Op::Union;
            edit.blend_radius = 0.05f;
        }
        return *sdf::compile({.edits = edits, .objects = {}, .grids = {}});
    }();
    return one;
}

struct Cloud {
    std::vector<float> x, y, z, out;
    explicit Cloud(size_t count) : x(count), y(count), z(count), out(count) {
        std::mt19937 random(2);
        std::uniform_real_distribution<float> in_cube(-1, 1);
        for (size_t i = 0; i < count; ++i) x[i] = in_cube(random), y[i] = in_cube(random), z[i] = in_cube(random);
    }
    sdf::Points points() const { return {x.data(), y.data(), z.data(), int(x.size())}; }
};

void evaluate(benchmark::State& state) {
    const auto isa = sdf::Isa(state.range(0));
    Cloud cloud(4096);
    for (auto _ : state) {
        sdf::evaluate(sdf::view(program()), cloud.points(), cloud.out.data(), isa);
        benchmark::DoNotOptimize(cloud.out.data());
    }
    state.SetItemsProcessed(state.iterations() * int64_t(cloud.x.size()));
}
// With each instruction set that this processor has.
void isas(benchmark::internal::Benchmark* one) {
    for (int isa = int(sdf::Isa::Scalar); isa <= int(sdf::Isa::Avx512); ++isa)
        if (sdf::has_isa(sdf::Isa(isa))) one->Arg(isa);
}
BENCHMARK(evaluate)->ArgName("isa")->Apply(isas);

void prune_to_a_brick(benchmark::State& state) {
    const Cloud centers(256);
    std::vector<sdf::Instruction> kept;
    sdf::PruneScratch scratch;
    size_t i = 0, instructions = 0;
    for (auto _ : state) {
        const size_t k = i++ % centers.x.size();
        sdf::prune(sdf::view(program()), {centers.x[k], centers.y[k], centers.z[k]}, 0.03f, kept, scratch);
        instructions += kept.size();
    }
    state.counters["kept"] = double(instructions) / double(state.iterations());
    state.counters["of"] = double(program().code.size());
}
BENCHMARK(prune_to_a_brick);

}  // namespace
