// SPDX-License-Identifier: MIT
// Elongate: the child is cut at its centre and pulled apart along each axis; what was at 0 fills the gap.
// Each coordinate is moved by a monotone 1-Lipschitz function, so distances only shrink.

struct Elongate {
    param3 half_extents;  // = (0.5, 0, 0) m, >= 0: half the length of the gap along each axis
};

KILN_SDF real3 warp_elongate(real3 p, Elongate s) { return p - clamp(p, -s.half_extents, s.half_extents); }

#ifdef KILN_HOST
// A child that lies to one side of the cut is not the tightest: its value stays small in the whole gap.
KILN_SDF Bounds bounds_elongate(Elongate s, Bounds child) {
    return Bounds{child.lo - s.half_extents, child.hi + s.half_extents};
}
KILN_SDF param lipschitz_elongate(Elongate, Bounds) { return 1.0f; }
#endif
