// SPDX-License-Identifier: MIT
// Meshing the benchmark scenes from bricks, one core: 1000 edits, 256^3 voxels over [-1, 1]^3.
// Peers on kind 0: OpenVDB's volumeToMesh 6.6 Mtri/s (vertices off by rms 0.075, at most 0.62 voxel), libfive's dual
// contouring 0.35 Mtri/s (rms 0.025, at most 2.5 to 17 voxels).

#include "measure/recipes.h"
#include "field/meshing.h"
#include "sdf/eval.h"

#include <benchmark/benchmark.h>

#include <cmath>

namespace kiln::bench {
namespace {

field::HostBricks bricks_of(int kind) {
    field::FieldOptions options;
    options.voxel_size = 2.0f / 256;
    options.bounds = {{-1, -1, -1}, {1, 1, 1}};
    options.workers = 1;
    const std::vector<Edit> edits = measure::recipe(kind, 5, 1000);
    return *field::HostBricks::build(std::make_shared<const sdf::Program>(*sdf::compile({edits, {}, {}})), options);
}

void report(benchmark::State& state, const field::Field& field, const field::Mesh& mesh) {
    const sdf::TapeView tape = sdf::view(field.program());
    double sum = 0, most = 0;
    for (size_t i = 0; i < mesh.vertex_count(); i += 16) {
        const vec3 p = mesh.positions[i];
        const double d =
            sdf::evaluate(tape, dvec3{double(p.x), double(p.y), double(p.z)}) / double(field.grid().voxel_size);
        sum += d * d;
        most = std::max(most, std::abs(d));
    }
    state.counters["triangles"] = double(mesh.triangle_count());
    state.counters["rms_voxels"] = std::sqrt(16 * sum / double(mesh.vertex_count()));
    state.counters["max_voxels"] = most;
    state.counters["tri/s"] =
        benchmark::Counter(double(state.iterations()) * double(mesh.triangle_count()), benchmark::Counter::kIsRate);
}

// Memory of the mesh is fresh each time, or kept.
void mesh_smooth(benchmark::State& state) {
    const field::HostBricks bricks = bricks_of(int(state.range(0)));
    const bool keep = state.range(1) != 0;
    field::Mesh mesh;
    for (auto _ : state) {
        if (!keep) mesh = {};
        field::mesh_smooth(field::MeshBricks(bricks), mesh, 1);
    }
    report(state, bricks.field(), mesh);
}
BENCHMARK(mesh_smooth)->ArgNames({"kind", "keep"})->ArgsProduct({{0, 1, 2}, {0, 1}})->Unit(benchmark::kMillisecond);

// What an edit's collider costs: 9^3 cells, 63^3 voxels, in the middle of the scene.
void mesh_region(benchmark::State& state) {
    const field::HostBricks bricks = bricks_of(int(state.range(0)));
    field::Mesh mesh;
    for (auto _ : state) field::mesh_smooth(field::MeshBricks(bricks, {{-4, -4, -4}, {5, 5, 5}}), mesh, 1);
    report(state, bricks.field(), mesh);
}
BENCHMARK(mesh_region)->ArgName("kind")->DenseRange(0, 2)->Unit(benchmark::kMillisecond);

void mesh_sharp(benchmark::State& state) {
    const field::HostBricks host = bricks_of(int(state.range(0)));
    field::Mesh mesh;
    for (auto _ : state) {
        mesh = {};
        const field::MeshBricks bricks(host);
        field::mesh_sharp(bricks, field::exact_of(host, bricks), mesh, 1);
    }
    report(state, host.field(), mesh);
}
BENCHMARK(mesh_sharp)->ArgName("kind")->DenseRange(0, 2)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace kiln::bench
