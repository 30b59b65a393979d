// SPDX-License-Identifier: MIT
#include "render/passes/light_volumes.h"

#include "render/passes/light_volume.gpu.h"

#include "shaders/light_over.spv.h"
#include "shaders/light_over_glass.spv.h"
#include "shaders/light_volume_frag.spv.h"
#include "shaders/light_volume_glass_frag.spv.h"
#include "shaders/light_volume_vert.spv.h"

namespace kiln::render {

namespace {

constexpr rhi::ColorTarget kAdded[] = {{.format = rhi::Format::Rgba16Float,
                                        .blend = true,
                                        .color = {rhi::BlendFactor::One, rhi::BlendFactor::One},
                                        .alpha = {rhi::BlendFactor::One, rhi::BlendFactor::One}}};

}  // namespace

const Kernel kLightOver{"light over volumes", kLightOverSpv};
const Kernel kLightOverImage{"light over volumes image", kLightOverSpv, kWithImage};
const Kernel kLightOverGlass{"light over volumes glass", kLightOverGlassSpv};
const Kernel kLightOverGlassImage{"light over volumes glass image", kLightOverGlassSpv, kWithImage};
const RasterKernel kLightVolume{.name = "light volumes",
                                .vertex = kLightVolumeVertSpv,
                                .fragment = kLightVolumeFragSpv,
                                .colors = kAdded,
                                .cull = rhi::Cull::Front};
const RasterKernel kLightVolumeGlass{.name = "light volumes glass",
                                     .vertex = kLightVolumeVertSpv,
                                     .fragment = kLightVolumeGlassFragSpv,
                                     .colors = kAdded,
                                     .cull = rhi::Cull::Front};

const Kernel& light_over_kernel(const TileInputs& in) {
    if (in.has_glass) return in.image_sky ? kLightOverGlassImage : kLightOverGlass;
    return in.image_sky ? kLightOverImage : kLightOver;
}

const RasterKernel& light_volume_kernel(const TileInputs& in) {
    return in.has_glass ? kLightVolumeGlass : kLightVolume;
}

void add_volumes(Graph& g, const TileInputs& in, const Image& visibility, const Surface& surface,
                 const Image& fractions, const Buffer& masks, std::span<const Image> tints, const ShadowPush& push,
                 Image& sum) {
    std::vector<Use> uses{g.uniform(in.frame), g.read(in.rays),       g.read(in.lights), g.read(in.ggx_table),
                          g.read(visibility),  g.read(surface.words), g.read(fractions), g.read(masks)};
    for (const Image& tint : tints) uses.push_back(g.read(tint));
    uses.push_back(g.read(in.volumes));
    const DrawCall call{.vertices = kVolumeCorners, .instances = in.volume_count};
    const rhi::Load load = push.first_light == 0 ? rhi::Load::Clear : rhi::Load::Load;
    g.draw(light_volume_kernel(in), {.colors = {{.image = &sum, .load = load}}}, uses, push, {&call, 1});
}

}  // namespace kiln::render
