// SPDX-License-Identifier: MIT
// Levels of a clipmap (Losasso and Hoppe, "Geometry Clipmaps", 2004, for bricks): cubes of cells around a focus, nested, each with voxels
// twice as large as the one inside it. Which of them a place is drawn from, and how one goes over into the next.
//
// A level's cells lie on a torus: the word of a world cell never moves while the window of cells around the focus does. The window may
// be kSlackCells off the focus, so that it need not follow every step; what is drawn of a level is therefore the smaller box of
// level_reach() around the focus itself, and weights depend on the focus alone: they never jump when a window does.
//
// In the outer part of a level, and around bricks that are missing, a corner's value is mix(fine, coarse, w(corner)). On the 2:1
// lattice the coarse field is trilinear inside each fine voxel, so the mixed field is trilinear there too and the cubic solver
// holds as it is. Every corner has one value whichever voxel asks; at the edge of the box every w is 1, where the field is the coarser
// level's own. So there is no crack between voxels, nor between levels.

#ifndef KILN_FIELD_LEVELS_GPU_H
#define KILN_FIELD_LEVELS_GPU_H

#include "field/level_cells.gpu.h"
#include "field/brick.gpu.h"
#include "field/cubic.gpu.h"

KILN_FIELD_BEGIN

KILN_CONST int kMostLevels = 16;
KILN_CONST int kSlackCells = 2;
// A cell of a level owns a brick iff some texel is nearer than this many voxels. From 1.13 on, an empty cell is empty in the coarser level
// too: the coarse field at a corner of the cell is the mean of up to 8 coarse texels, of which those outside the cell lie 1,
// sqrt(2) or sqrt(3) fine voxels from texels of it; at worst the mean is (3 * 1 + 3 * 1.414 + 1.732) / 8 = 1.122 lower.
KILN_CONST float kLevelOwnVoxels = 1.25f;

// What is the same for all levels (48 bytes). Lengths are in finest voxels.
struct LevelsParams {
    int focus_x, focus_y, focus_z;  // finest texel at or below the focus
    int cells;                      // a side, a power of two
    float part_x, part_y, part_z;   // of a voxel, from there to the focus
    float voxel_size;               // finest, metres
    int count;                      // of levels, with those of the net where it is out (clipmap_net.cpp)
    int first;                      // the finest that has anything
    uint atlas_bricks_x_y;          // as in GridParams
    int drawn;                      // of levels, without the net: it is seen only where the last of them has nothing
};

// First cell of a level's window, in world cells of the level (16 bytes).
struct LevelPlace {
    int cell_x, cell_y, cell_z;
    uint pad_0;
};

// Of its voxels, from the focus: the box that a level is drawn in; and where its corners begin to fade, and are all coarse.
KILN_FN float level_reach(int cells) { return float((cells / 2 - kSlackCells - 1) * kBrickVoxels); }
KILN_FN float level_fade_width(int cells) { return float(cells * kBrickVoxels / 16); }
KILN_FN float level_fade_first(int cells) { return level_reach(cells) - 1.0f - level_fade_width(cells); }

// Where texel or cell numbers of the coarser level, or of cells, come from: division rounded down.
KILN_FN int cell_of_texel(int a) { return a >= 0 ? a / kBrickVoxels : -((kBrickVoxels - 1 - a) / kBrickVoxels); }

// The same ray in voxels of a level; its t is 2^-level of the finest's.
KILN_FN TexelRay level_ray(TexelRay ray, int level) {
    float scale = 1.0f / float(1 << level);
    int mask = (1 << level) - 1;
    TexelRay seen = ray;
    seen.part = vec3((float(ray.whole.x & mask) + ray.part.x) * scale, (float(ray.whole.y & mask) + ray.part.y) * scale,
                     (float(ray.whole.z & mask) + ray.part.z) * scale);
    seen.whole = ivec3(ray.whole.x >> level, ray.whole.y >> level, ray.whole.z >> level);
    return seen;
}

// A ray that meets so many missing cells gives its finest level up, again and again.
KILN_CONST int kSpansPerLevel = 96;
// A level looks this much past the place where it hands over, in its own voxels.
KILN_CONST float kHandOver = 0.0078125f;

// What level_march() answers: hit.t in finest voxels; cell, slot and voxel are of `level`.
struct LevelHit {
    MarchHit hit;
    int level;
};

#ifdef __cplusplus
static_assert(sizeof(LevelsParams) == 48 && sizeof(LevelPlace) == 16);
/// As kernels bind it.
struct LevelsBlock {
    LevelsParams params;
    LevelPlace places[kMostLevels];
};
#endif
KILN_FIELD_END

#endif
