// SPDX-License-Identifier: MIT
// Shadows of meshes under a sun by maps instead of rays: clusters are culled against every map at once, drawn as heights, and read by shadow_cascades.comp.
#include "render/passes/cascades.h"

#include "shaders/cascade_cull.spv.h"
#include "shaders/cascade_mask_frag.spv.h"
#include "shaders/cascade_vert.spv.h"
#include "shaders/shadow_cascades.spv.h"

#include <algorithm>

namespace kiln::render {

namespace {

constexpr rhi::DepthState kHeights{.format = rhi::Format::Depth32Float};
constexpr rhi::SamplerDesc kTrilinear{.mip = rhi::Filter::Linear, .address = rhi::AddressMode::Repeat};
constexpr uint32_t kGroupsInRow = 32768;  // fewer than a device takes along an axis

}  // namespace

const Kernel kCascadeCull{"cascade cull", kCascadeCullSpv};
const Kernel kShadowCascades{"shadow cascades", kShadowCascadesSpv};
const RasterKernel kCascade{.name = "cascades", .vertex = kCascadeVertSpv, .fragment = {}, .depth = kHeights};
const RasterKernel kCascadeMask{
    .name = "cascades with holes", .vertex = kCascadeVertSpv, .fragment = kCascadeMaskFragSpv, .depth = kHeights};

CascadeHandles draw_cascades(Graph& g, const MeshHandles& m, const ShadowCascades& cascades, const CasterLists& casters,
                             vec3 eye, uint32_t light) {
    CascadeHandles out;
    const CascadesBlock block = cascades_block(cascades, eye, light);
    out.block = g.block(block);
    const auto side = uint32_t(cascades.side), count = block.count, clusters = uint32_t(casters.clusters.size());
    out.maps = g.create(
        "cascades",
        {.size = {side, side, count}, .format = rhi::Format::Depth32Float, .dimension = rhi::Dimension::D2Array});
    const Buffer parts = g.upload("cascade parts", std::span<const CascadePart>(casters.parts));
    const Buffer all = g.upload("casters", std::span<const MeshClusterRef>(casters.clusters));
    Buffer drawn = g.create_buffer("casters drawn", uint64_t{count} * clusters * sizeof(MeshClusterRef));
    Buffer draws = g.create_buffer("draws of casters", uint64_t{2 * kMostCascades * kDrawWords} * sizeof(uint32_t));
    g.clear(drawn);
    g.clear(draws);
    g.dispatch(kCascadeCull, Groups{std::min(clusters, kGroupsInRow), (clusters + kGroupsInRow - 1) / kGroupsInRow, 1},
               {g.uniform(out.block), g.read(all), g.read(m.parts), g.read(m.corners), g.read(m.vertices),
                g.read(parts), g.read_write(drawn), g.read_write(draws)},
               CascadeCullPush{.clusters = clusters, .solid = casters.solid, .pad_0 = 0, .pad_1 = 0});
    for (uint32_t k = 0; k < count; ++k) {
        CascadeDrawPush push{
            .first = k * clusters, .u = block.casters[k].x, .v = block.casters[k].y, .per_map = 1 / block.casters[k].z};
        const auto call = [&](bool holes) {
            return DrawCall{.indirect_buffer = draws,
                            .indirect_offset = uint64_t{(2 * k + (holes ? 1 : 0)) * kDrawWords} * sizeof(uint32_t)};
        };
        std::vector<Use> uses{g.read(drawn), g.read(m.parts), g.read(m.corners), g.read(m.vertices), g.read(parts)};
        const DrawCall solid = call(false), holed = call(true);
        g.draw(kCascade, {.depth = {.image = &out.maps, .range = layer(k)}}, uses, push, {&solid, 1});
        if (casters.solid == clusters) continue;
        push.first += casters.solid;
        uses.push_back(g.read(m.surfaces));
        for (const Image& page : m.pages) uses.push_back(g.read(page));
        uses.push_back(g.sampler(kTrilinear));
        g.draw(kCascadeMask, {.depth = {.image = &out.maps, .load = rhi::Load::Load, .range = layer(k)}}, uses, push,
               {&holed, 1});
    }
    return out;
}

Image shadow_by_cascades(Graph& g, const TileInputs& in, const Surface& surface, const Buffer& light_masks,
                         const Image& fractions, const ShadowPush& push) {
    const MeshHandles& m = in.meshes;
    Image out = g.create("visible fractions with cascades", {.size = in.size, .format = rhi::Format::Rgba32Uint});
    g.dispatch(kShadowCascades, in.size,
               {g.uniform(in.frame), g.uniform(in.cascades.block), g.read(in.rays), g.read(in.lights), g.read(m.parts),
                g.read(m.corners), g.read(m.vertices), g.read(surface.seen), g.read(surface.words), g.read(fractions),
                g.write(out), g.sampled(in.cascades.maps, kNearestClamp), g.read(light_masks)},
               push);
    return out;
}

CasterLists caster_lists(std::span<const MeshCaster> casters, const ShadowCascades& c) {
    CasterLists out;
    const auto row = [](dvec3 axis, double shift, double scale, const MeshCaster& caster) {
        const model::Matrix& m = caster.place;
        const auto dotted = [&](size_t column) {
            return axis.x * m[4 * column] + axis.y * m[4 * column + 1] + axis.z * m[4 * column + 2];
        };
        return vec4{float(dotted(0) * scale), float(dotted(1) * scale), float(dotted(2) * scale),
                    float((dotted(3) - shift) * scale)};
    };
    for (const MeshCaster& caster : casters)
        out.parts.push_back({row(c.u, c.middle_u, 1 / c.half, caster), row(c.v, c.middle_v, 1 / c.half, caster),
                             row(c.w, c.low, 1 / c.range, caster)});
    for (const bool holes : {false, true}) {
        for (uint32_t i = 0; i < casters.size(); ++i) {
            if (casters[i].holes != holes) continue;
            for (uint32_t t = 0; t < casters[i].triangles; t += kMeshCluster) out.clusters.push_back({i, t});
        }
        if (!holes) out.solid = uint32_t(out.clusters.size());
    }
    return out;
}

}  // namespace kiln::render
