// SPDX-License-Identifier: MIT
// What one light adds to a pixel in its volume, if it is of the batch at hand: the same sum as light.glsl's, one term a fragment.

#include "render/passes/frame.gpu.h"
#include "render/passes/light_volume.gpu.h"

layout(set = 0, binding = 0, std140) uniform Frame { FrameParams frame; };
layout(set = 0, binding = 1, std430) readonly buffer Rays { FrameRay rays[]; };
layout(set = 0, binding = 2, std430) readonly buffer Lights { LightRecord lights[]; };
layout(set = 0, binding = 3, std430) readonly buffer GgxTable { uint ggx_table[]; };
layout(set = 0, binding = 5) uniform utexture2D visibility;
layout(set = 0, binding = 6) uniform utexture2D surface_words;
layout(set = 0, binding = 7) uniform utexture2D visible_fractions;
layout(set = 0, binding = 8, std430) readonly buffer LightMasks { uint light_masks[]; };
#ifdef KILN_GLASS
layout(set = 0, binding = 9) uniform utexture2D tints_low;
layout(set = 0, binding = 10) uniform utexture2D tints_high;
#endif
layout(push_constant) uniform Push { ShadowPush push; };

layout(location = 0) flat in uint light_index;
layout(location = 0) out vec4 added;

uint ggx_table_word(uint i) { return ggx_table[i]; }
#include "render/lib/shading.gpu.h"
#include "render/passes/rays.glsl"
#include "render/passes/light_walk.glsl"
#include "render/passes/brightest.glsl"
#include "render/passes/surface.glsl"
#ifdef KILN_GLASS
#include "render/passes/glass_tint.glsl"
#endif

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    uvec4 seen = texelFetch(visibility, pixel, 0);
    if ((seen.y >> 28u) == kSeenNothing) discard;
    // Which of its tile's lights it is.
    uint word = light_index >> 5u;
    LightWalk walk = light_walk(pixel, 0u);
    uint bits = light_masks[walk.first + word];
    uint bit = 1u << (light_index & 31u);
    if ((bits & bit) == 0u) discard;
    uint before = uint(bitCount(bits & (bit - 1u)));
    for (uint w = 0u; w < word; ++w) before += uint(bitCount(light_masks[walk.first + w]));
    if (before < push.first_light || before >= push.first_light + kLightsAtOnce) discard;
    uint channel = before - push.first_light;
    float fraction = visible_fraction(texelFetch(visible_fractions, pixel, 0), channel);
    if (fraction <= 0.0) discard;
    TexelRay ray = pixel_ray(pixel);
    SurfaceSample surface = unpack_surface(texelFetch(surface_words, pixel, 0));
    SurfaceView view = surface_view(surface_optics(surface.albedo, surface.metallic, surface.roughness), surface.normal, -ray.direction);
    vec3 c = shade_light(view, sample_light(lights[light_index], seen_point(ray, seen)), fraction);
#ifdef KILN_GLASS
    c *= unpack_tint(channel < 8u ? texelFetch(tints_low, pixel, 0) : texelFetch(tints_high, pixel, 0), channel & 7u);
#endif
    added = vec4(min(c, vec3(kBrightestStored)), 0.0);
}
