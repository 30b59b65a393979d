// SPDX-License-Identifier: MIT
// Which clusters of triangles are drawn, chosen on the device (two phases, as in Zeux's niagara and in "GPU-Driven Rendering Pipelines" by Haar
// and Aaltonen, 2015). First those that the picture before showed; from their depth and what march found a pyramid is made, and of all
// clusters those are drawn late that it does not hide. The second phase looks at every cluster, so what the picture before
// showed, whatever it was, only decides what is drawn first: cuts and things that move lose nothing.
//
// Both phases keep the order of the list, and have images of their own that mesh_pick merges, so of triangles at one depth the same is seen
// as without culling.
#include "render/passes/depth_pyramid.gpu.h"
#include "render/passes/passes.h"

#include "shaders/depth_pyramid.spv.h"
#include "shaders/depth_pyramid_rest.spv.h"
#include "shaders/mesh_cull.spv.h"
#include "shaders/mesh_pack.spv.h"
#include "shaders/mesh_pick.spv.h"

namespace kiln::render {

const Kernel kDepthPyramid{"depth pyramid", kDepthPyramidSpv};
const Kernel kDepthPyramidRest{"depth pyramid rest", kDepthPyramidRestSpv};
const Kernel kMeshCull{"mesh cull", kMeshCullSpv};
const Kernel kMeshPack{"mesh pack", kMeshPackSpv};
const Kernel kMeshPick{"mesh pick", kMeshPickSpv};

namespace {

Groups tiles_of(int width, int height) {
    const auto tiles = [](int pixels) { return uint32_t((pixels + kPyramidTile - 1) / kPyramidTile); };
    return {tiles(width), tiles(height), 1};
}

struct Chosen {
    Buffer flags, clusters, numbers;
};

// `pyramid`, `early`: of the late phase.
Chosen choose(Graph& g, const TileInputs& in, Buffer& seen, const Buffer* pyramid, const Buffer* early) {
    const MeshHandles& m = in.meshes;
    const MeshCullPush push{.one_sided = m.one_sided,
                            .double_sided = m.double_sided,
                            .masked = m.masked,
                            .late = pyramid != nullptr ? 1u : 0u};
    const uint64_t count = m.listed();
    Chosen out{g.create_buffer("mesh clusters chosen", 4 * count),
               g.create_buffer("mesh clusters drawn", sizeof(MeshClusterRef) * count),
               g.create_buffer("mesh draw numbers", 4 * kMeshDrawnWords)};
    g.dispatch(kMeshCull, rhi::Extent{uint32_t(count)},
               {g.uniform(in.frame), g.read(m.clusters), g.read(m.parts), g.read(m.boxes),
                g.read(pyramid != nullptr ? *pyramid : m.boxes), g.read_write(seen),
                g.read(early != nullptr ? *early : m.parts), g.write(out.flags)},
               push);
    g.dispatch(kMeshPack, Groups{},
               {g.read(m.clusters), g.read(m.parts), g.read(out.flags), g.write(out.clusters), g.write(out.numbers)},
               push);
    return out;
}

}  // namespace

Buffer depth_pyramid(Graph& g, const TileInputs& in, const Image& mesh_depth, const Image& visibility) {
    DepthPyramidPush push{.width = int(in.size.width), .height = int(in.size.height), .from = 0, .levels = 0};
    push.levels = pyramid_levels(push.width, push.height);
    Buffer out =
        g.create_buffer("depth pyramid", 4 * uint64_t(pyramid_first(push.width, push.height, push.levels + 1)));
    g.dispatch(kDepthPyramid, tiles_of(push.width, push.height),
               {g.uniform(in.frame), g.read(in.rays), g.read(visibility), g.read(mesh_depth), g.write(out)}, push);
    for (push.from = kPyramidAtOnce; push.from < push.levels; push.from += kPyramidAtOnce)
        g.dispatch(kDepthPyramidRest,
                   tiles_of(pyramid_side(push.width, push.from), pyramid_side(push.height, push.from)),
                   {g.read_write(out)}, push);
    return out;
}

MeshesEarly draw_early(Graph& g, const TileInputs& in) {
    Buffer seen = in.meshes.seen;
    const Chosen chosen = choose(g, in, seen, nullptr, nullptr);
    return {draw_clusters(g, in, &chosen.clusters, &chosen.numbers), chosen.flags, chosen.numbers, seen};
}

MeshesSeen draw_late(Graph& g, const TileInputs& in, const MeshesEarly& early, const Image& visibility) {
    const Buffer pyramid = depth_pyramid(g, in, early.drawn.depth, visibility);
    Buffer seen = early.seen;
    const Chosen chosen = choose(g, in, seen, &pyramid, &early.chosen);
    const MeshIds late = draw_clusters(g, in, &chosen.clusters, &chosen.numbers);
    Image ids = g.create("mesh ids of both", {.size = in.size, .format = rhi::Format::Rgba32Uint});
    g.dispatch(kMeshPick, in.size,
               {g.uniform(in.frame), g.read(in.meshes.parts), g.read(early.drawn.ids), g.read(early.drawn.depth),
                g.read(late.ids), g.read(late.depth), g.write(ids)});
    return {ids, {early.numbers, chosen.numbers}};
}

}  // namespace kiln::render
