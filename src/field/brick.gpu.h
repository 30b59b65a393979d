// SPDX-License-Identifier: MIT
// What a brick is, in words both C++ and GLSL read: sizes, the cell word of the brick map, the brick record, material texels.
// A brick holds 8x8x8 texels covering 7x7x7 voxels; neighbours share a face of texels. Texel i of the world lies at i * voxel_size
// (i a global integer triple), so a shared texel has one position and one value whoever owns it.

#ifndef KILN_FIELD_BRICK_GPU_H
#define KILN_FIELD_BRICK_GPU_H

#include "field/words.gpu.h"

KILN_FIELD_BEGIN
KILN_CONST int kBrickTexels = 8;  // texels a side
KILN_CONST int kBrickVoxels = 7;  // voxels (and texel steps) a side
KILN_CONST int kBrickTexelCount = 512;
KILN_CONST float kCellsPerVoxel = 0.142857149f;  // 1 / 7: every device multiplies alike
KILN_CONST float kBandVoxels = 4.0f;             // stored distances are clamped to this many voxels
KILN_CONST float kTrilinearErrorVoxels =
    0.8661f;  // sqrt(3)/2: a trilinear value minus this is a lower bound of the distance

// Cell word: occupied (bit 31) with the brick's slot in the low 24 bits; or empty, with its sign (bit 30: inside) and the jump.
// jump: Chebyshev distance in cells to the nearest occupied cell, capped; every cell nearer than that is empty and of the same sign.
KILN_CONST uint kCellOccupied = 0x80000000u;
KILN_CONST uint kCellInside = 0x40000000u;
KILN_CONST uint kCellSlotMask = 0x00ffffffu;
// On levels: nothing is known here yet, ask the next coarser level; and, of an occupied cell, one around it is missing.
KILN_CONST uint kCellMissing = 0x80ffffffu;
KILN_CONST uint kCellFades = 0x20000000u;
KILN_CONST int kMaxJump = 7;

// Cell words lie in pages of kCellPage cells a side, x fastest in both: the word of a cell counted from the grid's first, for a map of
// that many pages along x and y. A page's cells beyond the grid mean nothing.
KILN_CONST int kCellPage = 8;
KILN_FN int cell_word_index(int x, int y, int z, int pages_x, int pages_y) {
    int page = ((z >> 3) * pages_y + (y >> 3)) * pages_x + (x >> 3);
    return page * 512 + (z & 7) * 64 + (y & 7) * 8 + (x & 7);
}

// One per pool slot, in a storage buffer (32 bytes): where the brick is and which code describes it.
struct BrickRecord {
    int texel_x, texel_y, texel_z;  // global texel index of texel (0, 0, 0): 7 * cell
    uint code_first;                // pruned code of the brick's ball, in instructions (8 bytes each)
    uint code_count;                // 0: a free slot
    uint level;                     // of a clipmap; its texels are 2^level times the finest
    uint far;                       // 1: world coordinates there are too coarse in floats to run the code
    uint pad_0;
};

// The grid (32 bytes).
struct GridParams {
    int cell_x, cell_y, cell_z;  // first cell of the grid, in world cells of 7 voxels
    float voxel_size;            // metres
    int size_x, size_y, size_z;  // cells
    uint
        atlas_bricks_x_y;  // bricks along x of the atlas in the low 16 bits, along y in the high; slot = (bz * by + y) * bx + x
};

// Material texel, 16 bits: palette slots (4 bits each) of the two heaviest materials and the second's share in [0, 1/2] as 0 … 255.
// word = slot0 | slot1 << 4 | weight << 8; share = weight / 510. A brick's palette is 16 material numbers (kPaletteSize uints) at slot * 16.
KILN_CONST int kPaletteSize = 16;

// What a renderer keeps of a brick beside its texels, words at slot * kBrickTableWords: the palette; then SolidRows of solid.h, which voxels
// have a solid texel, a byte a row and a bit a voxel. A ray meets nothing in the others.
KILN_CONST int kBrickTableWords = 32;
KILN_CONST int kSolidMaskWords = 14;  // two a layer of z
KILN_FN int solid_mask_word(int y, int z) { return kPaletteSize + 2 * z + (y >> 2); }
KILN_FN int solid_mask_bit(int x, int y) { return (y & 3) * 8 + x; }

#ifdef __cplusplus
static_assert(sizeof(BrickRecord) == 32 && sizeof(GridParams) == 32);
#endif
KILN_FIELD_END

#endif
