// SPDX-License-Identifier: MIT
#include "render/passes/cascades.h"
#include "render/passes/forward.h"
#include "render/passes/instances.h"
#include "render/passes/lamps.h"
#include "render/passes/light_volumes.h"
#include "render/passes/passes.h"

#include "shaders/light.spv.h"
#include "shaders/light_glass.spv.h"

namespace kiln::render {

const Kernel kLight{"light", kLightSpv};
const Kernel kLightImage{"light image", kLightSpv, kWithImage};

const Kernel kLightGlass{"light glass", kLightGlassSpv};
const Kernel kLightGlassImage{"light glass image", kLightGlassSpv, kWithImage};

const Kernel& light_kernel(const TileInputs& in) {
    if (in.has_glass) return in.image_sky ? kLightGlassImage : kLightGlass;
    return in.image_sky ? kLightImage : kLight;
}

Image light(Graph& g, const TileInputs& in, const Surface& surface, const Image& depth) {
    Image radiance = g.create("radiance", {.size = in.size, .format = rhi::Format::Rgba16Float});
    light(g, in, surface, depth, radiance);
    return radiance;
}

void light(Graph& g, const TileInputs& in, const Surface& surface, const Image& depth, Image& radiance) {
    const Image& visibility = surface.seen;
    const Buffer masks = cluster(g, in, visibility);
    const bool batches = in.lights_of_tile > kLightsAtOnce;
    Buffer sums =
        g.create_buffer("light sums", batches ? uint64_t{in.size.width} * in.size.height * 3 * sizeof(float) : 16);
    g.clear(sums);
    Image of_volumes;
    if (in.volume_count > 0)
        of_volumes = g.create("light of volumes", {.size = in.size, .format = rhi::Format::Rgba16Float});
    uint32_t first = 0;
    do {
        const uint32_t next = first + kLightsAtOnce;
        const ShadowPush push{.first_light = first, .more = next < in.lights_of_tile ? 1u : 0u, .pad_0 = 0, .pad_1 = 0};
        Image fractions = shadow(g, in, visibility, surface, masks, push);
        shadow_instances(g, in, visibility, surface, masks, first, fractions);
        // In a tile's list a light comes no later than in the frame's.
        if (in.has_cascades && first <= in.mapped_light)
            fractions = shadow_by_cascades(g, in, surface, masks, fractions, push);
        if (in.has_lamps) fractions = shadow_by_lamps(g, in, surface, masks, fractions, push);
        if (in.has_meshes && !in.maps_alone) fractions = shadow_meshes(g, in, surface, masks, fractions, push);
        std::vector<Image> tints;
        if (in.has_glass) tints = shadow_glass(g, in, visibility, surface, masks, first, fractions);
        std::vector<Use> uses{g.uniform(in.frame),    g.read(in.rays),    g.read(in.lights),     g.read(in.ggx_table),
                              g.read(in.environment), g.read(depth),      g.read(surface.words), g.read(fractions),
                              g.read(masks),          g.read_write(sums), g.write(radiance)};
        for (const Image& tint : tints) uses.push_back(g.read(tint));
        if (in.volume_count > 0) {
            add_volumes(g, in, visibility, surface, fractions, masks, tints, push, of_volumes);
            uses.push_back(g.read(of_volumes));
        }
        g.dispatch(in.volume_count > 0 ? light_over_kernel(in) : light_kernel(in), in.size, uses, push);
        first = next;
    } while (first < in.lights_of_tile);
}

}  // namespace kiln::render
