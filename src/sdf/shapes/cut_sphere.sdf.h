// SPDX-License-Identifier: MIT
// Cut sphere: the part of a ball above the plane y = height. Exact everywhere.

struct CutSphere {
    param radius;  // = 0.5 m, > 0: centre to the round surface
    param height;  // = 0 m, any: where the ball is cut, within -radius and radius
};

KILN_SDF real sd_cut_sphere(real3 p, CutSphere s) {
    param h = clamp(s.height, -s.radius, s.radius);
    param rim = sqrt((s.radius - h) * (s.radius + h));
    real2 q = real2(from_axis(p), p.y);
    real size = length(q);
    real round = size - s.radius;
    real flat_side = h - q.y;
    real inside = max(round, flat_side);
    // Outside: below the flat disc; else where the way to the centre enters the ball in its kept part; else the rim is nearest.
    real corner_d = length(real2(q.x - rim, q.y - h));
    real beside = select(both(gt(round, 0.0f), ge(q.y * s.radius, h * size)), round, corner_d);
    real outside = select(both(gt(flat_side, 0.0f), lt(q.x, rim)), flat_side, beside);
    return select(gt(inside, 0.0f), outside, inside);
}

#ifdef KILN_HOST
KILN_SDF Bounds bounds_cut_sphere(CutSphere s) {
    param h = clamp(s.height, -s.radius, s.radius);
    param r = h > 0.0f ? sqrt((s.radius - h) * (s.radius + h)) : s.radius;
    return Bounds{param3(-r, h, -r), param3(r, s.radius, r)};
}
#endif
