// SPDX-License-Identifier: MIT
#include "render/passes/passes.h"

#include "shaders/light.spv.h"

namespace kiln::render {

namespace {
constexpr rhi::SpecConstant kWithImage[] = {{6, 1}};
}  // namespace

const Kernel kLight{"light", kLightSpv};
const Kernel kLightImage{"light image", kLightSpv, kWithImage};

const Kernel& light_kernel(const TileInputs& in) { return in.image_sky ? kLightImage : kLight; }

Image light(Graph& g, const TileInputs& in, const Image& visibility, const Surface& surface) {
    Image radiance;
    uint32_t first = 0;
    do {
        const ShadowPush push{.first_light = first, .pad_0 = 0, .pad_1 = 0, .pad_2 = 0};
        Image fractions = shadow(g, in, visibility, surface, push);
        if (in.has_meshes) fractions = shadow_meshes(g, in, surface, fractions, push);
        Image sum = g.create("radiance", {.size = in.size, .format = rhi::Format::Rgba16Float});
        g.dispatch(light_kernel(in), in.size,
                   {g.uniform(in.frame), g.read(in.rays), g.read(in.lights), g.read(in.ggx_table),
                    g.read(in.environment), g.read(visibility), g.read(surface.words), g.read(fractions),
                    g.read(radiance ? radiance : fractions), g.write(sum)},
                   push);
        radiance = sum;
        first += kLightsAtOnce;
    } while (first < in.light_count);
    return radiance;
}

}  // namespace kiln::render
