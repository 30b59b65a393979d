#version 460
// SPDX-License-Identifier: MIT
// The rays inside glass that pixels' rays go into, so that what is solid in there can be looked for.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#include "render/passes/frame.gpu.h"
#include "render/passes/glass.gpu.h"
#include "render/passes/instances.gpu.h"

layout(local_size_x = kTileGroup, local_size_y = kTileGroup) in;

layout(set = 0, binding = 0, std140) uniform Frame { FrameParams frame; };
layout(set = 0, binding = 1, std430) readonly buffer Rays { FrameRay rays[]; };
layout(set = 0, binding = 2, std430) readonly buffer Instances { InstanceRecord instances[]; };
layout(set = 0, binding = 3, std430) readonly buffer Sets { InstanceSet sets[]; };  // named by instance_rays.glsl, not read
layout(set = 0, binding = 4, std430) readonly buffer Glass { GlassRecord glass[]; };
layout(set = 0, binding = 5) uniform utexture2D layer_seen;
layout(set = 0, binding = 6) uniform utexture2D layer_words;
layout(set = 0, binding = 7, std430) writeonly buffer RaysInside { FrameRay rays_inside[]; };
layout(push_constant) uniform Push { ThroughPush push; };

#include "render/passes/rays.glsl"
#include "render/passes/instance_rays.glsl"
#include "render/passes/surface.glsl"
#include "render/passes/through_glass.glsl"

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (pixel.x >= push.width || pixel.y >= push.height) return;
    FrameRay inside = resting_ray();
    uvec4 seen = texelFetch(layer_seen, pixel, 0);
    if ((seen.y >> 28u) == kSeenInstance) {
        uint index = seen.y & 0x0fffffffu;
        TexelRay ray = pixel_ray(pixel);
        vec3 n = towards(unpack_surface(texelFetch(layer_words, pixel, 0)).normal, ray.direction);
        vec3 at = from_eye(ray) + ray.direction * uintBitsToFloat(seen.x);
        inside = frame_ray(at - n * (kOffVoxels / instances[index].voxels), refracted(ray.direction, n, 1.0 / glass[index].ior));
    }
    rays_inside[pixel.y * push.width + pixel.x] = inside;
}
