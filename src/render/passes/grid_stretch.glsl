// SPDX-License-Identifier: MIT
// Where a ray is in the grid, and in the box of what leaves it. The including kernel declares first what map.glsl asks for, and TexelRay.

// The stretch of a ray in the box from `low` to `high`, both from the ray's origin; t_in > t_out: none.
void box_stretch(vec3 low, vec3 high, vec3 inverse, out float t_in, out float t_out) {
    t_in = 0.0;
    t_out = kFarVoxels;
    for (int axis = 0; axis < 3; ++axis) {
        if (inverse[axis] == 0.0) {
            if (low[axis] > 0.0 || high[axis] <= 0.0) t_out = -1.0;
            continue;
        }
        t_in = max(t_in, (inverse[axis] > 0.0 ? low[axis] : high[axis]) * inverse[axis]);
        t_out = min(t_out, (inverse[axis] > 0.0 ? high[axis] : low[axis]) * inverse[axis]);
    }
}

void grid_stretch(TexelRay ray, out float t_in, out float t_out) {
    ivec3 whole = ray.whole - grid_first_cell() * kBrickVoxels;
    ivec3 size = ivec3(frame.grid.size_x, frame.grid.size_y, frame.grid.size_z) * kBrickVoxels;
    box_stretch(vec3(-whole) - ray.part, vec3(size - whole) - ray.part, ray.inverse, t_in, t_out);
}

// Where solids of the program of what leaves the grid may be met.
void outside_stretch(TexelRay ray, out float t_in, out float t_out) {
    vec3 origin = vec3(ray.whole) + ray.part;
    vec3 slack = 1.0 + 2.4e-7 * abs(origin);  // its rounding
    vec3 low = vec3(frame.outside_low_x, frame.outside_low_y, frame.outside_low_z);
    vec3 high = vec3(frame.outside_high_x, frame.outside_high_y, frame.outside_high_z);
    box_stretch(low - origin - slack, high - origin + slack, ray.inverse, t_in, t_out);
    t_in -= 1e-6 * t_in;
    t_out += 1e-6 * t_out;
}
