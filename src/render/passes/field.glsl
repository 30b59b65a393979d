// SPDX-License-Identifier: MIT
// The baked field in kernels: what field/march.gpu.h and field/surface.gpu.h ask for. The including kernel declares first:
//   FrameParams frame, uint cells[] (the brick map), texture3D distances (the atlas), uint tables[] (palettes and solid masks);
//   with KILN_LEVELS also LevelsParams levels, LevelPlace level_places[];
//   for KILN_FIELD_SURFACE also utexture3D materials (two texels a word, along x).

#include "field/brick_walk.gpu.h"
#include "field/codes.gpu.h"
#include "field/cubic.gpu.h"

#ifdef KILN_LEVELS
#include "render/passes/level_map.glsl"
#else
#include "render/passes/map.glsl"
#endif

#include "render/passes/atlas.glsl"

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

uint field_material(int slot, ivec3 texel) { return brick_material(slot, texel); }

#include "field/surface.gpu.h"
#endif
