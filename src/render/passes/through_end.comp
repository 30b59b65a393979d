#version 460
// SPDX-License-Identifier: MIT
// The part back into the tile: what its rays brought, and what those brought that parted from them. Behind rough glass neighbours' rays are one
// lobe: of five by five, the outermost half, each of four by four kinds of rays counts once. Only what comes through is shared so, against
// what is let in, between pixels that see the same glass from nearly the same side; what the surface itself shows stays sharp.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#include "render/passes/frame.gpu.h"
#include "render/passes/glass.gpu.h"

layout(local_size_x = kTileGroup, local_size_y = kTileGroup) in;

layout(set = 0, binding = 0, std140) uniform Frame { FrameParams frame; };
layout(set = 0, binding = 1, std430) readonly buffer Glass { GlassRecord glass[]; };  // not read without kThroughParts
layout(set = 0, binding = 2) uniform texture2D total;
layout(set = 0, binding = 3) uniform texture2D parted;  // with kThroughParts: two pictures, one below the other
layout(set = 0, binding = 4) uniform utexture2D first_seen;
layout(set = 0, binding = 5) uniform utexture2D first_words;
layout(set = 0, binding = 6) uniform texture2D first_sum;
layout(set = 0, binding = 7) uniform texture2D entered;  // share of light that the first surface lets in
layout(set = 0, binding = 8, rgba16f) writeonly uniform image2D tile_radiance;
layout(push_constant) uniform Push { ThroughPush push; };

#include "render/passes/surface.glsl"

vec3 behind(ivec2 pixel) {
    return texelFetch(total, pixel, 0).rgb - texelFetch(first_sum, pixel, 0).rgb + texelFetch(parted, ivec2(pixel.x, pixel.y + push.height), 0).rgb;
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (pixel.x >= push.width || pixel.y >= push.height) return;
    vec4 light = texelFetch(total, pixel, 0);
    if ((push.step & kThroughParts) != 0u) {
        uint seen = texelFetch(first_seen, pixel, 0).y;
        bool rough = (seen >> 28u) == kSeenInstance;
        if (rough) rough = glass[seen & 0x0fffffffu].alpha > kLobePixels * frame.pixel_angle;
        if (rough) {
            vec3 normal = unpack_unit(texelFetch(first_words, pixel, 0).y);
            vec3 sum = vec3(0.0);
            vec3 let_in = vec3(0.0);
            const int kReach = kLobeSide / 2;
            for (int y = -kReach; y <= kReach; ++y) {
                for (int x = -kReach; x <= kReach; ++x) {
                    ivec2 at = pixel + ivec2(x, y);
                    if (min(at.x, at.y) < 0 || at.x >= push.width || at.y >= push.height) continue;
                    if (texelFetch(first_seen, at, 0).y != seen) continue;
                    if (dot(unpack_unit(texelFetch(first_words, at, 0).y), normal) < 0.95) continue;
                    float weight = (abs(x) == kReach ? 0.5 : 1.0) * (abs(y) == kReach ? 0.5 : 1.0);
                    sum += weight * behind(at);
                    let_in += weight * texelFetch(entered, at, 0).rgb;
                }
            }
            light.rgb = texelFetch(first_sum, pixel, 0).rgb + sum * texelFetch(entered, pixel, 0).rgb / max(let_in, vec3(1e-6));
        } else {
            light.rgb += texelFetch(parted, ivec2(pixel.x, pixel.y + push.height), 0).rgb;
        }
        light.rgb += texelFetch(parted, pixel, 0).rgb;
    }
    imageStore(tile_radiance, pixel + ivec2(push.from_x, push.from_y), min(max(light, vec4(0.0)), vec4(65000.0)));
}
