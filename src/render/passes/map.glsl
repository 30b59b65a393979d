// SPDX-License-Identifier: MIT
// The brick map in kernels. The including kernel declares first: FrameParams frame, uint cells[].

// Cell word of a cell counted from the grid's first.
uint field_cell(ivec3 c) {
    return cells[cell_word_index(c.x, c.y, c.z, (frame.grid.size_x + kCellPage - 1) >> 3, (frame.grid.size_y + kCellPage - 1) >> 3)];
}

bool in_grid(ivec3 c) {
    return all(greaterThanEqual(c, ivec3(0))) && all(lessThan(c, ivec3(frame.grid.size_x, frame.grid.size_y, frame.grid.size_z)));
}

ivec3 grid_first_cell() { return ivec3(frame.grid.cell_x, frame.grid.cell_y, frame.grid.cell_z); }
