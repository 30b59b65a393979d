// SPDX-License-Identifier: MIT
// Torus: a circle of radius `major_radius` in the local xz-plane, thickened by `minor_radius`.
// Exact for minor_radius <= major_radius, and outside for any (Quilez, "Distance functions", 2008).

struct Torus {
    param major_radius;  // = 0.5 m, > 0: centre of the hole to centre of the tube
    param minor_radius;  // = 0.15 m, > 0: radius of the tube
};

KILN_SDF real sd_torus(real3 p, Torus s) {
    real2 q = real2(length(real2(p.x, p.z)) - s.major_radius, p.y);
    return length(q) - s.minor_radius;
}

#ifdef KILN_HOST
KILN_SDF Bounds bounds_torus(Torus s) {
    return symmetric(s.major_radius + s.minor_radius, s.minor_radius, s.major_radius + s.minor_radius);
}
#endif
