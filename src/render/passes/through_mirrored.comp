#version 460
// SPDX-License-Identifier: MIT
// The light of glass with what its mirrored rays met, instead of the sky that the light pass took to be there. Rough glass is half a mirror at best, and
// keeps the sky.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#include "render/passes/frame.gpu.h"
#include "render/passes/glass.gpu.h"

layout(local_size_x = kTileGroup, local_size_y = kTileGroup) in;

layout(set = 0, binding = 0, std140) uniform Frame { FrameParams frame; };
layout(set = 0, binding = 1, std430) readonly buffer Rays { FrameRay rays[]; };
layout(set = 0, binding = 3, std430) readonly buffer GgxTable { uint ggx_table[]; };
layout(set = 0, binding = 4, std430) readonly buffer Environment { uint environment_words[]; };
layout(set = 0, binding = 5) uniform utexture2D layer_seen;
layout(set = 0, binding = 6) uniform utexture2D layer_words;  // as they were lit
layout(set = 0, binding = 7) uniform texture2D layer_light;
layout(set = 0, binding = 8) uniform texture2D mirrored_light;  // a: something is there
layout(set = 0, binding = 9, rgba16f) writeonly uniform image2D light_now;
layout(push_constant) uniform Push { ThroughPush push; };

// True: an image is all around, multiplied by the constant sky.
layout(constant_id = 6) const bool kImageSky = false;

uint ggx_table_word(uint i) { return ggx_table[i]; }
uint environment_word(uint i) { return environment_words[i]; }
#include "render/lib/environment.gpu.h"
#include "render/lib/shading.gpu.h"
#include "render/passes/rays.glsl"
#include "render/passes/surface.glsl"

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (pixel.x >= push.width || pixel.y >= push.height) return;
    vec4 light = texelFetch(layer_light, pixel, 0);
    vec4 mirrored = texelFetch(mirrored_light, pixel, 0);
    if ((texelFetch(layer_seen, pixel, 0).y >> 28u) == kSeenInstance && mirrored.a > 0.0) {
        SurfaceSample s = unpack_surface(texelFetch(layer_words, pixel, 0));
        SurfaceView view = surface_view(surface_optics(s.albedo, s.metallic, s.roughness), s.normal, -pixel_ray(pixel).direction);
        vec3 toward = reflected_view(view);
        vec3 sky = kImageSky ? environment_reflection(toward, view.optics.roughness) * frame.sky.c0.rgb : sky_reflection(frame.sky, toward, view.alpha);
        float mirror = clamp(2.0 - 4.0 * view.optics.roughness, 0.0, 1.0);
        light.rgb = max(light.rgb + s.ambient * view.reflected * (mirror * (mirrored.rgb - sky)), vec3(0.0));
    }
    imageStore(light_now, pixel, light);
}
