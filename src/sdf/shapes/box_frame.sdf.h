// SPDX-License-Identifier: MIT
// Box frame: the twelve edges of a box as square beams; `half_extents` is its outer size.
// Exact outside: by symmetry the nearest point lies in the octant of p, and there the solid is three boxes.
// (Quilez, "Distance functions", 2008.)

struct BoxFrame {
    param3 half_extents;  // = (0.5, 0.5, 0.5) m, > 0: centre to each outer face
    param thickness;  // = 0.1 m, > 0: width of the beams, from the half extent on nothing is left open along that axis
};

// A beam: up to 0 along its own axis, within its half width across.
KILN_SDF real box_frame_beam(real along, real across, real other, param across_half, param other_half) {
    real3 q = real3(along, abs(across) - across_half, abs(other) - other_half);
    return length(max(q, real3(0.0f, 0.0f, 0.0f))) + min(max(q.x, max(q.y, q.z)), 0.0f);
}

KILN_SDF real sd_box_frame(real3 p, BoxFrame s) {
    real3 q = abs(p) - s.half_extents;
    // Half the beams' width; from the half extent on a beam fills its side and meets its mirror image.
    param3 e = min(param3(s.thickness, s.thickness, s.thickness) * 0.5f, s.half_extents);
    real3 o = q + e;
    return min(box_frame_beam(q.x, o.y, o.z, e.y, e.z),
               min(box_frame_beam(q.y, o.x, o.z, e.x, e.z), box_frame_beam(q.z, o.x, o.y, e.x, e.y)));
}

#ifdef KILN_HOST
KILN_SDF Bounds bounds_box_frame(BoxFrame s) { return symmetric(s.half_extents.x, s.half_extents.y, s.half_extents.z); }
#endif
