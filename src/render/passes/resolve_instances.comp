#version 460
// SPDX-License-Identifier: MIT
// What each visible point of an instance looks like: normal, material, depth, into the G-buffer that resolve wrote of all else.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#include "render/passes/frame.gpu.h"
#include "render/passes/instances.gpu.h"
#include "render/passes/materials.gpu.h"

layout(local_size_x = kTileGroup, local_size_y = kTileGroup) in;

layout(set = 0, binding = 0, std140) uniform Frame { FrameParams frame; };
layout(set = 0, binding = 1, std430) readonly buffer Instances { InstanceRecord instances[]; };
layout(set = 0, binding = 2, std430) readonly buffer Sets { InstanceSet sets[]; };
layout(set = 0, binding = 3, std430) readonly buffer Cells { uint instance_cells[]; };
layout(set = 0, binding = 4, std430) readonly buffer Records { BrickRecord records[]; };
layout(set = 0, binding = 5, std430) readonly buffer Rays { FrameRay rays[]; };
layout(set = 0, binding = 6, std430) readonly buffer Tables { uint tables[]; };
layout(set = 0, binding = 7, std430) readonly buffer MaterialTable { MaterialEntry material_table[]; };
layout(set = 0, binding = 8) uniform texture3D distances;
layout(set = 0, binding = 9) uniform utexture3D materials;
layout(set = 0, binding = 10) uniform utexture2D visibility;  // with t where the surface is
layout(set = 0, binding = 11) uniform utexture2D refined;  // see refine.comp; not read without kFrameRefine
layout(set = 0, binding = 12, rgba32ui) writeonly uniform uimage2D surface_words;

#include "render/passes/refine.gpu.h"
#define KILN_FIELD_SURFACE
#include "render/passes/instances.glsl"
#include "render/passes/rays.glsl"
#include "render/passes/surface.glsl"
#include "render/passes/materials.glsl"

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (pixel.x >= frame.tile_width || pixel.y >= frame.tile_height) return;
    uvec4 seen = texelFetch(visibility, pixel, 0);
    if ((seen.y >> 28u) != kSeenInstance) return;
    InstanceRecord instance = instances[seen.y & 0x0fffffffu];
    here = sets[instance.set];
    float t = uintBitsToFloat(seen.x);
    TexelRay ray = pixel_ray(pixel);
    SurfaceSample s = SurfaceSample(vec3(0.0), -ray.direction, 0.0, 0.0, 1.0, kSurfaceHit, vec3(0.0));
    uvec4 asked = uvec4(kNotRefined);
    if ((frame.flags & kFrameRefine) != 0u) asked = texelFetch(refined, pixel, 0);
    uint number0;
    uint number1;
    float share;
    if (asked.x != kNotRefined) {
        s.normal = unpack_unit(asked.y);
        number0 = asked.z & 0xffffu;
        number1 = asked.z >> 16u;
        share = uintBitsToFloat(asked.w);
    } else {
        int slot = int(seen.z >> kInstanceSlotShift);
        BrickRecord record = records[int(here.records_first) + slot];
        ivec3 texel = ivec3(record.texel_x, record.texel_y, record.texel_z);
        ivec3 voxel = ivec3(seen.z & 7u, (seen.z >> 3u) & 7u, (seen.z >> 6u) & 7u);
        BrickRay local = brick_ray(object_ray(instance, from_eye(ray), ray.direction), texel);
        vec3 p = voxel_point(local, voxel, t * instance.voxels - local.t_base);
        s.normal = unit_or(out_of_object(instance, dual_gradient(slot, texel / kBrickVoxels, vec3(voxel) + p)), -ray.direction);
        SurfaceMaterial mixed = surface_material(slot, voxel, p);
        int table = (slot + int(here.slot_first)) * kBrickTableWords;
        number0 = tables[table + int(mixed.slot0)];
        number1 = tables[table + int(mixed.slot1)];
        share = mixed.share;
    }
    add_material(s, number0 == 0u ? instance.material : number0, 1.0 - share);
    if (share > 0.0) add_material(s, number1 == 0u ? instance.material : number1, share);
    imageStore(surface_words, pixel, pack_surface(s));
}
