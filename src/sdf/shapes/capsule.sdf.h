// SPDX-License-Identifier: MIT
// Capsule: a segment along y, thickened. Exact everywhere.

struct Capsule {
    param half_height;  // = 0.5 m, >= 0: half the length of the segment, without the round ends
    param radius;       // = 0.25 m, > 0: segment to surface
};

KILN_SDF real sd_capsule(real3 p, Capsule s) {
    return length(real3(p.x, max(abs(p.y) - s.half_height, 0.0f), p.z)) - s.radius;
}

#ifdef KILN_HOST
KILN_SDF Bounds bounds_capsule(Capsule s) { return symmetric(s.radius, s.half_height + s.radius, s.radius); }
#endif
