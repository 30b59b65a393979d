// SPDX-License-Identifier: MIT
// Capped torus: an arc in the local xz-plane about +X, `half_angle` to both sides, thickened by `minor_radius`.
// Its ends are half balls. Exact outside, and inside for minor_radius <= major_radius.

struct CappedTorus {
    param major_radius;  // = 0.5 m, > 0: centre of the arc's circle to centre of the tube
    param minor_radius;  // = 0.15 m, > 0: radius of the tube
    param half_angle;    // = 2 rad, (0, 3.1415927]: the arc reaches from -half_angle to +half_angle about +X
};

KILN_SDF real sd_capped_torus(real3 p, CappedTorus s) {
    param c = cos_of(s.half_angle);
    param n = max(sin_of(s.half_angle), 0.0f);
    real2 q = real2(p.x, abs(p.z));
    // Beside the arc: angle of q <= half_angle. Elsewhere its end is nearest.
    real beside = length(q) - s.major_radius;
    real2 end = real2(q.x - c * s.major_radius, q.y - n * s.major_radius);
    real across = select(ge(n * q.x, c * q.y), beside, length(end));
    return length(real2(across, p.y)) - s.minor_radius;
}

#ifdef KILN_HOST
KILN_SDF Bounds bounds_capped_torus(CappedTorus s) {
    param z = s.major_radius * sin_of(min(s.half_angle, KILN_C(1.5707963267948966))) + s.minor_radius;
    return Bounds{param3(s.major_radius * cos_of(s.half_angle) - s.minor_radius, -s.minor_radius, -z),
                  param3(s.major_radius + s.minor_radius, s.minor_radius, z)};
}
#endif
