// SPDX-License-Identifier: MIT
// Light leaving each visible point towards the eye: what it emits and reflects of the sky, and of up to sixteen lights of its tile's
// list; where nothing is, the sky. Later batches go on from the sums of the ones before, which are kept as they are: how a list is
// cut into batches changes no bit.
// With KILN_GLASS, light that comes through glass takes its colour. With KILN_VOLUMES, lights that are somewhere were rasterised: their sum so far
// is laid over what suns give. Kernels include frame.gpu.h first.

#include "render/passes/shadow.gpu.h"

layout(local_size_x = kTileGroup, local_size_y = kTileGroup) in;

layout(set = 0, binding = 0, std140) uniform Frame { FrameParams frame; };
layout(set = 0, binding = 1, std430) readonly buffer Rays { FrameRay rays[]; };
layout(set = 0, binding = 2, std430) readonly buffer Lights { LightRecord lights[]; };
layout(set = 0, binding = 3, std430) readonly buffer GgxTable { uint ggx_table[]; };
layout(set = 0, binding = 4, std430) readonly buffer Environment { uint environment_words[]; };
layout(set = 0, binding = 5) uniform texture2D depth;  // all that light asks of visibility words, at a quarter of their size
layout(set = 0, binding = 6) uniform utexture2D surface_words;
layout(set = 0, binding = 7) uniform utexture2D visible_fractions;
layout(set = 0, binding = 8, std430) readonly buffer LightMasks { uint light_masks[]; };
layout(set = 0, binding = 9, std430) buffer Sums { float sums[]; };  // of earlier batches, three a pixel; a dummy where there is one batch
layout(set = 0, binding = 10, rgba16f) writeonly uniform image2D radiance;
#ifdef KILN_GLASS
layout(set = 0, binding = 11) uniform utexture2D tints_low;   // see shadow_glass.comp: of the first eight lights at hand
layout(set = 0, binding = 12) uniform utexture2D tints_high;  // of the others
#endif
#ifdef KILN_VOLUMES
layout(set = 0, binding = 13) uniform texture2D of_volumes;
#endif
layout(push_constant) uniform Push { ShadowPush push; };

// True: an image is all around, multiplied by the constant sky.
layout(constant_id = 6) const bool kImageSky = false;

uint ggx_table_word(uint i) { return ggx_table[i]; }
uint environment_word(uint i) { return environment_words[i]; }
#include "render/lib/environment.gpu.h"
#include "render/lib/shading.gpu.h"
#include "render/passes/rays.glsl"
#include "render/passes/light_walk.glsl"
#include "render/passes/brightest.glsl"
#include "render/passes/surface.glsl"

#ifdef KILN_GLASS
#include "render/passes/glass_tint.glsl"
#endif

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (pixel.x >= frame.tile_width || pixel.y >= frame.tile_height) return;
    TexelRay ray = pixel_ray(pixel);
    ivec2 in_tile = pixel + ivec2(0, frame.first_row);
    float metres = texelFetch(depth, in_tile, 0).r;
    bool first = push.first_light == 0u;
    vec3 sum = vec3(0.0);
    if (isinf(metres)) {
        if (!first) return;
        sum = kImageSky ? environment_radiance(ray.direction) * frame.sky.c0.rgb : sky_radiance(frame.sky, ray.direction);
        imageStore(radiance, in_tile, vec4(min(sum, vec3(kBrightestStored)), 0.0));
        return;
    }
    LightWalk walk = light_walk(pixel, push.first_light);
    uint index = next_light(walk);
    if (!first && index == kNoLight) return;
    uint kept = 3u * uint(pixel.y * frame.tile_width + pixel.x);
    if (!first) sum = vec3(sums[kept], sums[kept + 1u], sums[kept + 2u]);
    SurfaceSample surface = unpack_surface(texelFetch(surface_words, pixel, 0));
    SurfaceView view = surface_view(surface_optics(surface.albedo, surface.metallic, surface.roughness), surface.normal, -ray.direction);
    if (first) {
        vec3 ambient;
        vec3 reflection;
        if (kImageSky) {
            ambient = environment_ambient(view.n) * frame.sky.c0.rgb;
            reflection = environment_reflection(reflected_view(view), view.optics.roughness) * frame.sky.c0.rgb;
        } else {
            ambient = sky_ambient(frame.sky, view.n);
            reflection = sky_reflection(frame.sky, reflected_view(view), view.alpha);
        }
        if ((frame.flags & kFrameAmbient) != 0u)
            sum = surface.emissive + shade_around_seen(view, ambient, reflection, surface.ambient);
        else
            sum = surface.emissive + surface.ambient * shade_around(view, ambient, reflection);
    }
    uvec4 fractions = texelFetch(visible_fractions, pixel, 0);
#ifdef KILN_GLASS
    uvec4 low = texelFetch(tints_low, pixel, 0);
    uvec4 high = texelFetch(tints_high, pixel, 0);
#endif
    vec3 p_world = ray_point(ray, metres / frame.grid.voxel_size);
    for (uint channel = 0u; channel < kLightsAtOnce && index != kNoLight; ++channel) {
        float fraction = visible_fraction(fractions, channel);
        vec3 tint = vec3(1.0);
#ifdef KILN_GLASS
        tint = unpack_tint(channel < 8u ? low : high, channel & 7u);
#endif
#ifdef KILN_VOLUMES
        if (lights[index].kind != kLightDirectional) fraction = 0.0;
#endif
        if (fraction > 0.0) sum += shade_light(view, sample_light(lights[index], p_world), fraction) * tint;
        index = next_light(walk);
    }
    if (push.more != 0u) {
        sums[kept] = sum.r;
        sums[kept + 1u] = sum.g;
        sums[kept + 2u] = sum.b;
    }
#ifdef KILN_VOLUMES
    sum += texelFetch(of_volumes, pixel, 0).rgb;
#endif
    imageStore(radiance, in_tile, vec4(min(sum, vec3(kBrightestStored)), 1.0));
}
