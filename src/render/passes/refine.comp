#version 460
// SPDX-License-Identifier: MIT
// Points found in bricks, asked of the brick's own code: where on the ray they are, their normal, their materials. Texels a voxel
// apart round creases, and where two surfaces part at a shallow angle they draw steps. A pixel: t (bits of a float, voxels; kNotRefined: as march found it) | normal | material numbers, 16 bits each | share.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#include "render/passes/frame.gpu.h"
#include "render/passes/refine.gpu.h"

layout(local_size_x = kTileGroup, local_size_y = kTileGroup) in;

layout(set = 0, binding = 0, std140) uniform Frame { FrameParams frame; };
layout(set = 0, binding = 1, std430) readonly buffer Records { BrickRecord records[]; };
layout(set = 0, binding = 2, std430) readonly buffer Code { uvec2 code[]; };
layout(set = 0, binding = 3, std430) readonly buffer ProgramCode { uvec2 program_code[]; };
layout(set = 0, binding = 4, std430) readonly buffer Numbers { float numbers[]; };
layout(set = 0, binding = 5, std430) readonly buffer Rays { FrameRay rays[]; };
layout(set = 0, binding = 6) uniform utexture2D visibility;
layout(set = 0, binding = 7, rgba32ui) writeonly uniform uimage2D refined;

#define KILN_TAPE_MATERIALS
#include "render/lib/octahedral.gpu.h"
#include "render/passes/rays.glsl"
#include "render/passes/tape_buffers.glsl"

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (pixel.x >= frame.tile_width || pixel.y >= frame.tile_height) return;
    uvec4 seen = texelFetch(visibility, pixel, 0);
    uvec4 words = uvec4(kNotRefined, 0u, 0u, 0u);
    if ((seen.y >> 28u) == kSeenBrick) {
        BrickRecord record = records[seen.y & 0x0fffffffu];
        if (record.far != 0u) {
            imageStore(refined, pixel, words);
            return;
        }
        TexelRay ray = pixel_ray(pixel);
        float scale = float(1u << record.level);
        vec3 origin = (vec3(ray.whole) + ray.part) * frame.grid.voxel_size;
        float h = frame.grid.voxel_size * scale;  // from here on t counts voxels of the brick's level
        float t_first = uintBitsToFloat(seen.x) / scale;
        float t = t_first;
        float t_before = t;
        float d_before = 0.0;
        vec3 size = abs(origin + ray.direction * (t * h));
        float coordinate = max(max(size.x, size.y), size.z);
        float step = refine_gradient_step(h, coordinate);
        float enough = refine_enough(h, coordinate);
        vec3 gradient = vec3(0.0);
        float d_here = 0.0;
        float d_up = 0.0;
        bool up_is_other = false;
        Mix mixed = make_mix(0.0, 0.0, 0.0);
        // One call serves the looks for the place, the one at it, and the six around it: every inlined copy costs compile time.
        for (int i = -kRefineSteps; i < 7; ++i) {
            vec3 away = vec3(0.0);
            if (i > 0) away[(i - 1) >> 1] = (i & 1) == 1 ? step : -step;
            Mix here;
            float d = tape_materials(record.code_first, record.code_count, origin + ray.direction * (t * h) + away, i >= 0, here) / h;
            if (i < 0) {
                if (abs(d) <= enough) {
                    i = -1;
                    continue;
                }
                float next = refine_next(i + kRefineSteps, t_before, d_before, t, d);
                t_before = t;
                d_before = d;
                t = next;
            } else if (i == 0) {
                if (!refine_holds(t_first, t, d)) break;
                mixed = here;
                d_here = d;
            } else if ((i & 1) == 1) {
                d_up = d;
                up_is_other = here.id0 != mixed.id0;
            } else {
                gradient[(i - 1) >> 1] = refine_slope(d_up, d, d_here, up_is_other, here.id0 != mixed.id0);
            }
        }
        float steep = length(gradient);
        if (steep > 0.0) {
            words = uvec4(floatBitsToUint(t * scale), pack_unit(gradient / steep), uint(mixed.id0) | (uint(mixed.id1) << 16u), floatBitsToUint(mixed.share));
        }
    }
    imageStore(refined, pixel, words);
}
