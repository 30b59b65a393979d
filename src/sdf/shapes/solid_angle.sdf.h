// SPDX-License-Identifier: MIT
// Solid angle: the part of a ball within `half_angle` of +Y as seen from its centre. Exact everywhere.
// (Quilez, "Distance functions", 2008.)

struct SolidAngle {
    param radius;      // = 0.5 m, > 0: centre to the round surface
    param half_angle;  // = 0.6 rad, (0, 3.1415927]: between +Y and the conical surface
};

KILN_SDF real sd_solid_angle(real3 p, SolidAngle s) {
    param c = cos_of(s.half_angle);
    param n = max(sin_of(s.half_angle), 0.0f);
    real2 q = real2(from_axis(p), p.y);
    real t = clamp(q.x * n + q.y * c, 0.0f, s.radius);
    real side = length(real2(q.x - n * t, q.y - c * t));
    real cone = select(gt(c * q.x, n * q.y), side, -side);
    return max(length(q) - s.radius, cone);
}

#ifdef KILN_HOST
KILN_SDF Bounds bounds_solid_angle(SolidAngle s) {
    param r = s.radius * sin_of(min(s.half_angle, KILN_C(1.5707963267948966)));
    return Bounds{param3(-r, min(s.radius * cos_of(s.half_angle), 0.0f), -r), param3(r, s.radius, r)};
}
#endif
