#version 460
// SPDX-License-Identifier: MIT
// Middles of particles as a picture of surfaces that look at the sun, a pixel each, so that the passes of shadows say what they see of it. Their rays
// begin there: the way along them is 0.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#include "render/passes/frame.gpu.h"
#include "render/passes/particles.gpu.h"
#include "render/passes/shadow.gpu.h"

layout(local_size_x = kTileGroup, local_size_y = kTileGroup) in;

layout(set = 0, binding = 0, std430) readonly buffer Lights { LightRecord lights[]; };
layout(set = 0, binding = 1, rgba32ui) writeonly uniform uimage2D visibility;
layout(set = 0, binding = 2, rgba32ui) writeonly uniform uimage2D surface_words;
layout(push_constant) uniform Push { ParticlePush push; };

#include "render/passes/surface.glsl"

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    ivec2 size = imageSize(visibility);
    if (pixel.x >= size.x || pixel.y >= size.y) return;
    uint state = uint(pixel.y * size.x + pixel.x) < push.count ? kSeenOutside : kSeenNothing;
    SurfaceSample s = SurfaceSample(vec3(0.0), -lights[push.sun].direction.xyz, 1.0, 0.0, 1.0, kSurfaceHit, vec3(0.0));
    imageStore(visibility, pixel, uvec4(floatBitsToUint(0.0), state << 28u, 0u, 0u));
    imageStore(surface_words, pixel, pack_surface(s));
}
