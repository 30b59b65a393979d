// SPDX-License-Identifier: MIT
// Vesica: a lemon with its tips on the axis: what two discs share, their centres on both sides of the axis, turned about y.
// Exact everywhere (after the plane figure of Quilez, "2D distance functions", 2020).

struct Vesica {
    param radius;         // = 0.6 m, > 0: of both discs
    param half_distance;  // = 0.3 m, >= 0: axis to the centre of each disc, at most the radius
};

KILN_SDF real sd_vesica(real3 p, Vesica s) {
    param d = min(s.half_distance, s.radius);
    param tip = sqrt((s.radius - d) * (s.radius + d));
    real2 q = real2(from_axis(p), abs(p.y));
    real to_tip = length(real2(q.x, q.y - tip));
    real to_arc = length(real2(q.x + d, q.y)) - s.radius;
    return select(gt((q.y - tip) * d, q.x * tip), to_tip, to_arc);
}

#ifdef KILN_HOST
KILN_SDF Bounds bounds_vesica(Vesica s) {
    param d = min(s.half_distance, s.radius);
    return symmetric(s.radius - d, sqrt((s.radius - d) * (s.radius + d)), s.radius - d);
}
#endif
