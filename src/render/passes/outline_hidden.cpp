// SPDX-License-Identifier: MIT
// Outlined things where something hides them: each is looked for as if it were alone.
#include "render/passes/forward.h"
#include "render/passes/outline.gpu.h"

#include "shaders/outline_hidden.spv.h"
#include "shaders/outline_hidden_meshes.spv.h"

namespace kiln::render {

const Kernel kOutlineHidden{"outline hidden", kOutlineHiddenSpv};
const Kernel kOutlineHiddenMeshes{"outline hidden meshes", kOutlineHiddenMeshesSpv};

namespace {

OutlineMask empty_mask(Graph& g, rhi::Extent size) {
    return {g.create("outline owners", {.size = size, .format = rhi::Format::R32Uint}),
            g.create("outline seeds", {.size = size, .format = rhi::Format::R32Uint})};
}

void mark_hidden_edits(Graph& g, const TileInputs& in, OutlineMask& mask) {
    OutlineMask out = empty_mask(g, in.size);
    const InstanceHandles& i = in.instances;
    g.dispatch(
        specialised(kOutlineHidden, in.use_of_outlines), in.size,
        {g.uniform(in.frame), g.read(in.rays), g.read(in.outline_code), g.read(in.field.numbers), g.read(in.outlines),
         g.read(mask.owners), g.write(out.owners), g.write(out.seeds), g.read(i.any() ? i.instances : in.field.numbers),
         g.read(i.any() ? i.sets : in.field.numbers), g.read(i.any() ? i.numbers : in.field.numbers)},
        OutlinePush{int(in.size.width), int(in.size.height), 0, in.outline_count});
    mask = out;
}

void mark_hidden_meshes(Graph& g, const TileInputs& in, OutlineMask& mask) {
    const MeshHandles& m = in.meshes;
    MeshIds drawn;
    drawn.ids = g.create("outlined mesh ids", {.size = in.size, .format = rhi::Format::Rg32Uint});
    drawn.depth = g.create("outlined mesh depth", {.size = in.size, .format = rhi::Format::Depth32Float});
    rhi::Load load = rhi::Load::Clear;
    for (const MeshOutline& o : m.outlined) {
        if (o.clusters == 0) continue;
        const DrawCall call{.vertices = 3 * kMeshCluster, .instances = o.clusters};
        g.draw(kMeshDoubleSidedDraw,
               {.colors = {{.image = &drawn.ids, .load = load}}, .depth = {.image = &drawn.depth, .load = load}},
               {g.uniform(in.frame), g.read(m.clusters), g.read(m.parts), g.read(m.corners), g.read(m.vertices)},
               MeshDrawPush{.first = o.first_cluster, .count = o.clusters, .drawn = 0, .pad_0 = 0}, {&call, 1});
        load = rhi::Load::Load;
    }
    if (load == rhi::Load::Clear) return;
    OutlineMask out = empty_mask(g, in.size);
    g.dispatch(kOutlineHiddenMeshes, in.size,
               {g.read(m.parts), g.read(drawn.ids), g.read(mask.owners), g.write(out.owners), g.write(out.seeds)},
               OutlinePush{int(in.size.width), int(in.size.height), 0, in.outline_count});
    mask = out;
}

}  // namespace

void mark_hidden(Graph& g, const TileInputs& in, OutlineMask& mask) {
    if (in.outline_count > 0) mark_hidden_edits(g, in, mask);
    if (!in.meshes.outlined.empty()) mark_hidden_meshes(g, in, mask);
}

}  // namespace kiln::render
