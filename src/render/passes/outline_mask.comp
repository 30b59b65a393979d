#version 460
// SPDX-License-Identifier: MIT
// Which pixels show an outlined edit: its record's number + 1, 0 for none; where several edits' surfaces coincide, the last.
// A point is an edit's where the edit's own distance is as good as 0. In a smooth union, min(a, b) - h² k/4 with h = 1 - |a - b|/k, its
// points have moved away from it: on the zero set the nearer operand's distance is h² k/4, at most k/4, and the farther one's
// k (h²/4 + 1 - h), at least k/4. So |a| <= k/4 is exactly "the edit is the nearer of the two", and the line runs where materials mix by
// halves. (The same for subtract and intersect, by sign.) What later edits cover within k/4 counts as the edit's too.
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
layout(set = 0, binding = 5) uniform utexture2D visibility;
layout(set = 0, binding = 6, r32ui) writeonly uniform uimage2D owners;
layout(set = 0, binding = 7, r32ui) writeonly uniform uimage2D seeds;
layout(set = 0, binding = 8, std430) readonly buffer Instances { InstanceRecord instances[]; };
layout(set = 0, binding = 9, std430) readonly buffer Sets { InstanceSet sets[]; };
layout(set = 0, binding = 10, std430) readonly buffer InstanceNumbers { float instance_numbers[]; };
layout(push_constant) uniform Push { OutlinePush push; };

#include "render/passes/rays.glsl"
#include "render/passes/instance_rays.glsl"

#include "render/passes/outline_tape.glsl"

// Trilinear surfaces are this far from their code's at most, where they are not refined.
const float kSurfaceVoxels = 0.6;

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (pixel.x >= frame.tile_width || pixel.y >= frame.tile_height) return;
    uvec4 seen = texelFetch(visibility, pixel, 0);
    uint owner = 0u;
    if ((seen.y >> 28u) != kSeenNothing) {
        TexelRay ray = pixel_ray(pixel);
        vec3 p = seen_point(ray, seen);
        float voxels = (seen.y >> 28u) == kSeenBrick ? float(1u << (seen.z >> kSeenLevelShift)) : 1.0;
        uint seen_instance = kNoInstance;
        if ((seen.y >> 28u) == kSeenInstance) {
            seen_instance = seen.y & 0x0fffffffu;
            InstanceRecord instance = instances[seen_instance];
            here = sets[instance.set];
            vec3 part = vec3(instance.x.w, instance.y.w, instance.z.w) + into_object(instance, from_eye(ray) + ray.direction * uintBitsToFloat(seen.x)) * instance.voxels;
            p = (vec3(instance.eye_x, instance.eye_y, instance.eye_z) + part) * here.grid.voxel_size;
            voxels = 1.0 / instance.voxels;
        }
        of_object = seen_instance != kNoInstance;
        float near = frame.grid.voxel_size * max(kSurfaceVoxels * voxels, 0.5 * frame.pixel_angle * uintBitsToFloat(seen.x));
        for (uint i = 0u; i < push.count; ++i) {
            OutlineRecord r = outlines[i];
            if (r.instance != seen_instance) continue;
            float d = tape_distance(r.code_first, r.code_count, p);
            bool here = r.paints != 0u ? d <= 0.0 : abs(d) <= max(near, r.blend);
            if (here) owner = i + 1u;
        }
    }
    imageStore(owners, pixel, uvec4(owner));
    imageStore(seeds, pixel, uvec4(owner == 0u ? kNoSeed : uint(pixel.x) | (uint(pixel.y) << 16u)));
}
