// SPDX-License-Identifier: MIT
// Chain link: a ring in the local xy-plane, cut in half and pulled apart along y.
// Exact for minor_radius <= major_radius, and outside for any (Quilez, "Distance functions", 2008).

struct Link {
    param half_length;   // = 0.3 m, >= 0: half the length of the straight part
    param major_radius;  // = 0.3 m, > 0: centre of the ring to centre of the tube
    param minor_radius;  // = 0.1 m, > 0: radius of the tube
};

KILN_SDF real sd_link(real3 p, Link s) {
    real across = length(real2(p.x, max(abs(p.y) - s.half_length, 0.0f))) - s.major_radius;
    return length(real2(across, p.z)) - s.minor_radius;
}

#ifdef KILN_HOST
KILN_SDF Bounds bounds_link(Link s) {
    param r = s.major_radius + s.minor_radius;
    return symmetric(r, s.half_length + r, s.minor_radius);
}
#endif
