// SPDX-License-Identifier: MIT
// `bench gpu`: the bake of the recipes by a device's kernels, of the same culled lists that the CPU bakes. Its time is the device's own, of the
// bake alone: not the culling, which is the CPU's in either case, nor the upload of lists. The CPU's baker, on all cores, is the peer.
// On a software device both use the same cores, which is why the renderer does not let such a one bake.

#include "measure/bench_scene.h"
#include "measure/contest.h"

#include "base/log.h"
#include "base/parallel_for.h"
#include "field/codes.gpu.h"
#include "field/host_bricks.h"
#include "render/gpu_field.h"
#include "render/graph_runner.h"
#include "rhi/create.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <memory>

namespace kiln::measure {
namespace {

using field::Field;
using field::HostBricks;

constexpr size_t kReadAtOnce = 1024;  // bricks

// Devices may round a texel to the neighbouring half, which counts as the CPU's.
bool same_texel(float device, float ours) {
    const float size = std::max(std::fabs(ours), field::kHalfStepVoxels);
    const float step = std::max(std::ldexp(1.0f, std::ilogb(size) - 10), 0x1p-10f);
    return (device <= 0) == (ours <= 0) && std::fabs(device - ours) <= step;
}

struct Compared {
    uint64_t device = 0, ours = 0;  // checksums
    uint64_t rounded = 0;           // texels that are not the CPU's to the bit
};
Result<Compared> compare(render::GpuField& gpu, const HostBricks& bricks) {
    Compared out;
    const std::vector<uint32_t> slots = bricks.field().slots();
    for (size_t first = 0; first < slots.size(); first += kReadAtOnce) {
        const auto piece = std::span(slots).subspan(first, std::min(kReadAtOnce, slots.size() - first));
        const auto read = gpu.read_back(piece);
        if (!read) return read.error();
        for (size_t i = 0; i < piece.size(); ++i) {
            for (int t = 0; t < field::kBrickTexelCount; ++t) {
                const float ours = bricks.texel(piece[i], t & 7, t >> 3 & 7, t >> 6);
                const float device = field::half_value((*read)[i].distance_codes[size_t(t)]);
                const float counted = same_texel(device, ours) ? ours : device;
                out.rounded += device != ours ? 1 : 0;
                out.ours = hash_combine(out.ours, std::bit_cast<uint32_t>(ours));
                out.device = hash_combine(out.device, std::bit_cast<uint32_t>(counted));
            }
        }
    }
    return out;
}

void bake(BenchRun& run, render::Runner& runner, const BenchScene& scene) {
    if (!run.wanted("gpu", "bake")) return;
    run.stage("gpu bake");
    auto field = Field::build(scene.program, scene.options);
    if (!field) return run.fail(field.error());
    const int cores = hardware_workers();
    std::unique_ptr<render::GpuField> gpu;
    HostBricks bricks;
    double least = 1e300, least_ours = 1e300;
    for (int turn = 0; turn < run.options.runs; ++turn) {
        gpu = std::make_unique<render::GpuField>(runner);
        if (auto ok = gpu->update(*field, render::Baker::Storage); !ok) return run.fail(ok.error());
        least = std::min(least, gpu->bake_ms());
        least_ours = std::min(least_ours, 1e3 * seconds_of([&] { bricks = HostBricks::bake(*field, cores); }));
    }
    const auto compared = compare(*gpu, bricks);
    if (!compared) return run.fail(compared.error());
    if (compared->rounded > 0)
        log::info("bench gpu: {} texels are rounded otherwise than on the CPU", compared->rounded);
    BenchRow row;
    row.name = formatted("gpu.bake/{}", runner.device().info().name);
    row.value = least;
    row.unit = "ms";
    row.threads = cores;
    row.peer = "CPU's baker";
    row.peer_value = least_ours;
    row.ratio = least_ours / least;
    row.kind = scene.kind;
    row.seed = run.options.seed;
    row.count = run.options.count;
    row.bricks = double((*field)->slots().size());
    row.texels = (*field)->slots().size() * field::kBrickTexelCount;
    run.add_checked(row, compared->device, compared->ours);
}

}  // namespace

BenchFamily gpu_family() {
    return {{"gpu", "the bake of a field by the device that draws, beside the CPU's", {"bake"}}, [](BenchRun& run) {
                auto device = rhi::create_device();
                if (!device) return log::warn("bench gpu: left out, {}", device.error().message);
                render::Runner runner(**device);
                for (const int kind : run.options.kinds)
                    if (!run.fault()) bake(run, runner, recipe_scene(kind, run.options));
            }};
}

}  // namespace kiln::measure
