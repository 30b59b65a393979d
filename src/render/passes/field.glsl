// SPDX-License-Identifier: MIT
// The baked field in kernels: what field/march.gpu.h and field/surface.gpu.h ask for. The including kernel declares first:
//   FrameParams frame, uint cells[] (the brick map), texture3D distances (the atlas), uint tables[] (palettes and solid masks);
//   with KILN_LEVELS also LevelsParams levels, LevelPlace level_places[];
//   for KILN_FIELD_SURFACE also utexture3D materials (two texels a word, along x).

#include "field/codes.gpu.h"
#include "field/cubic.gpu.h"

#ifdef KILN_LEVELS
#include "render/passes/level_map.glsl"
#else
#include "render/passes/map.glsl"
#endif

// Texel (0, 0, 0) of a slot in the atlas.
ivec3 atlas_corner(int slot) {
    int bricks_x = int(frame.grid.atlas_bricks_x_y & 0xffffu);
    int bricks_y = int(frame.grid.atlas_bricks_x_y >> 16u);
    return ivec3(slot % bricks_x, (slot / bricks_x) % bricks_y, slot / (bricks_x * bricks_y)) * kBrickTexels;
}

float brick_texel(int slot, ivec3 texel) { return texelFetch(distances, atlas_corner(slot) + texel, 0).r * frame.distance_scale; }

Corners brick_corners(int slot, ivec3 voxel) {
    ivec3 at = atlas_corner(slot) + voxel;
    float scale = frame.distance_scale;
    Corners c;
    c.v000 = texelFetch(distances, at, 0).r * scale;
    c.v100 = texelFetch(distances, at + ivec3(1, 0, 0), 0).r * scale;
    c.v010 = texelFetch(distances, at + ivec3(0, 1, 0), 0).r * scale;
    c.v110 = texelFetch(distances, at + ivec3(1, 1, 0), 0).r * scale;
    c.v001 = texelFetch(distances, at + ivec3(0, 0, 1), 0).r * scale;
    c.v101 = texelFetch(distances, at + ivec3(1, 0, 1), 0).r * scale;
    c.v011 = texelFetch(distances, at + ivec3(0, 1, 1), 0).r * scale;
    c.v111 = texelFetch(distances, at + ivec3(1, 1, 1), 0).r * scale;
    return c;
}

bool brick_voxel_solid(int slot, ivec3 voxel) {
    uint word = tables[slot * kBrickTableWords + solid_mask_word(voxel.y, voxel.z)];
    return (frame.flags & kFrameAccelerate) == 0u || ((word >> solid_mask_bit(voxel.x, voxel.y)) & 1u) != 0u;
}

#ifdef KILN_LEVELS
#include "field/level_field.gpu.h"
#include "field/march.gpu.h"
#include "field/level_march.gpu.h"
// Any brick that resolve looks at, without the mix: gradients have level_gradient().
int field_slot(ivec3 cell) { return level_slot(here_level, cell); }
#else
float field_texel(int slot, ivec3 texel) { return brick_texel(slot, texel); }
Corners field_corners(int slot, ivec3 voxel) { return brick_corners(slot, voxel); }
bool field_voxel_solid(int slot, ivec3 voxel) { return brick_voxel_solid(slot, voxel); }
void field_enter(uint word, ivec3 texel) {}
#include "field/march.gpu.h"
#endif

#ifdef KILN_FIELD_SURFACE
#ifdef KILN_LEVELS
float field_texel(int slot, ivec3 texel) { return brick_texel(slot, texel); }
#else
// Brick of a world cell, -1 where there is none.
int field_slot(ivec3 cell) {
    ivec3 c = cell - grid_first_cell();
    if (!in_grid(c)) return -1;
    uint word = field_cell(c);
    return (word & kCellOccupied) != 0u ? int(word & kCellSlotMask) : -1;
}
#endif

uint field_material(int slot, ivec3 texel) {
    ivec3 at = atlas_corner(slot) + texel;
    uint two = texelFetch(materials, ivec3(at.x >> 1, at.y, at.z), 0).r;
    return (at.x & 1) == 0 ? two & 0xffffu : two >> 16u;
}

#include "field/surface.gpu.h"
#endif
