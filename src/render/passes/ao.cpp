// SPDX-License-Identifier: MIT
// Rays that know what is off the screen and behind, from points of field, instances and meshes alike: true visibility rather than the depth buffer's
// (CACAO, GTAO) or cones' through a field (Wright, "Dynamic Occlusion with Signed Distance Fields", 2015), which want distances far beyond
// the band that bricks store. A point has eight rays (half: four); 4 x 4 points that share a surface are averaged, so each pixel has 128
// directions for the price of eight (Keller and Heidrich, "Interleaved Sampling", 2001).
//   ao            which rays the world's field leaves open
//   ao instances  … and what moves beside it
//   ao meshes     … and triangles, of points on meshes too; at full size alone
//   ao gather     the mean, into the G-buffer
#include "render/passes/ao.h"

#include "render/passes/ao.gpu.h"

#include "shaders/ao.spv.h"
#include "shaders/ao_exact.spv.h"
#include "shaders/ao_gather.spv.h"
#include "shaders/ao_instances.spv.h"
#include "shaders/ao_levels.spv.h"
#include "shaders/ao_levels_exact.spv.h"
#include "shaders/ao_meshes.spv.h"

namespace kiln::render {

namespace {

constexpr rhi::SpecConstant kBricksAlone[] = {{5, 0}};

const Kernel kAo{"ao", kAoSpv};
const Kernel kAoExact{"ao exact", kAoExactSpv};
const Kernel kAoHorizons{"ao horizons", kAoExactSpv, kBricksAlone};
const Kernel kAoLevels{"ao levels", kAoLevelsSpv};
const Kernel kAoLevelsExact{"ao levels exact", kAoLevelsExactSpv};
const Kernel kAoLevelsHorizons{"ao levels horizons", kAoLevelsExactSpv, kBricksAlone};
const Kernel kAoInstances{"ao instances", kAoInstancesSpv};
const Kernel kAoMeshes{"ao meshes", kAoMeshesSpv};
const Kernel kAoGather{"ao gather", kAoGatherSpv};

const Kernel& ao_kernel(const TileInputs& in) {
    if (!in.exact) return in.levels ? kAoLevels : kAo;
    if (in.levels) return specialised(in.horizons ? kAoLevelsHorizons : kAoLevelsExact, in.use);
    return specialised(in.horizons ? kAoHorizons : kAoExact, in.use);
}

}  // namespace

Buffer occlude(Graph& g, const TileInputs& in, Surface& surface) {
    const uint32_t every = in.ao_every;
    const rhi::Extent size{(in.size.width + every - 1) / every, (in.size.height + every - 1) / every};
    const uint32_t side = uint32_t(kTileGroup);
    const uint64_t groups = uint64_t{(size.width + side - 1) / side} * ((size.height + side - 1) / side);
    const FieldHandles& f = in.field;
    const InstanceHandles& i = in.instances;
    const AoPush push{
        .node_count = i ? i.node_count : 0, .picture = in.picture, .every = every, .rays = every == 1 ? 8u : 4u};
    Image points = g.create("ao points", {.size = size, .format = rhi::Format::Rgba32Uint});
    Buffer counted = g.create_buffer("ao evaluations", groups * 4);
    std::vector<Use> uses{g.uniform(in.frame),  g.read(f.cells),       g.read(in.rays), g.sampled(f.distances),
                          g.read(surface.seen), g.read(surface.words), g.write(points), g.write(counted)};
    if (in.exact) uses.insert(uses.end(), {g.read(f.records), g.read(f.code), g.read(f.program), g.read(f.numbers)});
    if (in.levels) uses.push_back(g.uniform(in.levels_block));
    g.dispatch(ao_kernel(in), size, uses, push);
    if (i) {
        Image left = g.create("ao points", {.size = size, .format = rhi::Format::Rgba32Uint});
        g.dispatch(kAoInstances, size,
                   {g.uniform(in.frame), g.read(i.ways), g.read(i.nodes), g.read(i.cells), g.read(in.rays),
                    g.read(f.tables), g.read(f.distances), g.read(surface.seen), g.read(points), g.write(left)},
                   push);
        points = left;
    }
    if (in.has_meshes && every == 1) {
        const MeshHandles& m = in.meshes;
        Image left = g.create("ao points", {.size = size, .format = rhi::Format::Rgba32Uint});
        std::vector<Use> of_meshes{g.uniform(in.frame), g.read(in.rays),    g.read(m.parts), g.read(m.corners),
                                   g.read(m.vertices),  g.read(m.surfaces), g.read(m.nodes), g.read(surface.seen),
                                   g.read(points),      g.write(left)};
        for (const Image& page : m.pages) of_meshes.push_back(g.read(page));
        of_meshes.push_back(g.sampler({.mip = rhi::Filter::Linear, .address = rhi::AddressMode::Repeat}));
        g.dispatch(kAoMeshes, size, of_meshes, push);
        points = left;
    }
    Image words = g.create("surface", {.size = in.size, .format = rhi::Format::Rgba32Uint});
    g.dispatch(kAoGather, in.size,
               {g.uniform(in.frame), g.read(in.rays), g.read(surface.seen), g.read(points), g.read(surface.words),
                g.write(words)},
               push);
    surface.words = words;
    return counted;
}

void ao_kernels(const TileInputs& in, std::vector<const Kernel*>& out) {
    if (in.ao_every == 0) return;
    out.insert(out.end(), {&ao_kernel(in), &kAoGather});
    if (in.has_instances) out.push_back(&kAoInstances);
    if (in.has_meshes && in.ao_every == 1) out.push_back(&kAoMeshes);
}

}  // namespace kiln::render
