// SPDX-License-Identifier: MIT
#include "render/passes/forward.h"
#include "render/passes/outline.gpu.h"
#include "render/passes/outline_hull.gpu.h"

#include "shaders/outline_hull_frag.spv.h"
#include "shaders/outline_hull_vert.spv.h"
#include "shaders/outline_meshes.spv.h"

namespace kiln::render {

namespace {

constexpr rhi::ColorTarget kOver[] = {{.format = rhi::Format::Rgba16Float}};

}  // namespace

const Kernel kOutlineMeshes{"outline meshes", kOutlineMeshesSpv};
const RasterKernel kOutlineHull{.name = "outline hull",
                                .vertex = kOutlineHullVertSpv,
                                .fragment = kOutlineHullFragSpv,
                                .colors = kOver,
                                .cull = rhi::Cull::Front};

void mark_meshes(Graph& g, const TileInputs& in, const Image& visibility, uint32_t records_before, OutlineMask& mask) {
    if (in.meshes.outlined.empty()) return;
    g.dispatch(kOutlineMeshes, in.size,
               {g.read(in.meshes.parts), g.read(visibility), g.write(mask.owners), g.write(mask.seeds)},
               OutlinePush{int(in.size.width), int(in.size.height), 0, records_before});
}

Image draw_hulls(Graph& g, const TileInputs& in, const Image& seen, const Image& depth, const Image& shown) {
    OutlineMask mask;
    mask.owners = g.create("outline owners", {.size = in.size, .format = rhi::Format::R32Uint});
    mask.seeds = g.create("outline seeds", {.size = in.size, .format = rhi::Format::R32Uint});
    mark_meshes(g, in, seen, 0, mask);
    const MeshHandles& m = in.meshes;
    Image drawn = g.create("outline hulls", {.size = in.size, .format = rhi::Format::Rgba16Float});
    rhi::Load load = rhi::Load::Clear;
    for (uint32_t i = 0; i < m.outlined.size(); ++i) {
        const MeshOutline& o = m.outlined[i];
        if (o.clusters == 0) continue;
        const DrawCall call{.vertices = 3 * kMeshCluster, .instances = o.clusters};
        g.draw(kOutlineHull, {.colors = {{.image = &drawn, .load = load}}},
               {g.uniform(in.frame), g.read(m.clusters), g.read(m.parts), g.read(m.corners), g.read(m.vertices),
                g.read(mask.owners), g.read(depth)},
               HullPush{o.middle.x, o.middle.y, o.middle.z, o.first_cluster, o.outline.color.x, o.outline.color.y,
                        o.outline.color.z, i + 1},
               {&call, 1});
        load = rhi::Load::Load;
    }
    return load == rhi::Load::Clear ? shown : lay_over(g, drawn, shown);
}

}  // namespace kiln::render
