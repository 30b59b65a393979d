// SPDX-License-Identifier: MIT
// Shadows of meshes under lamps and spots by maps, as cascades.cpp makes those of a sun.
#include "render/passes/lamps.h"

#include "shaders/cascade_mask_frag.spv.h"
#include "shaders/lamp_cull.spv.h"
#include "shaders/lamp_map_vert.spv.h"
#include "shaders/shadow_lamps.spv.h"

#include <algorithm>

namespace kiln::render {

namespace {

constexpr rhi::DepthState kNearness{.format = rhi::Format::Depth32Float};
constexpr rhi::SamplerDesc kTrilinear{.mip = rhi::Filter::Linear, .address = rhi::AddressMode::Repeat};
constexpr uint32_t kGroupsInRow = 32768;  // fewer than a device takes along an axis

}  // namespace

const Kernel kLampCull{"lamp cull", kLampCullSpv};
const Kernel kShadowLamps{"shadow lamps", kShadowLampsSpv};
const RasterKernel kLampMap{.name = "lamp maps", .vertex = kLampMapVertSpv, .fragment = {}, .depth = kNearness};
const RasterKernel kLampMapMask{
    .name = "lamp maps with holes", .vertex = kLampMapVertSpv, .fragment = kCascadeMaskFragSpv, .depth = kNearness};

LampHandles draw_lamps(Graph& g, const MeshHandles& m, std::span<const LampFace> faces, const CasterLists& casters,
                       int side) {
    LampHandles out;
    const auto count = uint32_t(faces.size()), clusters = uint32_t(casters.clusters.size());
    out.faces = g.upload("lamp faces", faces);
    out.maps = g.create("lamp maps", {.size = {uint32_t(side), uint32_t(side), count},
                                      .format = rhi::Format::Depth32Float,
                                      .dimension = rhi::Dimension::D2Array});
    const Buffer all = g.upload("casters", std::span<const MeshClusterRef>(casters.clusters));
    Buffer drawn = g.create_buffer("casters of lamps", uint64_t{count} * clusters * sizeof(MeshClusterRef));
    Buffer draws = g.create_buffer("draws of lamps", uint64_t{2 * count * kDrawWords} * sizeof(uint32_t));
    g.clear(drawn);
    g.clear(draws);
    g.dispatch(kLampCull, Groups{std::min(clusters, kGroupsInRow), (clusters + kGroupsInRow - 1) / kGroupsInRow, 1},
               {g.read(all), g.read(m.parts), g.read(m.corners), g.read(m.vertices), g.read(out.faces),
                g.read_write(drawn), g.read_write(draws)},
               LampCullPush{.clusters = clusters, .solid = casters.solid, .faces = count, .pad_0 = 0});
    for (uint32_t k = 0; k < count; ++k) {
        LampDrawPush push{.first = k * clusters, .face = k, .pad_0 = 0, .pad_1 = 0};
        const auto call = [&](bool holes) {
            return DrawCall{.indirect_buffer = draws,
                            .indirect_offset = uint64_t{(2 * k + (holes ? 1 : 0)) * kDrawWords} * sizeof(uint32_t)};
        };
        std::vector<Use> uses{g.read(drawn), g.read(m.parts), g.read(m.corners), g.read(m.vertices), g.read(out.faces)};
        const DrawCall solid = call(false), holed = call(true);
        g.draw(kLampMap, {.depth = {.image = &out.maps, .range = layer(k)}}, uses, push, {&solid, 1});
        if (casters.solid == clusters) continue;
        push.first += casters.solid;
        uses.push_back(g.read(m.surfaces));
        for (const Image& page : m.pages) uses.push_back(g.read(page));
        uses.push_back(g.sampler(kTrilinear));
        g.draw(kLampMapMask, {.depth = {.image = &out.maps, .load = rhi::Load::Load, .range = layer(k)}}, uses, push,
               {&holed, 1});
    }
    return out;
}

Image shadow_by_lamps(Graph& g, const TileInputs& in, const Surface& surface, const Buffer& light_masks,
                      const Image& fractions, const ShadowPush& push) {
    const MeshHandles& m = in.meshes;
    Image out = g.create("visible fractions with lamps", {.size = in.size, .format = rhi::Format::Rgba32Uint});
    g.dispatch(kShadowLamps, in.size,
               {g.uniform(in.frame), g.read(in.lamps.faces), g.read(in.rays), g.read(in.lights), g.read(m.parts),
                g.read(m.corners), g.read(m.vertices), g.read(surface.seen), g.read(surface.words), g.read(fractions),
                g.write(out), g.sampled(in.lamps.maps, kNearestClamp), g.read(light_masks)},
               push);
    return out;
}

}  // namespace kiln::render
