// SPDX-License-Identifier: MIT
// Cylinder along y with rounded rims; half height and radius are its outer size. Exact everywhere.

struct RoundedCylinder {
    param half_height;  // = 0.5 m, > 0: centre to each flat face
    param radius;       // = 0.5 m, > 0: axis to side
    param rounding;     // = 0.1 m, >= 0: radius of the rims, at most the smaller of half height and radius
};

KILN_SDF real sd_rounded_cylinder(real3 p, RoundedCylinder s) {
    param r = min(s.rounding, min(s.half_height, s.radius));
    return corner(from_axis(p) - (s.radius - r), abs(p.y) - (s.half_height - r)) - r;
}

#ifdef KILN_HOST
KILN_SDF Bounds bounds_rounded_cylinder(RoundedCylinder s) { return symmetric(s.radius, s.half_height, s.radius); }
#endif
