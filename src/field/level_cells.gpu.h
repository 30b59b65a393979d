// SPDX-License-Identifier: MIT
// How many cells a side a clipmap's level may have: what readers of scenes know of levels.

#ifndef KILN_FIELD_LEVEL_CELLS_GPU_H
#define KILN_FIELD_LEVEL_CELLS_GPU_H

#include "field/words.gpu.h"

KILN_FIELD_BEGIN

// Fewer would let a level's fading part reach past the next; the words of more, on all levels, would fill more than a buffer (128 MiB).
KILN_CONST int kFewestLevelCells = 32;
KILN_CONST int kMostLevelCells = 128;

KILN_FIELD_END

#endif
