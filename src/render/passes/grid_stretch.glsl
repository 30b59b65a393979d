// SPDX-License-Identifier: MIT
// Where a ray is in the grid. The including kernel declares first what map.glsl asks for, and TexelRay.

// The grid's stretch of the ray; t_in > t_out: none.
void grid_stretch(TexelRay ray, out float t_in, out float t_out) {
    ivec3 whole = ray.whole - grid_first_cell() * kBrickVoxels;
    ivec3 size = ivec3(frame.grid.size_x, frame.grid.size_y, frame.grid.size_z) * kBrickVoxels;
    t_in = 0.0;
    t_out = kFarVoxels;
    for (int axis = 0; axis < 3; ++axis) {
        float low = float(-whole[axis]) - ray.part[axis];
        float high = float(size[axis] - whole[axis]) - ray.part[axis];
        if (ray.inverse[axis] == 0.0) {
            if (low > 0.0 || high <= 0.0) t_out = -1.0;
            continue;
        }
        t_in = max(t_in, (ray.inverse[axis] > 0.0 ? low : high) * ray.inverse[axis]);
        t_out = min(t_out, (ray.inverse[axis] > 0.0 ? high : low) * ray.inverse[axis]);
    }
}
