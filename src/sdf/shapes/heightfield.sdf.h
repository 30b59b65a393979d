// SPDX-License-Identifier: MIT
// Heightfield: a grid of numbers in [0, 1] over a rectangle of the local xz-plane; the ground is at y = height * value and solid
// below, down to y = -height, so the solid lies in the box of half extents (size.x / 2, height, size.y / 2) around the origin.
// The first row is the edge at -Z, the first column the edge at -X; between the numbers it is bilinear.
// Lower bound: height over ground divided by sqrt(1 + slope²), and the box.

struct Heightfield {
    param2 size;    // = (10, 10) m, > 0: extent along x and z
    param height;   // = 1 m, > 0: height of the number 1 over the number 0
    param first;    // = 0 1, internal: index of the grid's first number among the program's samples
    param columns;  // = 2 1, internal: numbers along x
    param rows;     // = 2 1, internal: numbers along z
    param slope;    // = 0 1, internal: steepest slope of the ground (slope_heightfield)
};

KILN_SDF real sd_heightfield(real3 p, Heightfield s, Samples samples) {
    real u = clamp((p.x / s.size.x + 0.5f) * (s.columns - 1.0f), 0.0f, s.columns - 1.0f);
    real v = clamp((p.z / s.size.y + 0.5f) * (s.rows - 1.0f), 0.0f, s.rows - 1.0f);
    real column = min(floor(u), max(s.columns - 2.0f, 0.0f));
    real row = min(floor(v), max(s.rows - 2.0f, 0.0f));
    whole right = whole_of(min(1.0f, s.columns - 1.0f) + 0.0f * u);
    whole down = whole_of(s.columns * min(1.0f, s.rows - 1.0f) + 0.0f * u);
    whole at = whole_of(s.first + 0.0f * u) + whole_of(row) * whole_of(s.columns + 0.0f * u) + whole_of(column);
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
    return max((p.y - ground) / sqrt(1.0f + s.slope * s.slope), outside + inside);
}

#ifdef KILN_HOST
KILN_SDF Bounds bounds_heightfield(Heightfield s) { return symmetric(0.5f * s.size.x, s.height, 0.5f * s.size.y); }

// Steepest slope of the bilinear ground: within a cell each partial derivative lies between those of two opposite edges.
KILN_SDF param slope_heightfield(Heightfield s, Samples samples) {
    const uint32_t columns = uint32_t(s.columns);
    const uint32_t rows = uint32_t(s.rows);
    const param per_x = s.height * (s.columns - 1.0f) / s.size.x;
    const param per_z = s.height * (s.rows - 1.0f) / s.size.y;
    param steepest = 0.0f;
    for (uint32_t row = 0; row < max(rows, 2u) - 1u; ++row) {
        for (uint32_t column = 0; column < max(columns, 2u) - 1u; ++column) {
            const uint32_t at = uint32_t(s.first) + row * columns + column;
            const uint32_t right = columns > 1u ? 1u : 0u;
            const uint32_t down = rows > 1u ? columns : 0u;
            const param a = sample_at(samples, at);
            const param b = sample_at(samples, at + right);
            const param c = sample_at(samples, at + down);
            const param d = sample_at(samples, at + down + right);
            const param dx = per_x * max(abs(b - a), abs(d - c));
            const param dz = per_z * max(abs(c - a), abs(d - b));
            steepest = max(steepest, sqrt(dx * dx + dz * dz));
        }
    }
    return steepest;
}
#endif
