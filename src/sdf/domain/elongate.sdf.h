// SPDX-License-Identifier: MIT
// Elongate: the child is cut at its centre and pulled apart along each axis; what was at 0 fills the gap.
// Each coordinate is moved by a monotone 1-Lipschitz function, so distances only shrink.

struct Elongate {
    param3 half_extents;  // = (0.5, 0, 0) m, >= 0: half the length of the gap along each axis
};

KILN_SDF real3 warp_elongate(real3 p, Elongate s) { return p - clamp(p, -s.half_extents, s.half_extents); }

#ifdef KILN_HOST
KILN_SDF Bounds bounds_elongate(Elongate s, Bounds child) {
    const param3 h = s.half_extents;
    return Bounds{param3(child.lo.x > 0.0f ? child.lo.x + h.x : child.lo.x - h.x,
                         child.lo.y > 0.0f ? child.lo.y + h.y : child.lo.y - h.y,
                         child.lo.z > 0.0f ? child.lo.z + h.z : child.lo.z - h.z),
                  param3(child.hi.x < 0.0f ? child.hi.x - h.x : child.hi.x + h.x,
                         child.hi.y < 0.0f ? child.hi.y - h.y : child.hi.y + h.y,
                         child.hi.z < 0.0f ? child.hi.z - h.z : child.hi.z + h.z)};
}
KILN_SDF param lipschitz_elongate(Elongate, Bounds) { return 1.0f; }
#endif
