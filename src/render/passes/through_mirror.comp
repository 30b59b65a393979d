#version 460
// SPDX-License-Identifier: MIT
// The rays that glass throws back where pixels' rays meet it, so that what is solid is seen in it.
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
layout(set = 0, binding = 5) uniform utexture2D layer_seen;
layout(set = 0, binding = 6) uniform utexture2D layer_words;
layout(set = 0, binding = 7, std430) writeonly buffer RaysMirrored { FrameRay rays_mirrored[]; };
layout(push_constant) uniform Push { ThroughPush push; };

#include "render/passes/rays.glsl"
#include "render/passes/instance_rays.glsl"
#include "render/passes/surface.glsl"
#include "render/passes/through_glass.glsl"

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (pixel.x >= push.width || pixel.y >= push.height) return;
    FrameRay mirrored = resting_ray();
    uvec4 seen = texelFetch(layer_seen, pixel, 0);
    if ((seen.y >> 28u) == kSeenInstance) {
        TexelRay ray = pixel_ray(pixel);
        vec3 n = towards(unpack_surface(texelFetch(layer_words, pixel, 0)).normal, ray.direction);
        vec3 at = from_eye(ray) + ray.direction * uintBitsToFloat(seen.x);
        mirrored = frame_ray(at + n * (kOffVoxels / instances[seen.y & 0x0fffffffu].voxels), reflect(ray.direction, n));
    }
    rays_mirrored[pixel.y * push.width + pixel.x] = mirrored;
}
