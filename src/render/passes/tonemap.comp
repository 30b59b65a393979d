#version 460
// SPDX-License-Identifier: MIT
// What a screen shows: light and its glow, exposure, tone map, sRGB curve.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#include "render/passes/tonemap.gpu.h"
#include "render/lib/color.gpu.h"
#include "render/lib/exposure.gpu.h"
#include "render/lib/tonemap.gpu.h"

layout(local_size_x = kToneGroup, local_size_y = kToneGroup) in;

layout(set = 0, binding = 0, std430) readonly buffer Exposure { ExposureState exposure; };
layout(set = 0, binding = 1) uniform texture2D radiance;
layout(set = 0, binding = 2) uniform texture2D glow;
layout(set = 0, binding = 3) uniform sampler linear;
layout(set = 0, binding = 4, rgba8) writeonly uniform image2D shown;
layout(push_constant) uniform Push { TonePush push; };

vec3 bloom_sample(vec2 at) { return textureLod(sampler2D(glow, linear), at / vec2(textureSize(glow, 0)), 0.0).rgb; }

#include "render/lib/bloom.gpu.h"

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (pixel.x >= push.width || pixel.y >= push.height) return;
    vec3 c = texelFetch(radiance, pixel, 0).rgb;
    if (push.added > 0.0) c += texelFetch(glow, pixel, 0).rgb * push.added;
    if (push.scattered > 0.0) c = mix(c, bloom_up(0.5 * (vec2(pixel) + 0.5)), push.scattered);
    imageStore(shown, pixel, vec4(srgb_from_linear3(tone_map(push.tone_map, c * exposure.multiplier)), 1.0));
}
