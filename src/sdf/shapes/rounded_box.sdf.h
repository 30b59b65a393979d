// SPDX-License-Identifier: MIT
// Box with rounded edges and corners; `half_extents` is its outer size. Exact everywhere.

struct RoundedBox {
    param3 half_extents;  // = (0.5, 0.5, 0.5) m, > 0: centre to each face
    param rounding;       // = 0.1 m, >= 0: radius of the edges, at most the smallest half extent
};

KILN_SDF real sd_rounded_box(real3 p, RoundedBox s) {
    param r = min(s.rounding, min(s.half_extents.x, min(s.half_extents.y, s.half_extents.z)));
    real3 q = abs(p) - (s.half_extents - param3(r, r, r));
    real outside = length(max(q, real3(0.0f, 0.0f, 0.0f)));
    real inside = min(max(q.x, max(q.y, q.z)), 0.0f);
    return outside + inside - r;
}

#ifdef KILN_HOST
KILN_SDF Bounds bounds_rounded_box(RoundedBox s) {
    return symmetric(s.half_extents.x, s.half_extents.y, s.half_extents.z);
}
#endif
