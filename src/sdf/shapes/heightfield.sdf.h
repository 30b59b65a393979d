// SPDX-License-Identifier: MIT
// Heightfield: ground at y = height * value over a rectangle of the local xz-plane, solid below, down to y = -height.
// So the solid lies in the box of half extents (size.x / 2, height, size.y / 2) around the origin. Values are in [0, 1].
// The first row is the edge at -Z, the first column the edge at -X; between the numbers it is bilinear.
// Lower bound: height over ground divided by sqrt(1 + slope²), and the box. Inside a cell each partial derivative of the bilinear
// ground lies between those of two opposite edges, so the slope is at most the length of (largest along x, largest along z).

struct Heightfield {
    param2 size;    // = (10, 10) m, > 0: extent along x and z
    param height;   // = 1 m, > 0: height of the number 1 over the number 0
    param first;    // = 0 1, internal: index of the grid's first number among the program's samples
    param columns;  // = 2 1, internal: numbers along x
    param rows;     // = 2 1, internal: numbers along z
    param step_x;   // = 0 1, internal: largest difference between neighbours along x
    param step_z;   // = 0 1, internal: largest difference between neighbours along z
};

KILN_SDF real sd_heightfield(real3 p, Heightfield s, Samples samples) {
    real u = clamp((p.x / s.size.x + 0.5f) * (s.columns - 1.0f), 0.0f, s.columns - 1.0f);
    real v = clamp((p.z / s.size.y + 0.5f) * (s.rows - 1.0f), 0.0f, s.rows - 1.0f);
    real column = min(floor(u), s.columns - 2.0f);
    real row = min(floor(v), s.rows - 2.0f);
    whole down = whole_of(real(s.columns));
    whole at = whole_of(real(s.first)) + whole_of(row) * down + whole_of(column);
    whole right = whole(1u);
    real fu = u - column;
    real fv = v - row;
    real near_left = sample_at(samples, at);
    real near_right = sample_at(samples, at + right);
    real far_left = sample_at(samples, at + down);
    real far_right = sample_at(samples, at + down + right);
    real near = near_left + (near_right - near_left) * fu;
    real far = far_left + (far_right - far_left) * fu;
    real ground = s.height * (near + (far - near) * fv);
    real3 q = abs(p) - real3(0.5f * s.size.x, s.height, 0.5f * s.size.y);
    real outside = length(max(q, real3(0.0f, 0.0f, 0.0f)));
    real inside = min(max(q.x, max(q.y, q.z)), 0.0f);
    param slope_x = s.height * s.step_x * (s.columns - 1.0f) / s.size.x;
    param slope_z = s.height * s.step_z * (s.rows - 1.0f) / s.size.y;
    return max((p.y - ground) / sqrt(1.0f + slope_x * slope_x + slope_z * slope_z), outside + inside);
}

#ifdef KILN_HOST
KILN_SDF Bounds bounds_heightfield(Heightfield s) { return symmetric(0.5f * s.size.x, s.height, 0.5f * s.size.y); }
#endif
