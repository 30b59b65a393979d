// SPDX-License-Identifier: MIT
// The primary march for traversals that meet cells in no order (ray-tracing pipelines over a box a cell). field_march() looks at the cells
// that its walk comes through, one after the other, and ends in the first that march_cell() says yes to. That answer depends on ray and cell
// alone, so all that is needed of the walk is which cells are on it, and in which order: this text says both of a cell by itself, exactly.
//
// The walk starts in start.cell. From then on it crosses planes of cells, those of each axis in the order of their numbers; of the next
// planes of the three axes it takes the one with the least parameter, x before y before z among equals. So it crosses planes in the order
// of (parameter, axis), and is in a cell from when it has crossed the cell's last entry plane until it crosses the first of its exits:
//     on the way      <=>  every entry comes before every exit of another axis
//     earlier         <=>  its last entry is earlier
// Parameters are those the walk computes, so nothing is left to rounding. What bounds a cell for the traversal is only a promise that no
// cell on the way is left out (kBoxMargin). Cells with one parameter are those of a walk through an edge or corner of the lattice: they
// follow each other, and box_march_before() leads from one to the one before.
// The includer has march.gpu.h before this text. In C++ it is included inside a struct.

// Is the entry of axis a after the exit of axis b?
KILN_FN bool entry_after_exit(float in_a, int a, float out_b, int b) {
    return in_a > out_b || (in_a == out_b && a > b);
}

// Is this cell (counted from the grid's first, in the grid) on the way? Then `t` is where the walk enters it, and `axis` the axis whose plane
// it crosses there: -1 in start.cell.
KILN_FN bool box_march_visits(TexelRay ray, MarchStart start, ivec3 cell, float t_max, KILN_INOUT(float) t,
                              KILN_INOUT(int) axis) {
    bool up_x = ray.inverse.x > 0.0f;
    bool up_y = ray.inverse.y > 0.0f;
    bool up_z = ray.inverse.z > 0.0f;
    // Ahead, on each axis? A ray along a plane stays between two.
    if (cell.x != start.cell.x && (ray.inverse.x == 0.0f || (cell.x > start.cell.x) != up_x)) return false;
    if (cell.y != start.cell.y && (ray.inverse.y == 0.0f || (cell.y > start.cell.y) != up_y)) return false;
    if (cell.z != start.cell.z && (ray.inverse.z == 0.0f || (cell.z > start.cell.z) != up_z)) return false;
    float in_x = cell.x == start.cell.x ? -kFarVoxels
                                        : texel_plane_crossing((up_x ? cell.x : cell.x + 1) * kBrickVoxels,
                                                               start.whole.x, ray.part.x, ray.inverse.x, -kFarVoxels);
    float in_y = cell.y == start.cell.y ? -kFarVoxels
                                        : texel_plane_crossing((up_y ? cell.y : cell.y + 1) * kBrickVoxels,
                                                               start.whole.y, ray.part.y, ray.inverse.y, -kFarVoxels);
    float in_z = cell.z == start.cell.z ? -kFarVoxels
                                        : texel_plane_crossing((up_z ? cell.z : cell.z + 1) * kBrickVoxels,
                                                               start.whole.z, ray.part.z, ray.inverse.z, -kFarVoxels);
    float out_x = texel_plane_crossing((up_x ? cell.x + 1 : cell.x) * kBrickVoxels, start.whole.x, ray.part.x,
                                       ray.inverse.x, kFarVoxels);
    float out_y = texel_plane_crossing((up_y ? cell.y + 1 : cell.y) * kBrickVoxels, start.whole.y, ray.part.y,
                                       ray.inverse.y, kFarVoxels);
    float out_z = texel_plane_crossing((up_z ? cell.z + 1 : cell.z) * kBrickVoxels, start.whole.z, ray.part.z,
                                       ray.inverse.z, kFarVoxels);
    if (in_x > -kFarVoxels && (entry_after_exit(in_x, 0, out_y, 1) || entry_after_exit(in_x, 0, out_z, 2)))
        return false;
    if (in_y > -kFarVoxels && (entry_after_exit(in_y, 1, out_x, 0) || entry_after_exit(in_y, 1, out_z, 2)))
        return false;
    if (in_z > -kFarVoxels && (entry_after_exit(in_z, 2, out_x, 0) || entry_after_exit(in_z, 2, out_y, 1)))
        return false;
    float last = max(max(in_x, in_y), in_z);
    axis = last == -kFarVoxels ? -1 : (last == in_z ? 2 : (last == in_y ? 1 : 0));
    t = max(start.t, last);
    return t <= t_max;
}

// The cell that the walk comes from when it enters `cell` across a plane of `axis`.
KILN_FN ivec3 box_march_before(TexelRay ray, ivec3 cell, int axis) {
    ivec3 before = cell;
    if (axis == 0) before.x -= ray.inverse.x > 0.0f ? 1 : -1;
    if (axis == 1) before.y -= ray.inverse.y > 0.0f ? 1 : -1;
    if (axis == 2) before.z -= ray.inverse.z > 0.0f ? 1 : -1;
    return before;
}

// Where field_march() ends: `cell` is one with the least t, any of them, of those on the way in which a march ends. The start's own cell is
// none of them: whoever asks has looked there first.
KILN_FN MarchHit box_march_end(GridParams grid, TexelRay ray, MarchStart start, ivec3 cell, float t_max) {
    MarchHit hit = march_miss(t_max);
    float t = start.t;
    int axis = -1;
    if (!box_march_visits(ray, start, cell, t_max, t, axis)) return hit;
    march_cell(grid, ray, cell, field_cell(cell), t, 0.0f, t_max, hit);
    float least = t;
    while (axis >= 0 && t == least) {
        cell = box_march_before(ray, cell, axis);
        if (!box_march_visits(ray, start, cell, t_max, t, axis) || axis < 0 || t != least) break;
        MarchHit earlier = march_miss(t_max);
        if (march_cell(grid, ray, cell, field_cell(cell), t, 0.0f, t_max, earlier)) hit = earlier;
    }
    return hit;
}
