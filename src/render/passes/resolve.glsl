// SPDX-License-Identifier: MIT
// What each visible point looks like: normal, material; once per pixel. With KILN_EXACT also points found on exact code.

#include "render/passes/materials.gpu.h"

layout(local_size_x = kTileGroup, local_size_y = kTileGroup) in;

layout(set = 0, binding = 0, std140) uniform Frame { FrameParams frame; };
layout(set = 0, binding = 1, std430) readonly buffer Cells { uint cells[]; };
layout(set = 0, binding = 2, std430) readonly buffer Records { BrickRecord records[]; };
layout(set = 0, binding = 3, std430) readonly buffer Rays { FrameRay rays[]; };
layout(set = 0, binding = 4, std430) readonly buffer Tables { uint tables[]; };
layout(set = 0, binding = 5, std430) readonly buffer MaterialTable { MaterialEntry material_table[]; };
layout(set = 0, binding = 6) uniform texture3D distances;
layout(set = 0, binding = 7) uniform utexture3D materials;
layout(set = 0, binding = 8) uniform utexture2D visibility;  // with t where the surface is
layout(set = 0, binding = 9) uniform utexture2D refined;  // see refine.comp; not read without kFrameRefine
layout(set = 0, binding = 10, rgba32ui) writeonly uniform uimage2D surface_words;
#ifdef KILN_EXACT
layout(set = 0, binding = 11, std430) readonly buffer Code { uvec2 code[]; };
layout(set = 0, binding = 12, std430) readonly buffer ProgramCode { uvec2 program_code[]; };
layout(set = 0, binding = 13, std430) readonly buffer Numbers { float numbers[]; };
#endif

#ifdef KILN_LEVELS
#ifdef KILN_EXACT
const uint kLevelsBinding = 14u;
#else
const uint kLevelsBinding = 11u;
#endif
layout(set = 0, binding = kLevelsBinding, std140) uniform Levels { LevelsParams levels; LevelPlace level_places[kMostLevels]; };
#endif

#include "render/passes/refine.gpu.h"
#define KILN_FIELD_SURFACE
#include "render/passes/field.glsl"
#include "render/passes/rays.glsl"
#include "render/passes/surface.glsl"
#include "render/passes/materials.glsl"
#ifdef KILN_EXACT
#define KILN_TAPE_MATERIALS
#include "render/passes/tape_buffers.glsl"
#include "render/passes/code_of.glsl"
#endif

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (pixel.x >= frame.tile_width || pixel.y >= frame.tile_height) return;
    uvec4 seen = texelFetch(visibility, pixel, 0);
    uint state = seen.y >> 28u;
    int slot = int(seen.y & 0x0fffffffu);
    float t = uintBitsToFloat(seen.x);
    if (state == kSeenInstance) return;  // resolve_instances.comp's
    if (state == kSeenNothing || state == kSeenMesh) {  // meshes: mesh_resolve fills them in
        imageStore(surface_words, pixel, uvec4(0u));
        return;
    }
    TexelRay ray = pixel_ray(pixel);
    SurfaceSample s = SurfaceSample(vec3(0.0), -ray.direction, 0.0, 0.0, 1.0, kSurfaceHit, vec3(0.0));
    uvec4 asked = uvec4(kNotRefined);
    if (state == kSeenBrick && (frame.flags & kFrameRefine) != 0u) asked = texelFetch(refined, pixel, 0);
    if (asked.x != kNotRefined) {
        s.normal = unpack_unit(asked.y);
        float share = uintBitsToFloat(asked.w);
        add_material(s, asked.z & 0xffffu, 1.0 - share);
        if (share > 0.0) add_material(s, asked.z >> 16u, share);
    } else if (state == kSeenBrick) {
        BrickRecord record = records[slot];
        ivec3 texel = ivec3(record.texel_x, record.texel_y, record.texel_z);
        ivec3 voxel = ivec3(seen.z & 7u, (seen.z >> 3u) & 7u, (seen.z >> 6u) & 7u);
#ifdef KILN_LEVELS
        int level = int(record.level);
        here_level = level;
        BrickRay local = brick_ray(level_ray(ray, level), texel);
        vec3 p = voxel_point(local, voxel, t / float(1 << level) - local.t_base);
        s.normal = unit_or(level_gradient(level, texel / kBrickVoxels, vec3(voxel) + p), -ray.direction);
#else
        BrickRay local = brick_ray(ray, texel);
        vec3 p = voxel_point(local, voxel, t - local.t_base);
        s.normal = unit_or(dual_gradient(slot, texel / kBrickVoxels, vec3(voxel) + p), -ray.direction);
#endif
        SurfaceMaterial mixed = surface_material(slot, voxel, p);
        add_material(s, tables[slot * kBrickTableWords + int(mixed.slot0)], 1.0 - mixed.share);
        if (mixed.share > 0.0) add_material(s, tables[slot * kBrickTableWords + int(mixed.slot1)], mixed.share);
#ifdef KILN_EXACT
    } else if (state != kSeenInside && kPlanes > 0) {
        float d;
        HorizonPlane plane = frame.planes[nearest_plane(seen_point(ray, seen), d)];
        s.normal = normalize(vec3(plane.normal_x, plane.normal_y, plane.normal_z));
        add_material(s, plane.material, 1.0);
    } else if (state != kSeenInside) {
        uvec2 here_code = code_of(state, slot);
        float h = frame.grid.voxel_size;
        vec3 p_world = (vec3(ray.whole) + ray.part) * h + ray.direction * (t * h);
        vec3 size = abs(p_world);
        float step = refine_gradient_step(h, max(max(size.x, size.y), size.z));
        if (state == kSeenOutside) step = max(step, 0.25 * frame.pixel_angle * t * h);
        vec3 gradient = vec3(0.0);
        float d_here = 0.0;
        float d_up = 0.0;
        bool up_is_other = false;
        Mix mixed = make_mix(0.0, float(kNoMaterial), 0.0);
        for (int i = 0; i < 7; ++i) {
            vec3 away = vec3(0.0);
            if (i > 0) away[(i - 1) >> 1] = (i & 1) == 1 ? step : -step;
            Mix here;
            float d = tape_materials(here_code.x, here_code.y, p_world + away, true, here);
            if (i == 0) {
                mixed = here;
                d_here = d;
            } else if ((i & 1) == 1) {
                d_up = d;
                up_is_other = here.id0 != mixed.id0;
            } else {
                gradient[(i - 1) >> 1] = refine_slope(d_up, d, d_here, up_is_other, here.id0 != mixed.id0);
            }
        }
        s.normal = unit_or(gradient, -ray.direction);
        add_material(s, uint(mixed.id0), 1.0 - mixed.share);
        if (mixed.share > 0.0) add_material(s, uint(mixed.id1), mixed.share);
#endif
    } else {
        add_material(s, 0u, 1.0);
    }
    imageStore(surface_words, pixel, pack_surface(s));
}
