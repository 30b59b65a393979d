// SPDX-License-Identifier: MIT
// Meshes in a frame: the rasteriser says which triangle each pixel's ray meets first, mesh_see whether the field is nearer, mesh_resolve what
// is there, mesh_shadow what meshes hide of the lights.
#include "render/passes/passes.h"

#include "shaders/mesh_groups_mesh.spv.h"
#include "shaders/mesh_id_frag.spv.h"
#include "shaders/mesh_id_mask_frag.spv.h"
#include "shaders/mesh_resolve.spv.h"
#include "shaders/mesh_see.spv.h"
#include "shaders/mesh_shadow.spv.h"
#include "shaders/mesh_vertex_vert.spv.h"

#include <algorithm>

namespace kiln::render {

namespace {

constexpr rhi::ColorTarget kIds[] = {{.format = rhi::Format::Rg32Uint}};
constexpr rhi::DepthState kDepth{.format = rhi::Format::Depth32Float};
constexpr uint32_t kGroupsInRow = 32768;  // of a mesh shader: fewer than a device takes along an axis
constexpr rhi::SpecConstant kWithoutHoles[] = {{7, 0}};
constexpr rhi::SamplerDesc kTrilinear{.mip = rhi::Filter::Linear, .address = rhi::AddressMode::Repeat};

}  // namespace

const Kernel kMeshSee{"mesh see", kMeshSeeSpv};
const Kernel kMeshResolve{"mesh resolve", kMeshResolveSpv};
const Kernel kMeshShadow{"mesh shadow", kMeshShadowSpv, kWithoutHoles};
const Kernel kMeshShadowHoles{"mesh shadow", kMeshShadowSpv};
const RasterKernel kMeshOneSided{.name = "meshes",
                                 .vertex = kMeshVertexVertSpv,
                                 .fragment = kMeshIdFragSpv,
                                 .colors = kIds,
                                 .depth = kDepth,
                                 .cull = rhi::Cull::Back};
const RasterKernel kMeshDoubleSidedDraw{.name = "meshes, both sides",
                                        .vertex = kMeshVertexVertSpv,
                                        .fragment = kMeshIdFragSpv,
                                        .colors = kIds,
                                        .depth = kDepth};
const RasterKernel kMeshMasked{.name = "meshes with holes",
                               .vertex = kMeshVertexVertSpv,
                               .fragment = kMeshIdMaskFragSpv,
                               .colors = kIds,
                               .depth = kDepth};

const RasterKernel kMeshOneSidedGroups{.name = "meshes by groups",
                                       .vertex = {},
                                       .fragment = kMeshIdFragSpv,
                                       .colors = kIds,
                                       .depth = kDepth,
                                       .cull = rhi::Cull::Back,
                                       .mesh = kMeshGroupsMeshSpv};
const RasterKernel kMeshDoubleSidedGroups{.name = "meshes by groups, both sides",
                                          .vertex = {},
                                          .fragment = kMeshIdFragSpv,
                                          .colors = kIds,
                                          .depth = kDepth,
                                          .mesh = kMeshGroupsMeshSpv};
const RasterKernel kMeshMaskedGroups{.name = "meshes by groups with holes",
                                     .vertex = {},
                                     .fragment = kMeshIdMaskFragSpv,
                                     .colors = kIds,
                                     .depth = kDepth,
                                     .mesh = kMeshGroupsMeshSpv};
const Kernel& mesh_shadow_kernel(const TileInputs& in) { return in.mesh_holes ? kMeshShadowHoles : kMeshShadow; }

MeshIds draw_clusters(Graph& g, const TileInputs& in, const Buffer* clusters, const Buffer* numbers) {
    const MeshHandles& m = in.meshes;
    const Buffer& list = clusters != nullptr ? *clusters : m.clusters;
    MeshIds out;
    out.ids = g.create("mesh ids", {.size = in.size, .format = rhi::Format::Rg32Uint});
    out.depth = g.create("mesh depth", {.size = in.size, .format = rhi::Format::Depth32Float});
    rhi::Load load = rhi::Load::Clear;
    uint32_t first = 0, kind = 0;
    const auto draw = [&](const RasterKernel& by_vertices, const RasterKernel& by_groups, uint32_t count, bool holes) {
        const MeshDrawPush push{
            .first = first, .count = count, .drawn = numbers != nullptr ? kMeshDrawWords * kind + 2 : 0, .pad_0 = 0};
        const uint64_t at = uint64_t{4} * kMeshDrawWords * kind;
        first += count;
        ++kind;
        if (count == 0) return;
        DrawCall call{.vertices = 3 * kMeshCluster, .instances = count};
        if (in.mesh_shader) {
            call.vertices = std::min(count, kGroupsInRow);
            call.instances = (count + kGroupsInRow - 1) / kGroupsInRow;
        } else if (numbers != nullptr) {
            call.indirect_buffer = *numbers;
            call.indirect_offset = at;
        }
        std::vector<Use> uses{g.uniform(in.frame), g.read(list), g.read(m.parts), g.read(m.corners),
                              g.read(m.vertices)};
        if (holes) {
            uses.push_back(g.read(m.surfaces));
            for (const Image& page : m.pages) uses.push_back(g.read(page));
            uses.push_back(g.sampler(kTrilinear));
        }
        if (in.mesh_shader) uses.push_back(g.read(numbers != nullptr ? *numbers : in.rays));
        g.draw(in.mesh_shader ? by_groups : by_vertices,
               {.colors = {{.image = &out.ids, .load = load}}, .depth = {.image = &out.depth, .load = load}}, uses,
               push, {&call, 1});
        load = rhi::Load::Load;
    };
    draw(kMeshOneSided, kMeshOneSidedGroups, m.one_sided, false);
    draw(kMeshDoubleSidedDraw, kMeshDoubleSidedGroups, m.double_sided, false);
    draw(kMeshMasked, kMeshMaskedGroups, m.masked, true);
    if (load == rhi::Load::Clear) g.clear(out.ids);  // nothing is in sight
    return out;
}

Image see_meshes(Graph& g, const TileInputs& in, const Image& ids, const Image& visibility, const Image& refined) {
    const MeshHandles& m = in.meshes;
    Image out = g.create("visibility with meshes", {.size = in.size, .format = rhi::Format::Rgba32Uint});
    g.dispatch(kMeshSee, in.size,
               {g.uniform(in.frame), g.read(in.rays), g.read(m.parts), g.read(m.corners), g.read(m.vertices),
                g.read(visibility), g.read(refined), g.read(ids), g.write(out)});
    return out;
}

void resolve_meshes(Graph& g, const TileInputs& in, Surface& surface) {
    const MeshHandles& m = in.meshes;
    std::vector<Use> uses{g.uniform(in.frame), g.read(in.rays),    g.read(m.parts),      g.read(m.corners),
                          g.read(m.vertices),  g.read(m.surfaces), g.read(surface.seen), g.write(surface.words)};
    for (const Image& page : m.pages) uses.push_back(g.read(page));
    uses.push_back(g.sampler(kTrilinear));
    g.dispatch(kMeshResolve, in.size, uses);
}

Image shadow_meshes(Graph& g, const TileInputs& in, const Surface& surface, const Buffer& light_masks,
                    const Image& fractions, const ShadowPush& push) {
    const MeshHandles& m = in.meshes;
    Image out = g.create("visible fractions with meshes", {.size = in.size, .format = rhi::Format::Rgba32Uint});
    std::vector<Use> uses{g.uniform(in.frame),  g.read(in.rays),       g.read(in.lights),  g.read(m.parts),
                          g.read(m.corners),    g.read(m.vertices),    g.read(m.surfaces), g.read(m.nodes),
                          g.read(surface.seen), g.read(surface.words), g.read(fractions),  g.write(out)};
    for (size_t page = 0; page < kMeshPages; ++page) uses.push_back(g.read(m.pages[page]));
    uses.push_back(g.sampler(kTrilinear));
    uses.push_back(g.read(light_masks));
    g.dispatch(mesh_shadow_kernel(in), in.size, uses, push);
    return out;
}

}  // namespace kiln::render
