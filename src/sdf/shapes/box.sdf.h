// SPDX-License-Identifier: MIT
// Box, axis-aligned in its own frame. Exact everywhere (Quilez, "Distance functions", 2008).

struct Box {
    param3 half_extents;  // = (0.5, 0.5, 0.5) m, > 0: centre to each face
};

KILN_SDF real sd_box(real3 p, Box s) {
    real3 q = abs(p) - s.half_extents;
    real outside = length(max(q, real3(0.0f, 0.0f, 0.0f)));
    real inside = min(max(q.x, max(q.y, q.z)), 0.0f);
    return outside + inside;
}

#ifdef KILN_HOST
KILN_SDF Bounds bounds_box(Box s) { return symmetric(s.half_extents.x, s.half_extents.y, s.half_extents.z); }
#endif
