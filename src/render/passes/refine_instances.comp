#version 460
// SPDX-License-Identifier: MIT
// What refine.comp does, of points found on instances: in the object's frame, by its own code. Normals come back into the world, material
// numbers as the object has them.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#include "render/passes/frame.gpu.h"
#include "render/passes/instances.gpu.h"
#include "render/passes/refine.gpu.h"

layout(local_size_x = kTileGroup, local_size_y = kTileGroup) in;

layout(set = 0, binding = 0, std140) uniform Frame { FrameParams frame; };
layout(set = 0, binding = 1, std430) readonly buffer Instances { InstanceRecord instances[]; };
layout(set = 0, binding = 2, std430) readonly buffer Sets { InstanceSet sets[]; };
layout(set = 0, binding = 3, std430) readonly buffer Records { BrickRecord records[]; };
layout(set = 0, binding = 4, std430) readonly buffer Code { uvec2 code[]; };
layout(set = 0, binding = 5, std430) readonly buffer Numbers { float numbers[]; };
layout(set = 0, binding = 6, std430) readonly buffer Rays { FrameRay rays[]; };
layout(set = 0, binding = 7) uniform utexture2D visibility;
layout(set = 0, binding = 8, rgba32ui) writeonly uniform uimage2D refined;

#define KILN_TAPE_MATERIALS
#include "render/lib/octahedral.gpu.h"
#include "render/passes/rays.glsl"
#include "render/passes/instance_rays.glsl"

uvec2 sdf_code(uint at) { return code[here.code_first + at]; }
float sdf_param(uint at) { return numbers[here.params_first + at]; }
float sdf_sample(uint at) { return numbers[here.samples_first + at]; }
#include "render/passes/tape_use.glsl"
#include "sdf/tape.glsl"

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (pixel.x >= frame.tile_width || pixel.y >= frame.tile_height) return;
    uvec4 seen = texelFetch(visibility, pixel, 0);
    if ((seen.y >> 28u) != kSeenInstance) return;
    InstanceRecord instance = instances[seen.y & 0x0fffffffu];
    here = sets[instance.set];
    BrickRecord record = records[here.records_first + (seen.z >> kInstanceSlotShift)];
    TexelRay ray = pixel_ray(pixel);
    ivec3 texel = ivec3(record.texel_x, record.texel_y, record.texel_z);
    BrickRay local = brick_ray(object_ray(instance, from_eye(ray), ray.direction), texel);
    float h = here.grid.voxel_size;  // t counts voxels of the object
    float t_first = uintBitsToFloat(seen.x) * instance.voxels;
    float t = t_first;
    float t_before = t;
    float d_before = 0.0;
    vec3 size = abs(brick_point(local, texel, t) * h);
    float coordinate = max(max(size.x, size.y), size.z);
    float step = refine_gradient_step(h, coordinate);
    float enough = refine_enough(h, coordinate);
    vec3 gradient = vec3(0.0);
    float d_here = 0.0;
    float d_up = 0.0;
    bool up_is_other = false;
    Mix mixed = make_mix(0.0, 0.0, 0.0);
    uvec4 words = uvec4(kNotRefined, 0u, 0u, 0u);
    // A ray inside glass goes from less to more.
    float side = (frame.flags & kFrameRays) != 0u && rays[pixel.y * frame.tile_width + pixel.x].within > 0.0 ? -1.0 : 1.0;
    // As in refine.comp: one call for all looks.
    for (int i = -kRefineSteps; i < 7; ++i) {
        vec3 away = vec3(0.0);
        if (i > 0) away[(i - 1) >> 1] = (i & 1) == 1 ? step : -step;
        Mix found;
        float d = tape_materials(record.code_first, record.code_count, brick_point(local, texel, t) * h + away, i >= 0, found) / h;
        if (i < 0) {
            if (abs(d) <= enough) {
                i = -1;
                continue;
            }
            float next = refine_next(i + kRefineSteps, t_before, d_before, t, side * d);
            t_before = t;
            d_before = side * d;
            t = next;
        } else if (i == 0) {
            if (!refine_holds(t_first, t, d)) break;
            mixed = found;
            d_here = d;
        } else if ((i & 1) == 1) {
            d_up = d;
            up_is_other = found.id0 != mixed.id0;
        } else {
            gradient[(i - 1) >> 1] = refine_slope(d_up, d, d_here, up_is_other, found.id0 != mixed.id0);
        }
    }
    float steep = length(gradient);
    if (steep > 0.0) {
        words = uvec4(floatBitsToUint(t / instance.voxels), pack_unit(out_of_object(instance, gradient / steep)), uint(mixed.id0) | (uint(mixed.id1) << 16u), floatBitsToUint(mixed.share));
    }
    imageStore(refined, pixel, words);
}
