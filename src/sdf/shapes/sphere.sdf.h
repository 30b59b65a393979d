// SPDX-License-Identifier: MIT
// Sphere. Exact everywhere.

struct Sphere {
    param radius;  // = 0.5 m, > 0: centre to surface
};

KILN_SDF real sd_sphere(real3 p, Sphere s) { return length(p) - s.radius; }

#ifdef KILN_HOST
KILN_SDF Bounds bounds_sphere(Sphere s) { return symmetric(s.radius, s.radius, s.radius); }
#endif
