// SPDX-License-Identifier: MIT
// The brick maps of all levels in kernels, one after another. The including kernel declares first: uint cells[], LevelsParams levels,
// LevelPlace level_places[].

ivec3 level_first_cell(int level) { return ivec3(level_places[level].cell_x, level_places[level].cell_y, level_places[level].cell_z); }

uint level_word(int level, ivec3 cell) {
    ivec3 c = cell & (levels.cells - 1);
    int pages = levels.cells >> 3;
    return cells[level * levels.cells * levels.cells * levels.cells + cell_word_index(c.x, c.y, c.z, pages, pages)];
}
