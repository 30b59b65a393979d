#version 460
// SPDX-License-Identifier: MIT
// Where something hides an outlined edit: for pixels that no outlined thing is seen at, the ray is marched through each edit's own code as if
// nothing else were there. A part that later edits cut away counts too: that is what the edit alone would look like.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#include "render/passes/frame.gpu.h"
#include "render/passes/instances.gpu.h"
#include "render/passes/outline.gpu.h"

layout(local_size_x = kTileGroup, local_size_y = kTileGroup) in;

layout(set = 0, binding = 0, std140) uniform Frame { FrameParams frame; };
layout(set = 0, binding = 1, std430) readonly buffer Rays { FrameRay rays[]; };
layout(set = 0, binding = 2, std430) readonly buffer Code { uvec2 code[]; };
layout(set = 0, binding = 3, std430) readonly buffer Numbers { float numbers[]; };
layout(set = 0, binding = 4, std430) readonly buffer Outlines { OutlineRecord outlines[]; };
layout(set = 0, binding = 5) uniform utexture2D owners_seen;
layout(set = 0, binding = 6, r32ui) writeonly uniform uimage2D owners;
layout(set = 0, binding = 7, r32ui) writeonly uniform uimage2D seeds;
layout(set = 0, binding = 8, std430) readonly buffer Instances { InstanceRecord instances[]; };
layout(set = 0, binding = 9, std430) readonly buffer Sets { InstanceSet sets[]; };
layout(set = 0, binding = 10, std430) readonly buffer InstanceNumbers { float instance_numbers[]; };
layout(push_constant) uniform Push { OutlinePush push; };

#include "render/passes/rays.glsl"
#include "render/passes/instance_rays.glsl"
#include "render/passes/outline_tape.glsl"

const float kFarMetres = 1e5;
const int kMostSteps = 128;

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (pixel.x >= frame.tile_width || pixel.y >= frame.tile_height) return;
    uint owner = texelFetch(owners_seen, pixel, 0).r;
    if (owner == 0u) {
        TexelRay ray = pixel_ray(pixel);
        float nearest = kFarMetres;
        for (uint i = 0u; i < push.count; ++i) {
            OutlineRecord r = outlines[i];
            of_object = r.instance != kNoInstance;
            vec3 from = (vec3(ray.whole) + ray.part) * frame.grid.voxel_size;
            vec3 direction = ray.direction;
            if (of_object) {
                InstanceRecord instance = instances[r.instance];
                here = sets[instance.set];
                vec3 part = vec3(instance.x.w, instance.y.w, instance.z.w) + into_object(instance, from_eye(ray)) * instance.voxels;
                from = (vec3(instance.eye_x, instance.eye_y, instance.eye_z) + part) * here.grid.voxel_size;
                direction = into_object(instance, direction);
            }
            // The code's values are no more than the true distance.
            float t = 0.0;
            for (int step = 0; step < kMostSteps && t < nearest; ++step) {
                float d = tape_distance(r.code_first, r.code_count, from + direction * t);
                float enough = max(0.05 * frame.grid.voxel_size, 0.25 * frame.pixel_angle * t);
                if (d <= enough) {
                    owner = i + 1u;
                    nearest = t;
                    break;
                }
                t += d;
            }
        }
    }
    imageStore(owners, pixel, uvec4(owner));
    imageStore(seeds, pixel, uvec4(owner == 0u ? kNoSeed : uint(pixel.x) | (uint(pixel.y) << 16u)));
}
