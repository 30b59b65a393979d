// SPDX-License-Identifier: MIT
#include "render/passes/passes.h"

#include "shaders/light.spv.h"

namespace kiln::render {

const Kernel kLight{"light", kLightSpv};

Image light(Graph& g, const TileInputs& in, const Image& visibility, const Surface& surface) {
    Image radiance;
    uint32_t first = 0;
    do {
        const ShadowPush push{.first_light = first, .pad_0 = 0, .pad_1 = 0, .pad_2 = 0};
        const Image fractions = shadow(g, in, visibility, surface, push);
        Image sum = g.create("radiance", {.size = in.size, .format = rhi::Format::Rgba16Float});
        g.dispatch(kLight, in.size,
                   {g.uniform(in.frame), g.read(in.rays), g.read(in.lights), g.read(in.ggx_table), g.read(visibility),
                    g.read(surface.words), g.read(fractions), g.read(radiance ? radiance : fractions), g.write(sum)},
                   push);
        radiance = sum;
        first += kLightsAtOnce;
    } while (first < in.light_count);
    return radiance;
}

}  // namespace kiln::render
