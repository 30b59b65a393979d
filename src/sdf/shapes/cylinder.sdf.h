// SPDX-License-Identifier: MIT
// Cylinder along y. Exact everywhere.

struct Cylinder {
    param half_height;  // = 0.5 m, > 0: centre to each flat face
    param radius;       // = 0.5 m, > 0: axis to side
};

KILN_SDF real sd_cylinder(real3 p, Cylinder s) { return corner(from_axis(p) - s.radius, abs(p.y) - s.half_height); }

#ifdef KILN_HOST
KILN_SDF Bounds bounds_cylinder(Cylinder s) { return symmetric(s.radius, s.half_height, s.radius); }
#endif
