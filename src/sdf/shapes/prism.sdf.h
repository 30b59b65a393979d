// SPDX-License-Identifier: MIT
// Prism along y over a regular polygon whose first vertex is on +X.
// Exact everywhere: the point is turned to the side nearest to it, where the polygon is a segment and its interior.

struct Prism {
    param sides;        // = 6 1, integer [3, 64]: number of sides
    param half_height;  // = 0.5 m, > 0: centre to each flat face
    param radius;       // = 0.5 m, > 0: axis to each vertex
};

KILN_SDF real sd_prism(real3 p, Prism s) {
    param n = clamp(floor(s.sides + 0.5f), 3.0f, 64.0f);
    param half_turn = KILN_C(3.141592653589793) / n;
    real side = floor(atan_of(p.z, p.x) * (0.5f / half_turn));
    real angle = (side + 0.5f) * (2.0f * half_turn);
    real c = cos_of(angle);
    real m = sin_of(angle);
    real across = c * p.x + m * p.z - s.radius * cos_of(half_turn);
    real along = abs(c * p.z - m * p.x) - s.radius * sin_of(half_turn);
    real d = select(gt(across, 0.0f), length(real2(across, max(along, 0.0f))), across);
    return corner(d, abs(p.y) - s.half_height);
}

#ifdef KILN_HOST
KILN_SDF Bounds bounds_prism(Prism s) {
    param n = clamp(floor(s.sides + 0.5f), 3.0f, 64.0f);
    param turn = KILN_C(6.283185307179586) / n;
    // The vertices nearest to -X and +Z.
    param x = -s.radius * cos_of(floor(n * 0.5f) * turn);
    param z = s.radius * max(sin_of(floor(n * 0.25f) * turn), sin_of(floor(n * 0.25f + 1.0f) * turn));
    return Bounds{param3(-x, -s.half_height, -z), param3(s.radius, s.half_height, z)};
}
#endif
